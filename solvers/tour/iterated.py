"""Iterated local search: 3-opt, small kicks, and less and less patience with worse tours."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.parameters import check_number, check_whole
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.bounds import ascents, grain, proves, rounded_up
from solvers.tour.candidates import likely_lists, nearest_lists
from solvers.tour.closing import Closing, closed, closing, opened, quick_upper
from solvers.tour.limits import progress
from solvers.tour.nearest import first_places, nearest_order
from solvers.tour.problem import Order, TourProblem

_ROUNDING = 1e-10  # share of the largest cost below which a saving is no saving
_BATCH = 1000  # kicks between two looks at the limits
_ASCENT_WORK = 3e8  # n^2 operations of an ascent: half a second or so
_LARGEST_ASCENT = 6000  # places up to which there is an ascent at all


@dataclass(frozen=True, slots=True)
class IteratedLocalSearch:
    """Kick the tour by a short double bridge, mend it by 3-opt, keep it or take it back.

    Worse tours are kept as in simulated annealing, at a temperature that falls to zero at the
    limit on iterations or seconds (without either, it does so again and again). An iteration
    is one kick. A short ascent of Held and Karp at the beginning, within the limits, gives
    the bound and tells which edges are likely in good tours; the search ends early where the
    bound proves the tour optimal.

    Parameters
    ----------
    neighbours
        To how many others a move may join a place, at least 1.
    reach
        Most places that a kick moves, at least 2.
    heat
        Temperature at the beginning, in mean costs of a leg, at least 0.

    References
    ----------
    Martin, Otto and Felten, "Large-step Markov chains for the traveling salesman problem",
    Complex Systems 5, 1991.

    """

    neighbours: int = 8
    reach: int = 50
    heat: float = 0.1
    name: ClassVar[str] = "iterated-local-search"
    requires: ClassVar[tuple[str, ...]] = ("numba",)
    cannot: ClassVar[frozenset[str]] = frozenset({"asymmetric"})

    def __post_init__(self) -> None:
        check_whole(self, neighbours=1, reach=2)
        check_number(self, "heat")

    @staticmethod
    def default_stop(problem: TourProblem) -> Stop:
        """500 kicks a place, a million at most: two seconds for 400 places."""
        return Stop(iterations=min(500 * problem.size, 1_000_000))

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer each tour that is better at the end of a batch of kicks."""
        from solvers.tour.search_kernels import chain, new_walk, settle

        if not run.proceed():
            return Status.UNKNOWN
        upper = quick_upper(problem)
        whole = closing(problem, upper)
        costs, unit = whole.costs, grain(problem.costs, whole.dearest)
        near = self._prepared(whole, run, upper, unit)
        least = _ROUNDING * whole.dearest
        walk = new_walk(closed(problem, _first_order(problem, run)))
        settle(costs, near, walk, least)
        best = walk.tour.copy()
        run.offer(opened(problem, best.astype(np.int64)))
        reach = min(self.reach, len(costs) - 2)
        cycle = self.default_stop(problem).iterations or 1
        warm = self.heat * run.best_cost / problem.size
        while not (over := proves(run.bound, run.best_cost, unit)) and run.proceed():
            kicks = _allowed(run)
            heat = warm * (1.0 - progress(run, cycle))
            cost = chain(costs, near, walk, best, kicks, reach, heat, least, run.rng)
            run.iteration += kicks - 1
            if cost - whole.surcharge < run.best_cost:
                run.offer(opened(problem, best.astype(np.int64)))
        return Status.OPTIMAL if over else Status.FEASIBLE

    def _prepared(
        self, whole: Closing, run: Run[Order], upper: float, unit: float
    ) -> NDArray[np.int32]:
        """Set the bound, and choose the neighbours."""
        costs = whole.costs
        n = len(costs)
        count = min(self.neighbours, n - 1)
        if n > _LARGEST_ASCENT:
            return nearest_lists(costs, count)
        bound, prices = 0.0, np.zeros(n)
        share = 0.1 * run.remaining  # infinite where time is no limit, and then never reached
        begun = run.elapsed
        for ascent in ascents(whole, upper, int(min(300, max(20, _ASCENT_WORK / n**2)))):
            bound, prices = ascent.bound - whole.surcharge, ascent.prices
            if run.elapsed - begun > share:
                break
        run.bound = max(run.bound, rounded_up(bound, unit))
        return likely_lists(costs, prices, count, max(1, (2 * count) // 3))


def _first_order(problem: TourProblem, run: Run[Order]) -> Order:
    if run.initial is not None:
        return run.initial
    return nearest_order(problem, int(run.rng.choice(list(first_places(problem)))))


def _allowed(run: Run[Order]) -> int:
    """Kicks until the next look at the limits; the first of them has been counted."""
    kicks = _BATCH
    for limit in (run.stop.iterations, run.stop.stall):
        if limit is not None:
            kicks = min(kicks, max(1, limit // 50))
    if run.stop.iterations is not None:
        kicks = min(kicks, run.stop.iterations - run.iteration + 1)
    return kicks
