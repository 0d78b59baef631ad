"""Choose photos by what pairs of them can triangulate: the socket for pair solvers."""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.airspace.airspace import Airspace
from planner.config import ViewpointSettings
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import direct_aim, generate_candidates, most_frontal
from planner.viewpoints.free_balls import free_balls
from planner.viewpoints.pairs import VisiblePairs, visible_pairs
from planner.viewpoints.pool import Pool
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, parallax_weight
from planner.viewpoints.refine import poses_beside
from planner.viewpoints.sight import SightRule
from planner.viewpoints.thinning import thin_lattice
from planner.viewpoints.viewpoints import Viewpoints
from solvers import Result, Stop, solve
from solvers.pairs import PairCoverProblem, chord_table
from solvers.registry import load

_FEWEST = 200  # positions to choose from, where there are so many
_STEP = 0.6  # voxels that a pose is moved at most, at first
_TURN = math.radians(12.0)  # that an aim is turned at most, at first
_SHRINK = 0.8  # of both from one refinement to the next
_SURE = 1.001  # times the target, since the table and single precision are a little off
_BOUND_STEPS = 60
_KEY = 4  # of the chance in this stage


@dataclass(frozen=True, slots=True)
class Effort:
    """How long the search may take.

    Parameters
    ----------
    positions
        Positions to choose from, for each photo that it takes to see every sample once.
    iterations
        Iterations of the pair solver over all its searches, for each such photo.
    refinements
        Searches after the first, each with poses beside the chosen ones added.
    copies
        Poses added beside each chosen one.

    """

    positions: float
    iterations: float
    refinements: int
    copies: int


EFFORTS = {
    "quick": Effort(100.0, 30.0, 2, 4),
    "standard": Effort(150.0, 250.0, 6, 6),
    "best": Effort(225.0, 625.0, 14, 8),
}
"""What each effort may take; see docs for the times measured."""


@dataclass(frozen=True, slots=True, eq=False)
class PairChoice:
    """Photos chosen by what pairs of them can triangulate.

    Parameters
    ----------
    viewpoints
        The photos.
    reachable
        Which samples can reach the target from the positions looked at, shape (S,).
    results
        Result of the last search.

    """

    viewpoints: Viewpoints
    reachable: Bools
    results: tuple[Result[Ints], ...]


def choose_by_pairs(
    positions: Floats,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    sharp: VisiblePairs,
    rule: SightRule,
    settings: ViewpointSettings,
    voxel: float,
    seed: int,
    airspace: Airspace | None = None,
) -> PairChoice:
    """Choose the fewest photos that make enough samples reconstructable.

    The first search has the grid's positions with their best aims to choose from. Each further
    one goes on from the photos chosen so far, with poses beside them added, off the grid.

    Parameters
    ----------
    positions
        Free positions, shape (V, 3), metres.
    samples, caster, camera
        What is to be photographed, what may be in the way, and the field of view.
    sharp, rule
        What each position sees sharply, and by which limits on range, incidence and GSD.
    settings, voxel, seed
        Target and effort; spacing of the positions, metres; root of all chance.
    airspace
        Where flight is safe; without it, poses are turned but not moved.

    """
    effort = EFFORTS[settings.effort]
    wide = wide_rule(rule, settings)

    def grid(limit: int) -> tuple[Floats, Pool]:
        places = positions[thin_lattice(positions, spacing=voxel, limit=limit)]
        pool = _grid_pool(places, samples, caster, camera, rule=wide, settings=settings)
        return places, pool

    probe = grid(_FEWEST)[1]
    layer = len(samples) * len(probe) / max(1, len(probe.sample))  # photos, each sample once
    places, base = grid(max(_FEWEST, round(effort.positions * layer)))
    rare = _sharp_poses(base, positions, sharp, samples, camera, rule=rule, settings=settings)
    shown = partial(Pool.at, samples=samples, caster=caster, camera=camera, rule=wide)
    base = base.joined(shown(*rare)) if len(rare[0]) else base
    room = free_balls(np.concatenate([places, rare[0]]), airspace)
    total = settings.iterations or max(1, round(effort.iterations * layer))
    rounds = min(effort.refinements, total - 1)
    pool, chosen, result = base, np.empty(0, dtype=np.int64), None
    for number in range(rounds + 1):
        if number:
            kept = pool.take(chosen)
            poses = poses_beside(
                *(kept, room, camera),
                step=_STEP * voxel * _SHRINK ** (number - 1),
                turn=_TURN * _SHRINK ** (number - 1),
                copies=effort.copies,
                seed=np.random.SeedSequence(seed, spawn_key=(_KEY, number)),
            )
            pool = base.joined(kept).joined(shown(*poses))
            chosen = len(base) + np.arange(len(kept))
        problem = pair_problem(pool, samples, rule=rule, settings=settings)
        its = total * (number + 1) // (rounds + 1) - total * number // (rounds + 1)
        last = number == rounds
        result = _search(problem, chosen, settings, iterations=its, seed=seed, bounded=last)
        if result.solution is None:
            break
        chosen = result.solution
    views = pool.viewpoints(chosen, samples, kind="pair")
    return PairChoice(views, problem.reachable, (result,) if result else ())


def _grid_pool(
    places: Floats,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    rule: SightRule,
    settings: ViewpointSettings,
) -> Pool:
    """The best aims of each place."""
    pairs = visible_pairs(places, samples, caster, rule)
    candidates = generate_candidates(
        *(places, pairs, samples, camera),
        aims=settings.aims,
        directions=settings.aim_directions,
        weights=1.0 / np.sqrt(np.maximum(pairs.available, 1)),
    )
    return Pool.of(candidates)


def _sharp_poses(
    pool: Pool,
    positions: Floats,
    sharp: VisiblePairs,
    samples: SurfaceSamples,
    camera: Camera,
    *,
    rule: SightRule,
    settings: ViewpointSettings,
) -> tuple[Floats, Floats, Floats]:
    """Poses that look straight at samples which the pool shows sharply less often than wanted."""
    held = np.bincount(pool.sample[_sharp(pool, rule)], minlength=len(samples))
    lack = np.minimum(settings.sharp_views, sharp.available) - held
    row = most_frontal(sharp, np.zeros(len(sharp), dtype=np.bool_), lack.clip(0))
    places = positions[np.searchsorted(sharp.indptr, row, side="right") - 1]
    return places, *direct_aim(places, samples.xyz[sharp.sample[row]], camera)


def _search(
    problem: PairCoverProblem,
    start: Ints,
    settings: ViewpointSettings,
    *,
    iterations: int,
    seed: int,
    bounded: bool,
) -> Result[Ints]:
    """Run the pair solver; the built-in ones begin with the start, and bound if told to."""
    own = settings.pair_solver in {"greedy", "lns"}
    options = {"start": tuple(start.tolist()), "bound_steps": _BOUND_STEPS if bounded else 0}
    solver = load("pairs", settings.pair_solver, **(options if own else {}))
    return solve(problem, solver, seed=seed, stop=Stop(iterations=iterations))


def wide_rule(rule: SightRule, settings: ViewpointSettings) -> SightRule:
    """What counts for reconstructability though it may not be sharp."""
    farthest = settings.pair_range * reference_distance(rule)
    return replace(rule, d_max=farthest, max_incidence=GRAZING, reach=math.inf, sectors=1)


def reference_distance(rule: SightRule) -> float:
    """Distance at which a photo is worth nothing: twice the one that just meets the GSD."""
    return 2.0 * rule.reach


def pair_problem(
    pool: Pool,
    samples: SurfaceSamples,
    *,
    rule: SightRule,
    settings: ViewpointSettings,
) -> PairCoverProblem:
    """Poses x samples with rays, distances and cosines as reconstructability wants them."""
    from scipy.sparse import csr_array

    shape = (len(pool), len(samples))
    ones = np.ones(len(pool.sample), dtype=np.int8)
    return PairCoverProblem(
        csr_array((ones, pool.sample, pool.indptr), shape=shape),
        pool.rays(samples),
        1.0 - pool.distance / reference_distance(rule),
        pool.cosine,
        weights=chord_table(parallax_weight),
        target=_SURE * settings.target,
        share=settings.share,
        budget=settings.budget,
        fine=_sharp(pool, rule),
        fine_demand=settings.sharp_views,
    )


def _sharp(pool: Pool, rule: SightRule) -> Bools:
    """Which hits a rule allows that have passed a wider one, shape (n,)."""
    facing = pool.cosine >= math.cos(rule.max_incidence)
    near = pool.distance <= np.minimum(rule.d_max, rule.reach * pool.cosine)
    return np.asarray(facing & near)
