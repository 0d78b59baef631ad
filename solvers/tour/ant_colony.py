"""Ant colony optimisation: the ant-cycle system, with local search where wanted."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.arrays import Floats, Ints
from solvers.parameters import check_number, check_whole
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.candidates import nearest_lists
from solvers.tour.closing import closed, closing, limited, opened
from solvers.tour.nearest import first_places, nearest_order
from solvers.tour.problem import Order, TourProblem

_NEAREST = 1e-6  # share of the mean cost that a step costs at least, so that visibility is finite
_ROUNDING = 1e-10  # share of the largest cost below which a saving is no saving
_NEIGHBOURS = 8  # of the local search
_BATCH = 2_000_000  # steps between places, in all, between two looks at the clock


@dataclass(frozen=True, slots=True)
class AntColony:
    """Ants walk by trail and distance, and lay trail on what they walked; a cycle an iteration.

    An ant at i steps to a free place j with a probability proportional to
    ``trail[i, j] ** alpha / costs[i, j] ** beta``. After each cycle, trail fades by
    ``persistence``, and every ant lays ``quantity`` over the cost of its tour on each leg of
    it, the best tour as much as ``elitists`` ants. When all ants make tours of one cost, or
    the colony has found nothing better for ``patience`` cycles, the trail begins anew.

    Parameters
    ----------
    ants
        How many; by default as many as places, or 25 at most with local search.
    alpha, beta
        Weight of trail and of visibility, at least 0.
    persistence
        Share of the trail that stays, in [0, 1).
    quantity
        Trail that an ant lays over its whole tour times its cost, positive.
    elitists
        How many ants the best tour counts as, at least 0.
    patience
        Cycles without gain until the trail begins anew, at least 1.
    local_search
        Whether each ant mends its tour by 2-opt and 3-opt before it lays trail.

    References
    ----------
    Dorigo, Maniezzo and Colorni, "Ant system: optimization by a colony of cooperating
    agents", IEEE SMC-B 26, 1996, doi:10.1109/3477.484436.

    """

    ants: int | None = None
    alpha: float = 1.0
    beta: float = 5.0
    persistence: float = 0.5
    quantity: float = 100.0
    elitists: float = 20.0
    patience: int = 500
    local_search: bool = False
    name: ClassVar[str] = "ant-colony"
    requires: ClassVar[tuple[str, ...]] = ("numba",)

    def __post_init__(self) -> None:
        check_whole(self, patience=1, **({} if self.ants is None else {"ants": 1}))
        check_number(self, "alpha", "beta", "elitists")
        check_number(self, "persistence", below=1.0)
        check_number(self, "quantity", above=0.0)
        if not isinstance(self.local_search, bool):
            raise ValueError(f"local_search must be true or false, got {self.local_search!r}.")

    @property
    def cannot(self) -> frozenset[str]:
        """Asymmetric costs, with local search."""
        return frozenset({"asymmetric"} if self.local_search else ())

    @staticmethod
    def default_stop(problem: TourProblem) -> Stop:
        """Cycles for a few seconds."""
        return Stop(iterations=max(20, min(2000, 10**8 // problem.size**3)))

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer a nearest-neighbour tour, and the best one of each cycle.

        A limit on seconds may end a cycle early, with the ants that have walked by then.
        """
        from solvers.tour import ant_kernels as kernels

        n, costs = problem.size, problem.costs
        firsts = np.fromiter(first_places(problem), dtype=np.int64)
        ants = self.ants or (min(n, 25) if self.local_search else n)
        mend = _mender(problem) if self.local_search else None
        visible, symmetric = _visibility(limited(problem)) ** self.beta, problem.symmetric
        trail = np.empty((n, n))
        nearest = nearest_order(problem, int(firsts[0]))
        typical = problem.cost(nearest) or 1.0
        end = -1 if problem.end is None else problem.end
        best = run.initial if run.initial is not None else np.empty(0, dtype=np.int64)
        least, stale = run.best_cost, 0
        run.offer(nearest)
        batch = max(1, _BATCH // n**2)
        trail[:] = self.quantity / typical
        while run.proceed():
            if stale >= self.patience:
                trail[:] = self.quantity / typical
                least, stale = np.inf, 0
            orders = np.empty((ants, n), dtype=np.int64)
            orders[:, 0] = firsts[run.rng.permutation(max(ants, len(firsts)))[:ants] % len(firsts)]
            pull = trail**self.alpha * visible
            for first in range(0, ants, batch):
                if first > 0 and run.remaining <= 0.0:
                    orders = orders[:first]
                    break
                kernels.walk(pull, orders[first : first + batch], end, run.rng)
                if mend is not None:
                    mend(orders[first : first + batch])
            cost = kernels.lengths(costs, orders, problem.closed)
            shortest = int(cost.argmin())
            stale += 1
            if cost[shortest] < least:
                best, least, stale = orders[shortest].copy(), float(cost[shortest]), 0
                if least < run.best_cost:
                    run.offer(best)
            trail *= self.persistence
            for ant in range(len(orders)):
                amount = self.quantity / max(cost[ant], 1e-9 * typical)
                kernels.deposit(trail, orders[ant], amount, problem.closed, symmetric)
            amount = self.elitists * self.quantity / max(least, 1e-9 * typical)
            kernels.deposit(trail, best, amount, problem.closed, symmetric)
            if cost.max() <= cost[shortest]:
                stale = self.patience
        return Status.FEASIBLE


def _visibility(costs: Floats) -> Floats:
    """One over each cost, in means; free steps count as nearly free."""
    mean = float(costs.mean()) or 1.0
    return mean / np.maximum(costs, _NEAREST * mean)


def _mender(problem: TourProblem) -> Callable[[Ints], None]:
    """What improves orders in place, shape (ants, n)."""
    from solvers.tour.search_kernels import new_walk, settle

    costs, _, dearest = closing(problem)
    near = nearest_lists(costs, min(_NEIGHBOURS, len(costs) - 1))
    least = _ROUNDING * dearest

    def mend(orders: Ints) -> None:
        for order in orders:
            walk = new_walk(closed(problem, order))
            settle(costs, near, walk, least)
            order[:] = opened(problem, walk.tour.astype(np.int64))

    return mend
