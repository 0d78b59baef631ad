"""Nearest neighbour: go on to the cheapest place not yet visited."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.problem import Order, TourProblem


@dataclass(frozen=True, slots=True)
class Nearest:
    """Nearest neighbour from each place in turn; an iteration is one first place.

    Ties go to the lowest index. A fixed start leaves one first place, and a fixed end is
    kept for last.
    """

    name: ClassVar[str] = "nearest"
    default_stop: ClassVar[Stop] = Stop(iterations=50)

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer one order for each first place."""
        for first in first_places(problem):
            if not run.proceed():
                break
            run.offer(nearest_order(problem, first))
        return Status.FEASIBLE


def first_places(problem: TourProblem) -> Iterator[int]:
    """Places that an order may begin with, lowest first."""
    if problem.start is not None:
        yield problem.start
    else:
        yield from (place for place in range(problem.size) if place != problem.end)


def nearest_order(problem: TourProblem, first: int, second: int | None = None) -> Order:
    """Nearest-neighbour order that begins with ``first`` (and ``second``), shape (n,)."""
    n = problem.size
    order = np.empty(n, dtype=np.int64)
    order[0] = first
    free = np.ones(n, dtype=np.bool_)
    free[first] = False
    last = n
    if problem.end is not None and problem.end != first:
        free[problem.end] = False
        last = n - 1
        order[last] = problem.end
    head = 1
    if second is not None:
        order[1] = second
        free[second] = False
        head = 2
    for k in range(head, last):
        order[k] = np.argmin(np.where(free, problem.costs[order[k - 1]], np.inf))
        free[order[k]] = False
    return order
