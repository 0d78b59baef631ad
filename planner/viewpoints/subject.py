"""What is to be photographed and how photos of it are judged, wherever they are taken."""

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import direct_aim, generate_candidates, most_frontal
from planner.viewpoints.eye import Eye
from planner.viewpoints.pairs import VisiblePairs, visible_pairs
from planner.viewpoints.pool import Pool
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, pair_sums, parallax_weight
from planner.viewpoints.sight import SightRule
from planner.viewpoints.thinning import thin_lattice
from solvers import Result, Stop, StopReason, solve
from solvers.errors import InvalidSolution
from solvers.pairs import PairCoverProblem, chord_table
from solvers.registry import load

_SURE = 1.001  # times the target, since the table and single precision are a little off
_BOUND_STEPS = 200


@dataclass(frozen=True, slots=True, eq=False)
class Missed:
    """Guards that photos miss though others could show them.

    Parameters
    ----------
    rows
        Which guards, shape (n,).
    firm
        Whether each could reach the target rather than the floor alone, shape (n,).
    lost
        Whether each is below the floor, shape (n,).

    """

    rows: Ints
    firm: Bools
    lost: Bools


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """Samples and the rules by which photos of them count.

    Parameters
    ----------
    samples, caster, camera
        What is to be photographed, what may be in the way, and the field of view.
    rule
        Limits on range, incidence and GSD of a sharp photo.
    settings
        Target, share and solver.
    target
        Wanted reconstructability of each sample, shape (S,).
    sharp
        Sharp photos that each sample wants, shape (S,).
    guards
        How many of the samples, the last ones, are guards: the share is not of them, and none is
        wanted sharply.

    """

    samples: SurfaceSamples
    caster: RayCaster
    camera: Camera
    rule: SightRule
    settings: ViewpointSettings
    target: Floats
    sharp: Ints
    guards: int = 0

    @classmethod
    def of(
        cls,
        samples: SurfaceSamples,
        caster: RayCaster,
        camera: Camera,
        rule: SightRule,
        settings: ViewpointSettings,
        *,
        sharp: Ints,
    ) -> "Subject":
        """Samples that all want the target of the settings; ``sharp`` as above."""
        target = np.full(len(samples), settings.target)
        return cls(samples, caster, camera, rule, settings, target, sharp)

    @property
    def planned(self) -> int:
        """How many samples the share is of."""
        return len(self.samples) - self.guards

    @property
    def reference(self) -> float:
        """Distance at which a photo is worth nothing: twice the one that just meets the GSD."""
        return 2.0 * self.rule.reach

    @property
    def wide(self) -> SightRule:
        """What counts for reconstructability though it may not be sharp."""
        farthest = self.settings.pair_range * self.reference
        return replace(self.rule, d_max=farthest, max_incidence=GRAZING, reach=math.inf, sectors=1)

    @property
    def eye(self) -> Eye:
        """Sees what counts for reconstructability from anywhere."""
        return Eye(self.samples, self.caster, self.wide, self.reference)

    def at(self, positions: Floats, yaw_deg: Floats, pitch_deg: Floats) -> Pool:
        """What any poses show, by fresh rays; shapes (K, 3), (K,) and (K,)."""
        return Pool.at(
            *(positions, yaw_deg, pitch_deg),
            samples=self.samples,
            caster=self.caster,
            camera=self.camera,
            rule=self.wide,
        )

    def grid(
        self, positions: Floats, *, spacing: float, limit: int, sharp: VisiblePairs | None = None
    ) -> Pool:
        """The best aims of evenly thinned positions, and sharp poses where these lack them.

        Parameters
        ----------
        positions
            Free positions on a lattice, shape (V, 3), metres.
        spacing
            Of the lattice, metres.
        limit
            About how many positions to keep.
        sharp
            What each position sees sharply; without it, no poses are added.

        """
        places = positions[thin_lattice(positions, spacing=spacing, limit=limit)]
        pairs = visible_pairs(places, self.samples, self.caster, self.wide)
        candidates = generate_candidates(
            *(places, pairs, self.samples, self.camera),
            aims=self.settings.aims,
            directions=self.settings.aim_directions,
            weights=1.0 / np.sqrt(np.maximum(pairs.available, 1)),
        )
        pool = Pool.of(candidates)
        if sharp is None:
            return pool
        rare = self._sharp_poses(pool, positions, sharp)
        return pool.joined(self.at(*rare)) if len(rare[0]) else pool

    def _sharp_poses(
        self, pool: Pool, positions: Floats, sharp: VisiblePairs
    ) -> tuple[Floats, Floats, Floats]:
        """Poses straight at samples which the pool shows sharply less often than wanted."""
        held = np.bincount(pool.sample[self._is_sharp(pool)], minlength=self.planned)
        lack = np.minimum(self.sharp[: self.planned], sharp.available) - held
        row = most_frontal(sharp, np.zeros(len(sharp), dtype=np.bool_), lack.clip(0))
        places = positions[np.searchsorted(sharp.indptr, row, side="right") - 1]
        return places, *direct_aim(places, self.samples.xyz[sharp.sample[row]], self.camera)

    def problem(self, pool: Pool, *, wanted: int | None = None) -> PairCoverProblem:
        """Poses x samples with rays, distances and cosines as reconstructability wants them.

        Parameters
        ----------
        pool
            The poses.
        wanted
            How many samples must be satisfied; without it, the ``share`` of the settings of
            those that can be.

        """
        problem = self._problem(pool, self.settings.share)
        can = int(np.count_nonzero(problem.reachable))
        if wanted is None or problem.wanted == wanted or not can:
            return problem
        return self._problem(pool, min(1.0, wanted / can))

    def guarded(self, guards: SurfaceSamples) -> "Subject":
        """The same with more samples behind its own."""
        mine = self.samples
        both = SurfaceSamples(
            np.concatenate([mine.xyz, guards.xyz]),
            np.concatenate([mine.normals, guards.normals]),
            np.concatenate([mine.cluster, guards.cluster]),
            mine.radius,
        )
        return replace(
            self,
            samples=both,
            target=np.concatenate([self.target, np.full(len(guards), self.settings.target)]),
            sharp=np.pad(self.sharp, (0, len(guards))),
            guards=self.guards + len(guards),
        )

    def missed(self, others: SurfaceSamples, photos: Pool, pool: Pool) -> Missed:
        """Which other samples the photos miss though the poses of a pool could show them."""
        seen = replace(self, samples=others).at(photos.positions, photos.yaw_deg, photos.pitch_deg)
        h = pair_sums(
            seen.sample.astype(np.int64),
            seen.rays(others).astype(np.float64),
            seen.distance.astype(np.float64),
            seen.cosine.astype(np.float64),
            size=len(others),
            reference=self.reference,
        )
        short = np.flatnonzero(h < self.settings.target)
        there = replace(
            self,
            samples=others.places(short),
            target=np.full(len(short), self.settings.target),
            sharp=np.zeros(len(short), dtype=np.int64),
            guards=len(short),
        )
        firm, possible = there.reach(there.at(pool.positions, pool.yaw_deg, pool.pitch_deg))
        lost = h[short] < (self.floor or self.settings.target)
        rows = np.flatnonzero(possible & (firm | lost))
        return Missed(short[rows], firm[rows], lost[rows])

    @property
    def floor(self) -> float:
        """What samples that need not reach the target should have; 0 where that is nothing."""
        return self.settings.floor * self.settings.target if self.settings.floors else 0.0

    def reach(self, pool: Pool) -> tuple[Bools, Bools]:
        """Which samples can reach the target by all poses of a pool, and which the floor."""
        firm = np.array(self._problem(pool, 1.0).reachable)
        if self.floor == 0.0:
            return firm, firm
        low = replace(self, target=np.full(len(self.samples), self.floor))
        return firm, np.array(low._problem(pool, 1.0).reachable)

    def shown(self, photos: Pool) -> tuple[Floats, Ints]:
        """Reconstructability by some photos, and number of sharp ones, of each sample."""
        problem, every = self._problem(photos, 1.0), np.arange(len(photos))
        return problem.values(every), problem.fine_hits(every)

    def wanting(self, weak: Bools, sharp: Ints) -> "Subject":
        """The same with the floor wanted of some samples, and of the others the target.

        ``sharp`` says how many sharp photos each of the others wants, shape (S,).
        """
        target = np.where(weak, self.floor, self.settings.target)
        return replace(self, target=target, sharp=np.where(weak, 0, sharp))

    def widened(self, pool: Pool, known: int) -> Pool:
        """A pool that knows only so many of the samples, with what it shows of the others too."""
        rest = self.samples.places(np.arange(known, len(self.samples)))
        more = replace(self, samples=rest).at(pool.positions, pool.yaw_deg, pool.pitch_deg)
        return pool.beside(more, known)

    def _problem(self, pool: Pool, share: float) -> PairCoverProblem:
        from scipy.sparse import csr_array

        shape, settings = (len(pool), len(self.samples)), self.settings
        ones = np.ones(len(pool.sample), dtype=np.int8)
        return PairCoverProblem(
            csr_array((ones, pool.sample, pool.indptr), shape=shape),
            pool.rays(self.samples),
            1.0 - pool.distance / self.reference,
            pool.cosine,
            weights=chord_table(parallax_weight),
            target=_SURE * self.target,
            share=share,
            budget=settings.budget,
            fine=self._is_sharp(pool),
            fine_demand=self.sharp,
        )

    def _is_sharp(self, pool: Pool) -> Bools:
        """Which hits of a pool the rule allows, shape (n,)."""
        facing = pool.cosine >= math.cos(self.rule.max_incidence)
        near = pool.distance <= np.minimum(self.rule.d_max, self.rule.reach * pool.cosine)
        return np.asarray(facing & near)

    def search(
        self,
        problem: PairCoverProblem,
        start: Ints,
        *,
        iterations: int,
        seed: int,
        bounded: bool = False,
    ) -> Result[Ints]:
        """Run the pair solver from the start; the built-in ones bound their answer if told to.

        Raises
        ------
        KeyboardInterrupt
            If the search was interrupted.

        """
        name, initial = self.settings.pair_solver, None
        options: dict[str, object] = {}
        if name in {"greedy", "lns"}:
            bound_steps = _BOUND_STEPS if bounded else 0
            options = {"start": tuple(start.tolist()), "bound_steps": bound_steps}
        else:
            with suppress(InvalidSolution):  # what they begin with must satisfy enough
                initial = problem.evaluate(start)[0]
        solver, stop = load("pairs", name, **options), Stop(iterations=iterations)
        return _heard(solve(problem, solver, seed=seed, stop=stop, initial=initial))

    def completed(
        self, problem: PairCoverProblem, start: Ints, *, bounded: bool = False
    ) -> Result[Ints]:
        """The start with what is missing, nothing left out, and a bound if told to."""
        steps = _BOUND_STEPS if bounded else 0
        options = {"start": tuple(start.tolist()), "pruned": False, "bound_steps": steps}
        return _heard(solve(problem, load("pairs", "greedy", **options)))


def _heard(result: Result[Ints]) -> Result[Ints]:
    """The result, if no one has interrupted it: then it is only what there was by then."""
    if result.stop_reason is StopReason.INTERRUPTED:
        raise KeyboardInterrupt
    return result
