"""Choose the photos: the socket where set-cover solvers plug in (paper section 3.3.2)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.config import ViewpointSettings
from planner.findings import Finding
from planner.geometry.arrays import Bytes, Floats, Ints
from planner.scene.cloud import Mesh
from planner.surface.samples import ScoredSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import Candidates
from planner.viewpoints.completion import complete_cover
from planner.viewpoints.cover import cover_candidates, photo_prices
from planner.viewpoints.demand import Demand, view_demand
from planner.viewpoints.pairs import visible_pairs
from planner.viewpoints.paper import paper_viewpoints
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reasons import REASONS, Reason, explain
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import count_views
from solvers import Result, Stop, solve
from solvers.cover import CoverProblem

_SCARCE = 2  # times its demand: a sample that fewer places see


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """The chosen photos and what they see.

    Parameters
    ----------
    viewpoints
        Where photos are taken, in no particular order.
    hits
        From how many distinct places each sample is seen, shape (S,), by fresh rays.
    sectors
        From how many distinct direction sectors each sample is seen, shape (S,).
    demand
        How many of both each sample wanted.
    reachable
        As much of that as all free positions together can give.
    stages
        From how many free positions each sample is within range and incidence, within the
        gimbal's range as well, within the GSD as well, and unoccluded, shape (4, S).
    reason
        A :class:`~planner.viewpoints.reasons.Reason` each, shape (S,).
    results
        Results of the solvers that were called, with cost and proven lower bound.
    findings
        What could not be fulfilled, or was done otherwise than asked.
    reasons
        Name of each reason by its code.

    """

    viewpoints: Viewpoints
    hits: Ints
    sectors: Ints
    demand: Demand
    reachable: Demand
    stages: NDArray[np.int32]
    reason: Bytes
    results: tuple[Result[Ints], ...] = ()
    findings: tuple[Finding, ...] = ()
    reasons: tuple[str, ...] = REASONS

    def reason_counts(self) -> dict[str, int]:
        """How many samples ended with each reason."""
        counts = np.bincount(self.reason, minlength=len(self.reasons))
        return {name: int(count) for name, count in zip(self.reasons, counts, strict=True)}


def select_viewpoints(
    positions: Floats,
    mesh: Mesh,
    samples: ScoredSamples,
    camera: Camera,
    *,
    settings: ViewpointSettings,
    d_min: float,
    d_max: float,
    gsd: float,
    voxel: float,
    seed: int = 0,
    map: Callable[..., Any] = map,  # noqa: A002 - it is a map
    airspace: object | None = None,  # noqa: ARG001 - for refinement off the grid
) -> Selection:
    """Choose viewpoints by the preset of the settings.

    Parameters
    ----------
    positions
        Free positions, shape (V, 3), metres, local frame.
    mesh
        Surface that may be in the way.
    samples
        What is to be photographed, with the quality of the prior.
    camera
        Field of view and gimbal range.
    settings
        Preset, solver and demands.
    d_min, d_max
        Closest and farthest distance from camera to sample, metres.
    gsd
        Wanted ground sample distance, metres a pixel.
    voxel
        Spacing of the positions, metres.
    seed
        Root of the solver's chance.
    map
        Runs the clusters of preset ``paper``; anything that looks like :func:`map`.
    airspace
        Where flight is safe.

    Returns
    -------
    selection
        Viewpoints, and a reason for every sample.

    """
    caster = RayCaster(mesh)
    rule = SightRule.of(camera, settings, d_min=d_min, d_max=d_max, gsd=gsd)
    pairs = visible_pairs(positions, samples, caster, rule)
    results: tuple[Result[Ints], ...] = ()
    if settings.preset == "paper":
        wanted = np.full(len(samples), settings.marks)
        demand = Demand(wanted, np.zeros_like(wanted))
        reachable = demand.clipped(pairs.available, pairs.sides)
        viewpoints = paper_viewpoints(
            positions,
            samples,
            caster,
            camera,
            settings=settings,
            d_min=d_min,
            d_max=d_max,
            voxel=voxel,
            map=map,
        )
    else:
        demand = view_demand(samples.quality, settings)
        reachable = demand.clipped(pairs.available, pairs.sides)
        candidates = cover_candidates(
            positions, pairs, samples, camera, demand=demand, settings=settings
        )
        prices = photo_prices(candidates, settings=settings, d_min=d_min, d_max=d_max)
        chosen, results = _cover(candidates, reachable, prices, settings, seed)
        viewpoints = candidates.viewpoints(chosen, samples, kind="cover")
    seen = count_views(viewpoints, samples, caster, camera, rule)
    reason = explain(seen.hits, seen.sectors, demand, pairs.stages)
    asked = settings.preset == "cover"  # marks are what preset `paper` promises
    unmet = _unmet(reason, seen.hits, seen.sectors, reachable, asked=asked)
    return Selection(
        viewpoints,
        seen.hits,
        seen.sectors,
        demand,
        reachable,
        pairs.stages,
        reason,
        results,
        unmet,
    )


def reassess(
    selection: Selection,
    viewpoints: Viewpoints,
    mesh: Mesh,
    samples: ScoredSamples,
    camera: Camera,
    *,
    settings: ViewpointSettings,
    d_min: float,
    d_max: float,
    gsd: float,
) -> Selection:
    """Selection with other viewpoints, such as those left after some were dropped.

    Hits, sectors and reasons are worked out anew by fresh rays; the rest stays.
    """
    rule = SightRule.of(camera, settings, d_min=d_min, d_max=d_max, gsd=gsd)
    seen = count_views(viewpoints, samples, RayCaster(mesh), camera, rule)
    reason = explain(seen.hits, seen.sectors, selection.demand, selection.stages)
    asked = settings.preset == "cover"
    unmet = _unmet(reason, seen.hits, seen.sectors, selection.reachable, asked=asked)
    return replace(
        selection,
        viewpoints=viewpoints,
        hits=seen.hits,
        sectors=seen.sectors,
        reason=reason,
        findings=unmet,
    )


def _cover(
    candidates: Candidates,
    demand: Demand,
    prices: Floats,
    settings: ViewpointSettings,
    seed: int,
) -> tuple[Ints, tuple[Result[Ints], ...]]:
    """Solve the cover; without the rule of one photo a place where that leads nowhere.

    Photos from one place share no parallax, but the solver counts them as several hits; what
    that leaves open is filled in afterwards.
    """
    stop = Stop(iterations=settings.iterations)
    results: list[Result[Ints]] = []
    for conflicts in (_shared_places(candidates, demand), []):
        problem = _problem(candidates, demand, prices, conflicts)
        results.append(solve(problem, settings.solver, seed=seed, stop=stop))
        if results[-1].solution is not None:
            break
    chosen = results[-1].solution
    chosen = np.empty(0, dtype=np.int64) if chosen is None else chosen
    return complete_cover(candidates, chosen, demand=demand, prices=prices), tuple(results)


def _shared_places(candidates: Candidates, demand: Demand) -> list[Ints]:
    """Candidates of one place each, of which one photo is enough.

    Places that see a scarce sample are left out: they may have to look several ways.
    """
    pairs = candidates.pairs
    scarce = pairs.available < _SCARCE * demand.hits
    busy = np.zeros(len(candidates.positions), dtype=np.bool_)
    busy[pairs.position[scarce[pairs.sample]]] = True
    order = np.argsort(candidates.owner, kind="stable")
    starts = np.flatnonzero(np.diff(candidates.owner[order], prepend=-1))
    groups = (np.sort(rows) for rows in np.split(order, starts[1:]))
    return [rows for rows in groups if len(rows) > 1 and not busy[candidates.owner[rows[0]]]]


def _problem(
    candidates: Candidates, demand: Demand, prices: Floats, places: list[Ints]
) -> CoverProblem:
    """Poses cover samples; a hit's sector is the side from which the sample is seen."""
    from scipy.sparse import csr_array

    sample = candidates.sample
    shape = (len(candidates), len(demand.hits))
    ones = np.ones(len(sample), dtype=np.int8)
    return CoverProblem(
        csr_array((ones, sample, candidates.indptr), shape=shape),
        prices,
        demand.hits,
        sectors=candidates.pairs.sector[candidates.pair],
        sector_demand=demand.sectors,
        conflicts=places,
    )


def _unmet(
    reason: Bytes, hits: Ints, sectors: Ints, reachable: Demand, *, asked: bool
) -> tuple[Finding, ...]:
    """Findings on samples that no photos could cover, and on those that these do not."""
    short = (hits < reachable.hits) | (sectors < reachable.sectors)
    found = []
    for code, rows, words, partial in (
        ("samples-short", short, "are seen less often than they could be", asked),
        ("samples-out-of-reach", (reason != Reason.COVERED) & ~short, "cannot be covered", False),
    ):
        count = int(np.count_nonzero(rows))
        if count:
            message = f"{count} of {len(reason)} samples {words}"
            found.append(Finding("viewpoints", code, message, float(count), partial))
    return tuple(found)
