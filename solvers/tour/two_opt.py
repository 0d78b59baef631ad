"""2-opt and Or-opt from several nearest-neighbour tours."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.parameters import check_whole
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.candidates import nearest_lists
from solvers.tour.closing import closed, closing, opened
from solvers.tour.nearest import first_places, nearest_order
from solvers.tour.problem import Order, TourProblem

_ROUNDING = 1e-10  # share of the largest cost below which a saving is no saving


@dataclass(frozen=True, slots=True)
class TwoOpt:
    """Descend by 2-opt and Or-opt; an iteration is one descent from one first tour.

    The first tours are the warm start, if there is one, and nearest-neighbour tours from
    places in random order; from a fixed start they run over the places visited second.

    Parameters
    ----------
    neighbours
        How many of the cheapest neighbours of a place a move may join it to, at least 1.

    """

    neighbours: int = 10
    name: ClassVar[str] = "two-opt"
    requires: ClassVar[tuple[str, ...]] = ("numba",)
    cannot: ClassVar[frozenset[str]] = frozenset({"asymmetric"})
    default_stop: ClassVar[Stop] = Stop(iterations=10)

    def __post_init__(self) -> None:
        check_whole(self, neighbours=1)

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer the end of each descent."""
        from solvers.tour import kernels

        costs, _, dearest = closing(problem)
        near = nearest_lists(costs, min(self.neighbours, len(costs) - 1))
        least = _ROUNDING * dearest
        for order in _first_orders(problem, run):
            if not run.proceed():
                break
            tour = closed(problem, order)
            kernels.descend(costs, near, tour, least)
            run.offer(opened(problem, tour))
        return Status.FEASIBLE


def _first_orders(problem: TourProblem, run: Run[Order]) -> Iterator[Order]:
    if run.initial is not None:
        yield run.initial
    places = np.fromiter(first_places(problem), dtype=np.int64)
    if len(places) > 1:
        for first in run.rng.permutation(places):
            yield nearest_order(problem, int(first))
        return
    yield nearest_order(problem, int(places[0]))
    for second in run.rng.permutation(problem.size):
        if second not in (places[0], problem.end):
            yield nearest_order(problem, int(places[0]), int(second))
