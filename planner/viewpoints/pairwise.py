"""Choose photos by what pairs of them can triangulate: the socket for pair solvers."""

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import Candidates, add_poses, generate_candidates
from planner.viewpoints.pairs import VisiblePairs, visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, parallax_weight
from planner.viewpoints.sight import SightRule
from planner.viewpoints.thinning import thin_lattice
from planner.viewpoints.viewpoints import Viewpoints
from solvers import Result, Stop, solve
from solvers.pairs import PairCoverProblem, chord_table
from solvers.registry import load

_SAME_PLACE = 1e-6  # metres


@dataclass(frozen=True, slots=True)
class Effort:
    """How long the search may take.

    Parameters
    ----------
    positions
        Positions to choose from.
    iterations
        Iterations of the pair solver.

    """

    positions: int
    iterations: int


EFFORTS = {
    "quick": Effort(1_500, 60),
    "standard": Effort(2_500, 800),
    "best": Effort(5_000, 3_000),
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
        Results of the solver.

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
    start: Viewpoints,
    rule: SightRule,
    settings: ViewpointSettings,
    voxel: float,
    seed: int,
) -> PairChoice:
    """Choose the fewest photos that make enough samples reconstructable.

    Parameters
    ----------
    positions
        Free positions, shape (V, 3), metres.
    samples, caster, camera
        What is to be photographed, what may be in the way, and the field of view.
    start
        Photos to start from, at some of the positions.
    rule
        What makes a photo of a sample sharp: range, incidence and GSD.
    settings, voxel, seed
        Target and effort; spacing of the positions, metres; root of the solver's chance.

    """
    effort = EFFORTS[settings.effort]
    rows = thin_lattice(positions, spacing=voxel, limit=effort.positions)
    places = np.unique(np.concatenate([positions[rows], start.positions]), axis=0)
    pairs = visible_pairs(places, samples, caster, wide_rule(rule, settings))
    candidates = generate_candidates(
        places,
        pairs,
        samples,
        camera,
        aims=settings.aims,
        directions=settings.aim_directions,
        weights=1.0 / np.sqrt(np.maximum(pairs.available, 1)),
    )
    first = len(candidates)
    candidates = add_poses(
        candidates,
        samples,
        camera,
        owner=_places_of(start.positions, places),
        yaw_deg=start.yaw_deg,
        pitch_deg=start.pitch_deg,
    )
    problem = pair_problem(candidates, samples, rule=rule, settings=settings)
    begin = tuple(range(first, len(candidates)))[: settings.budget]
    result = _search(problem, begin, settings, effort, seed)
    chosen = np.empty(0, dtype=np.int64) if result.solution is None else result.solution
    views = candidates.viewpoints(chosen, samples, kind="pair")
    return PairChoice(views, problem.reachable, (result,))


def _search(
    problem: PairCoverProblem,
    start: tuple[int, ...],
    settings: ViewpointSettings,
    effort: Effort,
    seed: int,
) -> Result[Ints]:
    """Run the pair solver; the built-in ones begin with the start."""
    own = settings.pair_solver in {"greedy", "lns"}
    solver = load("pairs", settings.pair_solver, **({"start": start} if own else {}))
    stop = Stop(iterations=settings.iterations or effort.iterations)
    return solve(problem, solver, seed=seed, stop=stop)


def wide_rule(rule: SightRule, settings: ViewpointSettings) -> SightRule:
    """What counts for reconstructability though it may not be sharp."""
    farthest = settings.pair_range * reference_distance(rule)
    return replace(rule, d_max=farthest, max_incidence=GRAZING, reach=math.inf, sectors=1)


def reference_distance(rule: SightRule) -> float:
    """Distance at which a photo is worth nothing: twice the one that just meets the GSD."""
    return 2.0 * rule.reach


def pair_problem(
    candidates: Candidates,
    samples: SurfaceSamples,
    *,
    rule: SightRule,
    settings: ViewpointSettings,
) -> PairCoverProblem:
    """Candidates x samples with rays, distances and cosines as reconstructability wants them."""
    from scipy.sparse import csr_array

    pairs, hit = candidates.pairs, candidates.pair
    sample = pairs.sample[hit]
    owner = np.repeat(candidates.owner, np.diff(candidates.indptr))
    rays = candidates.positions[owner] - samples.xyz[sample]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    shape = (len(candidates), len(samples))
    ones = np.ones(len(hit), dtype=np.int8)
    return PairCoverProblem(
        csr_array((ones, sample, candidates.indptr), shape=shape),
        rays,
        1.0 - pairs.distance[hit] / reference_distance(rule),
        pairs.cosine[hit],
        weights=chord_table(parallax_weight),
        target=settings.target,
        share=settings.share,
        budget=settings.budget,
        fine=_sharp(pairs, rule)[hit],
        fine_demand=settings.sharp_views,
    )


def _sharp(pairs: VisiblePairs, rule: SightRule) -> Bools:
    """Which pairs a rule allows that have passed a wider one, shape (n,)."""
    facing = pairs.cosine >= math.cos(rule.max_incidence)
    near = pairs.distance <= np.minimum(rule.d_max, rule.reach * pairs.cosine)
    return np.asarray(facing & near)


def _places_of(positions: Floats, places: Floats) -> Ints:
    """Row among ``places`` of each of ``positions``."""
    from scipy.spatial import cKDTree

    if not len(positions):
        return np.empty(0, dtype=np.int64)
    away, row = cKDTree(places).query(positions)
    if np.max(away) > _SAME_PLACE:
        raise ValueError(f"a start is {np.max(away)} m from any position.")
    return np.asarray(row, dtype=np.int64)
