"""Choose the photos: the socket where set-cover solvers plug in (paper section 3.3.2)."""

from collections.abc import Callable
from typing import Any

import numpy as np

from planner.airspace.airspace import Airspace
from planner.config import FLIGHT_MARGIN, ViewpointSettings
from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.images import Images
from planner.surface.samples import ScoredSamples, SurfaceSamples
from planner.viewpoints.anchors import Anchors
from planner.viewpoints.bridges import connect
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import Candidates
from planner.viewpoints.completion import complete_cover
from planner.viewpoints.cover import cover_candidates, photo_prices
from planner.viewpoints.demand import Demand, even_demand, sharp_demand, view_demand
from planner.viewpoints.forbidden import hindrances, kept_out
from planner.viewpoints.graph import LinkRule
from planner.viewpoints.growth import spent
from planner.viewpoints.pairs import visible_pairs
from planner.viewpoints.pairwise import PairChoice, choose_by_pairs, within_reach
from planner.viewpoints.paper import paper_viewpoints
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.selection import FloorWish, PairWish, Selection, Wish, assess, reassess
from planner.viewpoints.sight import SightRule
from planner.viewpoints.smith import smith_viewpoints
from planner.viewpoints.ties import Matching, tie
from solvers import Result, Stop, solve
from solvers.cover import CoverProblem

__all__ = ["Selection", "reassess", "select_viewpoints"]

_SCARCE = 2  # times its demand: a sample that fewer places see


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
    airspace: Airspace | None = None,
    margin: float = FLIGHT_MARGIN,
    images: Images | None = None,
    guards: SurfaceSamples | None = None,
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
        Where flight is safe; tells which samples only zones keep from being seen.
    margin
        What the flight keeps beyond ``d_min``, and from zones, metres.
    images
        Photos of the first flight, to match with.
    guards
        Other samples of the surface: what of them pairs of photos would miss is planned for too,
        so that the photos suit the surface and not its samples alone.

    Returns
    -------
    selection
        Viewpoints, and a reason for every sample.

    """
    caster = RayCaster(mesh)
    rule = SightRule.of(camera, settings, d_min=d_min, d_max=d_max, gsd=gsd)
    pairs = visible_pairs(positions, samples, caster, rule)
    covers = settings.preset == "cover"
    demand = view_demand(samples.quality, settings) if covers else even_demand(samples, settings)
    reachable = demand.clipped(pairs.available, pairs.sides)
    zoned = None
    if airspace is not None:
        unseen = np.flatnonzero(pairs.available == 0)
        zoned = kept_out(samples, unseen, caster, rule, airspace)
    stages = hindrances(pairs, positions, samples, caster, rule)
    wish = Wish(demand, reachable, stages, binding=covers, zoned=zoned)
    results: tuple[Result[Ints], ...] = ()
    found: PairChoice | None = None
    if covers and settings.objective == "reconstructability":
        found = choose_by_pairs(
            *(positions, samples, caster, camera),
            sharp=pairs,
            rule=rule,
            settings=settings,
            voxel=voxel,
            seed=seed,
            airspace=airspace,
            margin=margin,
            guards=guards,
        )
        viewpoints, results = found.viewpoints, found.results
        sharp = sharp_demand(pairs.available, settings)
        wish = _pair_wish(wish, found.reachable, sharp, settings, possible=found.possible)
    elif covers:
        candidates = cover_candidates(
            positions, pairs, samples, camera, demand=demand, settings=settings
        )
        prices = photo_prices(candidates, settings=settings, d_min=d_min, d_max=d_max)
        chosen, results = _cover(candidates, reachable, prices, settings, seed)
        viewpoints = candidates.viewpoints(chosen, samples, kind="cover")
    elif settings.preset == "smith":
        viewpoints = smith_viewpoints(
            *(positions, samples, caster, camera),
            reference=2.0 * rule.reach,
            settings=settings,
            map=map,
            airspace=airspace,
            margin=margin,
        )
        possible = within_reach(
            *(viewpoints, positions, samples, caster, camera),
            rule=rule,
            settings=settings.model_copy(update={"pair_range": 1.0}),
            voxel=voxel,
        )
        nothing = Demand(np.zeros_like(demand.hits), np.zeros_like(demand.sectors))
        wish = _pair_wish(wish, possible, nothing, settings)
    else:
        lengths = {"d_min": d_min, "d_max": d_max, "voxel": voxel}
        viewpoints = paper_viewpoints(
            positions, samples, caster, camera, settings=settings, map=map, **lengths
        )
    links, reference = LinkRule.of(settings), 2.0 * rule.reach
    anchors = Anchors.of(images, samples, caster, camera, ties=settings.ties)
    if covers and settings.connected:
        if anchors is not None:
            matching = Matching(samples, caster, camera, anchors, reference, links)
            viewpoints = tie(viewpoints, positions, matching, airspace=airspace, margin=margin)
        viewpoints = connect(
            *(viewpoints, positions, samples, caster, camera),
            reference=reference,
            links=links,
            anchors=anchors,
        )
        count = settings.budget
        if found is not None and count and (anchors is None or len(viewpoints) < count):
            every = np.arange(len(found.grid))
            offers = found.grid.viewpoints(every, found.subject.samples, kind="pair")
            viewpoints = spent(viewpoints, offers, found.subject, links=links, count=count)
    return assess(
        *(viewpoints, samples, caster, camera, rule),
        wish=wish,
        links=links,
        results=results,
        anchors=anchors,
    )


def _pair_wish(
    wish: Wish,
    reachable: Bools,
    sharp: Demand,
    settings: ViewpointSettings,
    *,
    possible: Bools | None = None,
) -> Wish:
    """Wish of pairs of photos instead of single ones; ``possible`` samples can have the floor."""
    given = settings.views if settings.preset == "smith" else settings.budget
    floor = None
    if settings.floors and possible is not None:
        floor = FloorWish(settings.floor * settings.target, settings.floor_share, possible)
    pairs = PairWish(settings.target, settings.share, reachable, given is not None, floor)
    having = Demand(np.minimum(sharp.hits, wish.stages[3]), sharp.sectors)
    return Wish(sharp, having, wish.stages, binding=True, pairs=pairs, zoned=wish.zoned)


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
