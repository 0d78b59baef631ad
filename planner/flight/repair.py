"""Lead a leg around what stands in its way: the socket to the motion solvers."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.config import FlightSettings
from planner.flight.certificate import Certificate, Space, certify
from planner.flight.path import CONTROL_DECIMALS, JOINT_DECIMALS
from planner.flight.smooth import corner, departure, polyline
from planner.geometry.arrays import Floats

if TYPE_CHECKING:
    from solvers.result import Result

SHRINK = (1.0, 0.5, 0.25, 0.125)
"""Shares of the full handle, or of the full corner cut, that are tried in turn."""


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """Outcome of one search for a way around.

    Parameters
    ----------
    points
        Corners from the leg's start to its end, shape (n, 3), metres, or ``None`` without any.
    result
        What the solver says.

    """

    points: Floats | None
    result: "Result[Floats]"


def find_way(
    start: Floats,
    end: Floats,
    airspace: Space,
    *,
    settings: FlightSettings,
    seed: int,
) -> Way:
    """Search for a polyline that keeps its distance, by a motion solver with exact edge checks.

    The dice depend on the two places and the seed alone, and the way back is the way there: so
    neither the order of the legs nor what else is flown changes the result.

    Parameters
    ----------
    start, end
        Free points, shape (3,), metres.
    airspace
        Solids and zones.
    settings
        Margin, name of the solver and its number of validity checks.
    seed
        Root of all chance.

    Returns
    -------
    way
        Its points are ``None`` if the solver found nothing within its checks.

    """
    from solvers import Stop, solve
    from solvers.motion import MotionProblem

    required = airspace.d_min + settings.margin
    swapped = tuple(end) < tuple(start)
    first, last = (end, start) if swapped else (start, end)
    low, high = airspace.bounds
    bounds = np.stack(
        [np.minimum(low, np.minimum(start, end)), np.maximum(high, np.maximum(start, end))]
    )
    problem = MotionProblem(
        first,
        last,
        bounds,
        lambda point: point_is_free(point, airspace, required, settings.margin),
        lambda a, b: edge_is_free(a, b, airspace, required, settings.margin),
        step=required,
    )
    result = solve(
        problem,
        settings.solver,
        seed=_seed(first, last, seed),
        stop=Stop(iterations=settings.iterations),
    )
    if result.solution is None:
        return Way(None, result)
    return Way(result.solution[::-1] if swapped else result.solution, result)


def smooth_way(
    points: Floats,
    leaving: Floats,
    arriving: Floats,
    airspace: Space,
    *,
    settings: FlightSettings,
) -> tuple[Floats, Certificate] | None:
    """Certified pieces along a polyline, its corners rounded as far as the proof allows.

    A corner that cannot be rounded stays sharp, an end that cannot take up the tangent of its
    viewpoint starts straight; the aircraft stops and turns there.

    Parameters
    ----------
    points
        Corners, shape (n, 3), n >= 2, metres.
    leaving, arriving
        Unit tangents at the two viewpoints, shape (3,).
    airspace, settings
        As :func:`find_way`.

    Returns
    -------
    pieces
        Control points (m, 4, 3) and their certificate, or ``None`` if not even the straight
        edges can be proven.

    """
    nodes = _distinct(points)
    cuts = _corner_cuts(nodes, airspace, settings)
    chain = _chain(nodes, cuts)
    for row, tangent, backwards in ((0, leaving, False), (-1, arriving, True)):
        if len(chain) == 1:
            break
        for share in SHRINK:
            trial = np.round(
                departure(chain[row], tangent, settings.handle * share, backwards=backwards),
                CONTROL_DECIMALS,
            )
            if proven(trial[None], airspace, settings).safe[0]:
                chain[row] = trial
                break
    for pieces in (chain, np.round(polyline(nodes), CONTROL_DECIMALS)):
        certificate = proven(pieces, airspace, settings)
        if certificate.safe.all():
            return pieces, certificate
    return None


def proven(controls: Floats, airspace: Space, settings: FlightSettings) -> Certificate:
    """Certificate of pieces, shape (M, 4, 3), for ``d_min`` and the settings' margin."""
    return certify(
        controls,
        airspace,
        required=airspace.d_min + settings.margin,
        zone_required=settings.margin,
    )


def point_is_free(point: Floats, airspace: Space, required: float, margin: float) -> bool:
    """Whether one point, shape (3,), is so far from solids and zones."""
    spot = point[None]
    return bool(airspace.clearance(spot)[0] >= required and airspace.zone_margin(spot)[0] >= margin)


def edge_is_free(a: Floats, b: Floats, airspace: Space, required: float, margin: float) -> bool:
    """Whether the whole straight edge is; one of its ends must be known to be."""
    return airspace.capsule_clearance_at_least(a, b, required) and airspace.zone_margin_at_least(
        a, b, margin
    )


def _corner_cuts(nodes: Floats, airspace: Space, settings: FlightSettings) -> Floats:
    """How far from each inner node its corner is cut off, shape (n,), 0 where it stays sharp."""
    sides = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    widest = np.zeros(len(nodes))
    widest[1:-1] = 0.5 * np.minimum(sides[:-1], sides[1:])
    cuts = np.zeros(len(nodes))
    for share in SHRINK:
        rows = np.flatnonzero((cuts == 0.0) & (widest > 0.0)).tolist()
        if not rows:
            break
        trial = np.stack([_corner(nodes, row, share * widest[row]) for row in rows])
        safe = proven(np.round(trial, CONTROL_DECIMALS), airspace, settings).safe
        for row in np.array(rows)[safe].tolist():
            cuts[row] = share * widest[row]
    return cuts


def _chain(nodes: Floats, cuts: Floats) -> Floats:
    """Straight pieces and rounded corners in turn, sharing their rounded ends exactly."""
    pieces, at = [], nodes[0]
    for row in range(1, len(nodes)):
        bend = None
        if cuts[row] > 0.0:
            bend = np.round(_corner(nodes, row, cuts[row]), CONTROL_DECIMALS)
        target = nodes[row] if bend is None else bend[0]
        if np.linalg.norm(target - at) > 0.0:
            pieces.append(np.round(polyline(np.stack([at, target])), CONTROL_DECIMALS)[0])
        if bend is not None:
            pieces.append(bend)
        at = pieces[-1][3]
    return np.stack(pieces)


def _corner(nodes: Floats, row: int, cut: float) -> Floats:
    return corner(nodes[row - 1], nodes[row], nodes[row + 1], cut)


def _distinct(points: Floats) -> Floats:
    """Rounded corners without repeated ones; first and last stay."""
    nodes = np.round(points, CONTROL_DECIMALS)
    moved = np.linalg.norm(np.diff(nodes, axis=0), axis=1) > 10.0**-JOINT_DECIMALS
    kept = nodes[np.concatenate([[True], moved])]
    kept[-1] = nodes[-1]
    return kept if len(kept) > 1 else nodes[[0, -1]]


def _seed(first: Floats, last: Floats, root: int) -> int:
    """Seed that depends on the two places, not on when their leg is looked at."""
    places = np.round(np.concatenate([first, last]) * 10.0**JOINT_DECIMALS).astype(np.int64)
    words = places.view(np.uint32).tolist()
    return int(np.random.SeedSequence(root, spawn_key=tuple(words)).generate_state(1)[0])
