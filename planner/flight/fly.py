"""From viewpoints in order to a certified flight; what cannot be flown safely is left out."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.airspace.space import Space
from planner.config import FlightSettings
from planner.findings import Finding
from planner.flight.curve import Leg
from planner.flight.legs import Legs, Pair
from planner.flight.path import JOINT_DECIMALS, FlightPath
from planner.flight.reach import largest_group, unbroken_runs
from planner.geometry.arrays import Floats, Ints, read_only
from planner.route.ways import FreeWays
from planner.viewpoints.viewpoints import Viewpoints

if TYPE_CHECKING:
    from solvers.result import Result


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """A safe flight and what had to give for it.

    Parameters
    ----------
    path
        The curve; it numbers viewpoints as ``viewpoints`` does.
    viewpoints
        Those that are flown through, in order, at the rounded positions of the path.
    kept
        Their rows in what was asked for, shape (K,).
    closed
        Whether the path returns to its first viewpoint.
    findings
        What was dropped and why.
    repaired
        Legs that a motion planner led around something, shape (r,).
    results
        What the motion solver said, one result a search.

    """

    path: FlightPath
    viewpoints: Viewpoints
    kept: Ints
    closed: bool
    findings: tuple[Finding, ...]
    repaired: Ints
    results: "tuple[Result[Floats], ...]"

    def __post_init__(self) -> None:
        for name in ("kept", "repaired"):
            rows = read_only(getattr(self, name), (None,), name=name, dtype=np.int64)
            object.__setattr__(self, name, rows)


def plan_flight(
    viewpoints: Viewpoints,
    airspace: Space,
    *,
    settings: FlightSettings = FlightSettings(),  # noqa: B008 - an immutable value
    closed: bool = False,
    seed: int = 0,
    ways: FreeWays | None = None,
    only: Ints | None = None,
) -> Flight:
    """Fly through the viewpoints in their order, along a curve proven to keep its distance.

    A leg whose chord is free becomes one Bezier piece, with the handles that fly it
    soonest among those that are proven.
    A leg whose chord is blocked is led around by a motion solver that starts from the roadmap's
    way, rounded and proven; failing that it is flown along proven straight edges. Viewpoints that
    are not free themselves, or that no safe way joins to the largest group of the others, are
    dropped with a finding each, and the order is closed up.

    Parameters
    ----------
    viewpoints
        In visiting order.
    airspace
        Solids and zones.
    settings
        Handles, margin, solver.
    closed
        Whether to return to the first viewpoint.
    seed
        Root of the motion solver's chance.
    ways
        Free ways in this airspace with this margin, if some are known already.
    only
        Rows to fly through, rising, where that is not all of them.

    Returns
    -------
    flight
        Each piece of its path is certified to keep ``d_min`` and the margin, and all zones.

    """
    spots = np.round(viewpoints.positions, JOINT_DECIMALS) + 0.0
    known = FreeWays(airspace, margin=settings.margin) if ways is None else ways
    legs = Legs(spots, airspace, settings, seed, known)
    asked = np.arange(len(spots)) if only is None else only
    rows, findings = _free_rows(spots, asked, airspace, settings.margin)
    while True:  # each round but the last drops a viewpoint or leaves the tour open
        ring = closed and len(rows) > 1
        pairs = _pairs(rows, closed=ring)
        broken = legs.broken(pairs)
        if not any(broken):
            flown = legs.fly(pairs, closed=ring)
            if flown is not None:
                break
            broken = legs.broken(pairs)
        if ring and sum(broken) == 1:
            rows, closed = np.roll(rows, -(broken.index(True) + 1)), False
            findings.append(_left_open(viewpoints, rows))
            continue
        group = _reachable(rows, broken, legs, closed=ring)
        findings += [_unreachable(row, spots) for row in rows.tolist() if row not in group]
        rows = np.array([row for row in rows.tolist() if row in group], dtype=np.int64)
    path = _assemble(flown, closed=ring, count=len(rows))
    return Flight(
        path=path,
        viewpoints=_moved(viewpoints.take(rows), spots[rows]),
        kept=rows,
        closed=ring,
        findings=tuple(findings),
        repaired=np.flatnonzero([leg.repaired for leg in flown]),
        results=tuple(legs.results),
    )


def _free_rows(
    spots: Floats, asked: Ints, airspace: Space, margin: float
) -> tuple[Ints, list[Finding]]:
    """Those that keep their distance where they are, and a finding for each other one."""
    if not len(asked):
        return np.zeros(0, dtype=np.int64), []
    required = airspace.d_min + margin
    low, high = airspace.bounds
    at = spots[asked]
    clearance, zones = airspace.clearance(at), airspace.zone_margin(at)
    beyond = np.maximum(low - at, at - high).max(axis=1)
    findings = []
    for k, row in enumerate(asked.tolist()):
        if not clearance[k] >= required:
            reason = f"is {clearance[k]:.4f} m from solids where {required:.4f} m are kept"
        elif not zones[k] >= margin:
            reason = f"lacks {margin - zones[k]:.4f} m to zones or the ceiling"
        elif not beyond[k] <= 0.0:
            reason = f"is {beyond[k]:.3f} m beyond the space that is known"
        else:
            continue
        findings.append(_dropped(row, spots, reason))
    lost = {int(finding.number) for finding in findings}
    return np.array([row for row in asked.tolist() if row not in lost], np.int64), findings


def _pairs(rows: Ints, *, closed: bool) -> list[Pair]:
    order = rows.tolist()
    following = order[1:] + order[:1] if closed else order[1:]
    return list(zip(order, following, strict=False))


def _reachable(rows: Ints, broken: list[bool], legs: Legs, *, closed: bool) -> set[int]:
    """Viewpoints to go on with: the largest group, and at least one less than before."""
    runs = unbroken_runs(rows, broken, closed=closed)
    group = largest_group(runs, legs.joined)
    if len(group) < len(rows):
        return group
    return group - {_loose_end(runs, closed=closed)}


def _loose_end(runs: list[list[int]], *, closed: bool) -> int:
    """Viewpoint to give up where all are joined, but not in this order: beside a broken leg."""
    before, after = (runs[-1], runs[0]) if closed else (runs[0], runs[1])
    return after[0] if len(after) <= len(before) else before[-1]


def _assemble(legs: list[Leg], *, closed: bool, count: int) -> FlightPath:
    """Path of all legs, whose viewpoints are numbered in their order."""
    pieces = [len(leg.controls) for leg in legs]
    reached = np.full(sum(pieces), -1, dtype=np.int64)
    reached[np.cumsum(pieces, dtype=np.int64) - 1] = np.arange(1, len(legs) + 1)
    if closed and legs:
        reached[-1] = 0
    return FlightPath(
        controls=np.concatenate([np.zeros((0, 4, 3)), *(leg.controls for leg in legs)]),
        leg=np.repeat(np.arange(len(legs)), pieces),
        reached=reached,
        start=0 if count else -1,
        repaired=np.repeat([leg.repaired for leg in legs], pieces),
        clearance=np.concatenate([np.zeros(0), *(leg.clearance for leg in legs)]),
        zone_margin=np.concatenate([np.zeros(0), *(leg.zone_margin for leg in legs)]),
    )


def _moved(viewpoints: Viewpoints, positions: Floats) -> Viewpoints:
    return Viewpoints(
        positions, viewpoints.yaw_deg, viewpoints.pitch_deg, viewpoints.kind, viewpoints.targets
    )


def _dropped(row: int, spots: Floats, reason: str) -> Finding:
    x, y, z = spots[row]
    message = f"viewpoint {row} at ({x:.2f}, {y:.2f}, {z:.2f}) {reason}"
    return Finding("flight", "viewpoint-dropped", message, float(row))


def _unreachable(row: int, spots: Floats) -> Finding:
    return _dropped(row, spots, "is joined to the other viewpoints by no safe way that was found")


def _left_open(viewpoints: Viewpoints, rows: Ints) -> Finding:
    x, y, z = viewpoints.positions[rows[0]]
    message = f"no safe way back to ({x:.2f}, {y:.2f}, {z:.2f}) was found, so the tour stays open"
    return Finding("flight", "tour-left-open", message)
