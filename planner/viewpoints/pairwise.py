"""Choose photos by what pairs of them can triangulate: the socket for pair solvers."""

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.airspace.airspace import Airspace
from planner.config import ViewpointSettings
from planner.errors import PlannerError
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.crowd import Crowd
from planner.viewpoints.demand import sharp_demand
from planner.viewpoints.free_balls import FreeBalls, free_balls
from planner.viewpoints.hunt import Hunt, Slack
from planner.viewpoints.moves import Wish
from planner.viewpoints.pairs import VisiblePairs
from planner.viewpoints.pool import Pool
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.refine import poses_beside
from planner.viewpoints.sight import SightRule
from planner.viewpoints.subject import Subject
from planner.viewpoints.viewpoints import Viewpoints
from solvers import Result

_FEWEST = 200  # positions to choose from, where there are so many
_CLIMB = 0.2  # of the reference distance: the first step of a photo that is moved, at first
_EVALUATIONS = 16  # places that a photo tries when it is moved
_SPARE = 1.5  # of the target: what photos are moved for
_SHARP = 0.25  # of the target: what a wanted sharp photo is worth to them
_STEP = 0.6  # voxels between a photo and the poses beside it at most, at first
_TURN = math.radians(12.0)  # that these are turned at most, at first
_SHRINK = 0.3  # of all three from the first round to behind the last one
_CHECKS = 4  # times that guards are looked at, if there are as many rounds
_KEY = 4  # of the chance in this stage
_NONE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Effort:
    """How long the search may take; numbers are for each photo that it takes to see every sample.

    Parameters
    ----------
    positions
        Positions of the first and the last search.
    iterations
        Iterations of the pair solver in each of them.
    rounds
        Rounds in between, off the grid.
    climbs
        How often each photo is moved in a round.
    around
        Positions that the search of a round may choose from besides.
    steps
        Iterations of the pair solver in a round.
    copies
        Poses added beside each chosen one in a round.

    """

    positions: float
    iterations: float
    rounds: int
    climbs: int
    around: float
    steps: float
    copies: int


EFFORTS = {
    "quick": Effort(100.0, 4.0, 2, 1, 20.0, 20.0, 2),
    "standard": Effort(150.0, 10.0, 7, 1, 40.0, 40.0, 4),
    "best": Effort(225.0, 20.0, 18, 2, 40.0, 50.0, 4),
}
"""What each effort may take; docs/views.md has the times measured."""


@dataclass(frozen=True, slots=True, eq=False)
class PairChoice:
    """Photos chosen by what pairs of them can triangulate.

    Parameters
    ----------
    viewpoints
        The photos.
    reachable
        Which samples can reach the target from the positions looked at, shape (S,).
    possible
        Which can reach the floor, where there is one, else the same.
    results
        Of the last search, and where guards or a floor were planned for of what completed its
        answer; the last one has the bound.
    subject, grid
        What was to be photographed, and poses to choose further photos from.

    """

    viewpoints: Viewpoints
    reachable: Bools
    possible: Bools
    results: tuple[Result[Ints], ...]
    subject: Subject
    grid: Pool


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
    airspace: Airspace | None,
    margin: float,
    guards: SurfaceSamples | None = None,
) -> PairChoice:
    """Choose the fewest photos that make enough samples reconstructable.

    The first search has the grid's positions with their best aims to choose from. In each round
    the photos are moved one by one to where they add most to the others, and a search goes on
    from them, with a thinner grid and poses beside them to choose from: what the moves have made
    redundant it drops. The last search has the first one's grid again, and a bound.

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
        Where flight is safe; without it, photos stay on the positions.
    margin
        What the flight keeps beyond ``d_min``, and from zones, metres.
    guards
        Other samples of the same surface. Whenever photos miss more of them than the shares allow,
        those missed are planned for too, but for so many.

    """
    effort = EFFORTS[settings.effort]
    wanted = sharp_demand(sharp.available, settings).hits
    subject = Subject.of(samples, caster, camera, rule, settings, sharp=wanted)
    layer = _layer(subject, positions, voxel)
    few, many = (
        subject.grid(positions, spacing=voxel, limit=max(_FEWEST, round(count)), sharp=sharp)
        for count in (effort.around * layer, effort.positions * layer)
    )
    first, *between, last = _iterations(effort, layer, settings.iterations)
    problem = subject.problem(many)
    result = subject.search(problem, _NONE, iterations=first, seed=seed)
    if result.solution is None:
        raise PlannerError(
            f"viewpoints.pair_solver = {settings.pair_solver!r}: found no photos in {first} "
            f"iterations ({result.stop_reason}); choose another or raise viewpoints.iterations"
        )
    if not len(result.solution):
        none = many.take(_NONE).viewpoints(_NONE, samples, kind="pair")
        return PairChoice(none, problem.reachable, problem.reachable, (result,), subject, few)
    hunt = Hunt.begun(
        *(subject, few, many, result),
        chosen=result.solution,
        guards=guards if settings.budget is None else None,
    )
    mover = _Mover(free_balls(positions, airspace, margin=margin), effort, voxel, seed)
    for number, iterations in enumerate(between):
        if number * _CHECKS % effort.rounds < _CHECKS:
            hunt = hunt.guarded()
        hunt = mover.improved(hunt, number, iterations=iterations)
    return _finish(hunt, subject, many, iterations=last, seed=seed)


def within_reach(
    viewpoints: Viewpoints,
    positions: Floats,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    rule: SightRule,
    settings: ViewpointSettings,
    voxel: float,
) -> Bools:
    """Tell which samples can reach the target, whoever chose the photos.

    Parameters
    ----------
    viewpoints
        Photos that were chosen, and may be off the grid that :func:`choose_by_pairs` begins with.
    positions, samples, caster, camera, rule, settings, voxel
        As of :func:`choose_by_pairs`.

    Returns
    -------
    within_reach
        Shape (S,).

    """
    none = np.zeros(len(samples), dtype=np.int64)
    subject = Subject.of(samples, caster, camera, rule, settings, sharp=none)
    count = EFFORTS["quick"].positions * _layer(subject, positions, voxel)
    grid = subject.grid(positions, spacing=voxel, limit=max(_FEWEST, round(count)))
    own = subject.at(viewpoints.positions, viewpoints.yaw_deg, viewpoints.pitch_deg)
    return subject.problem(grid.joined(own)).reachable


def _layer(subject: Subject, positions: Floats, voxel: float) -> float:
    """Number of photos that it takes to see every sample once, about."""
    probe = subject.grid(positions, spacing=voxel, limit=_FEWEST)
    return len(subject.samples) * len(probe) / max(1, len(probe.sample))


def _iterations(effort: Effort, layer: float, total: int | None) -> list[int]:
    """Iterations of the first search, of each round's and of the last, as told or in all."""
    shares = np.array([effort.iterations, *[effort.steps] * effort.rounds, effort.iterations])
    scale = layer if total is None else total / shares.sum()
    return [max(1, round(share * scale)) for share in shares]


@dataclass(frozen=True, slots=True, eq=False)
class _Mover:
    """Moves photos in rounds, each followed by a search among them."""

    room: FreeBalls
    effort: Effort
    voxel: float
    seed: int

    def improved(self, hunt: Hunt, number: int, *, iterations: int) -> Hunt:
        """One more round, the ``number``-th from 0."""
        subject, scale = hunt.subject, _SHRINK ** (number / self.effort.rounds)
        hunt = replace(hunt, kept=self._moved(hunt, step=_CLIMB * scale * subject.reference))
        poses = poses_beside(
            *(hunt.kept, self.room, subject.camera),
            step=_STEP * scale * self.voxel,
            turn=_TURN * scale,
            copies=self.effort.copies,
            seed=np.random.SeedSequence(self.seed, spawn_key=(_KEY, number)),
        )
        seed = self.seed + number + 1
        return hunt.searched(hunt.few, subject.at(*poses), iterations=iterations, seed=seed)

    def _moved(self, hunt: Hunt, *, step: float) -> Pool:
        """Photos moved one by one to where they add most."""
        subject, kept = hunt.subject, hunt.kept
        crowd = Crowd(
            *(kept.positions, kept.yaw_deg, kept.pitch_deg),
            eye=subject.eye,
            space=self.room,
            camera=subject.camera,
            wish=Wish(
                _SPARE * subject.target,
                subject.sharp,
                sharp_worth=_SHARP * subject.settings.target,
                sharp=subject.rule,
            ),
            directions=subject.settings.aim_directions,
        )
        for _ in range(self.effort.climbs):
            crowd.move(step=step, evaluations=_EVALUATIONS)
        return subject.at(crowd.positions, crowd.yaw_deg, crowd.pitch_deg)


def _finish(hunt: Hunt, subject: Subject, many: Pool, *, iterations: int, seed: int) -> PairChoice:
    """Search once more on the first grid, and prove what was asked for.

    With guards or a floor the photos are completed for the ``subject`` without guards, first to
    the floor and then to the target, whose bound it is.
    """
    hunt = hunt.guarded()
    more = hunt.subject.guards > 0 or subject.floor > 0.0
    if more:
        hunt = hunt.searched(hunt.many, None, iterations=iterations, seed=seed)
    kept = hunt.kept
    pool = many.joined(subject.at(kept.positions, kept.yaw_deg, kept.pitch_deg))
    problem, start = subject.problem(pool), len(many) + np.arange(len(kept))
    results: tuple[Result[Ints], ...]
    firm = possible = problem.reachable
    if subject.floor > 0.0:
        firm, possible = subject.reach(pool)
        can = int(np.count_nonzero(possible))
        slack = Slack.of(int(np.count_nonzero(firm)), can, subject.settings)
        low = subject.wanting(np.ones(len(firm), dtype=np.bool_), subject.sharp)
        lifted = low.completed(low.problem(pool, wanted=can - slack.lost), start).solution
        start = start if lifted is None else lifted
    if more:
        results = (hunt.result, subject.completed(problem, start, bounded=True))
    else:
        results = (subject.search(problem, start, iterations=iterations, seed=seed, bounded=True),)
    chosen = start if results[-1].solution is None else results[-1].solution
    views = pool.viewpoints(chosen, subject.samples, kind="pair")
    return PairChoice(views, firm, possible, results, subject, hunt.few)
