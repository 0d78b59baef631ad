"""Particle swarm optimisation on sets of legs, with comprehensive learning."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.arrays import Floats, Ints
from solvers.parameters import check_number, check_whole
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.limits import progress
from solvers.tour.nearest import first_places
from solvers.tour.problem import Order, TourProblem


@dataclass(frozen=True, slots=True)
class ParticleSwarm:
    """A position is a set of legs, a velocity a chance for each leg; an iteration moves all.

    Each particle learns the legs at each place from the best order of one teacher: itself, or
    the better of two drawn by lot. Its next order takes, from place to place, the cheapest free
    leg of its velocity, else one that it had, else the cheapest of all.

    Parameters
    ----------
    particles
        How many, at least 2.
    inertia, last_inertia
        Share of the velocity that stays at each step: at the beginning, and at the limit on
        iterations or seconds; in [0, 1].
    pull
        Weight of what is learnt, positive.
    patience
        Iterations without a better order until a particle draws new teachers, at least 1.

    References
    ----------
    Chen, Zhang, Chung, Zhong, Wu and Shi, "A novel set-based particle swarm optimization
    method for discrete optimization problems", 2010, doi:10.1109/TEVC.2009.2030331.

    """

    particles: int = 20
    inertia: float = 0.9
    last_inertia: float = 0.4
    pull: float = 2.0
    patience: int = 7
    name: ClassVar[str] = "particle-swarm"
    requires: ClassVar[tuple[str, ...]] = ("numba",)

    def __post_init__(self) -> None:
        check_whole(self, particles=2, patience=1)
        check_number(self, "pull", above=0.0)
        check_number(self, "inertia", "last_inertia", most=1.0)

    @staticmethod
    def default_stop(problem: TourProblem) -> Stop:
        """Iterations for two seconds or so."""
        return Stop(iterations=max(100, min(3000, 30_000_000 // problem.size**2)))

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer the best new order of each iteration."""
        from solvers.tour import swarm_kernels as kernels
        from solvers.tour.ant_kernels import lengths

        n, m, rng = problem.size, self.particles, run.rng
        firsts = np.fromiter(first_places(problem), dtype=np.int64)
        end = -1 if problem.end is None else problem.end
        symmetric, horizon = problem.symmetric, self.default_stop(problem).iterations or 1
        velocity = np.zeros((m, n, n))
        orders = np.array([_scattered(problem, run) for _ in range(m)])
        if run.initial is not None:
            orders[0] = run.initial
        best, cost = orders.copy(), lengths(problem.costs, orders, problem.closed)
        beside, best_beside = np.empty((2, m, n, 2), dtype=np.int64)
        kernels.sides(orders, problem.closed, symmetric, beside)
        kernels.sides(best, problem.closed, symmetric, best_beside)
        teacher, stale = np.empty((m, n), dtype=np.int64), np.full(m, self.patience)
        while run.proceed():
            for p in np.flatnonzero(stale >= self.patience):
                teacher[p] = _teachers(cost, int(p), n, rng)
                stale[p] = 0
            inertia = self.inertia + progress(run, horizon) * (self.last_inertia - self.inertia)
            kernels.drift(velocity, beside, best_beside, teacher, inertia, self.pull, rng)
            orders[:, 0] = rng.choice(firsts, m)
            kernels.move(problem.costs, velocity, beside, orders, end, rng)
            kernels.sides(orders, problem.closed, symmetric, beside)
            now = lengths(problem.costs, orders, problem.closed)
            better = now < cost
            best[better], cost[better] = orders[better], now[better]
            best_beside[better] = beside[better]
            stale = np.where(better, 0, stale + 1)
            if cost.min() < run.best_cost:
                run.offer(best[cost.argmin()])
        return Status.FEASIBLE


def _scattered(problem: TourProblem, run: Run[Order]) -> Order:
    """Some order, ends held."""
    ends = [place for place in (problem.start, problem.end) if place is not None]
    inner = run.rng.permutation(np.setdiff1d(np.arange(problem.size), ends))
    first = [] if problem.start is None else [problem.start]
    last = [] if problem.end is None else [problem.end]
    return np.concatenate([first, inner, last]).astype(np.int64)


def _teachers(cost: Floats, particle: int, n: int, rng: np.random.Generator) -> Ints:
    """From whom a particle learns at each place, shape (n,)."""
    rank = particle / (len(cost) - 1)
    curious = 0.05 + 0.45 * math.expm1(10.0 * rank) / math.expm1(10.0)
    one, other = rng.integers(0, len(cost), (2, n))
    abler = np.where(cost[one] <= cost[other], one, other)
    return np.where(rng.random(n) < curious, abler, particle)
