"""The compiled local search of the package fast-tsp, which is optional."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.result import Status, StopReason
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.closing import closed_costs, opened
from solvers.tour.problem import Order, TourProblem

_LARGEST_TOUR = 2**30  # what a whole tour may cost in the whole numbers that the package takes
_LONGEST = 3600.0  # seconds; the package needs some limit


@dataclass(frozen=True, slots=True)
class FastTSP:
    """Iterated 2-opt and 3-opt with whole-numbered costs; one iteration.

    The package rolls its own dice, so that a seed does not repeat its tour, and knows no limit
    but seconds. It may end earlier where it finds nothing better. ``pip install fast-tsp``.
    """

    name: ClassVar[str] = "fast-tsp"
    requires: ClassVar[tuple[str, ...]] = ("fast_tsp",)
    optional: ClassVar[bool] = True
    cannot: ClassVar[frozenset[str]] = frozenset({"asymmetric"})
    ignores: ClassVar[frozenset[str]] = frozenset({"iterations", "stall", "target"})
    default_stop: ClassVar[Stop] = Stop(seconds=2.0)

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer the tour that the package comes back with."""
        if not run.proceed():
            return Status.UNKNOWN
        import fast_tsp

        costs = closed_costs(problem)
        largest = float(costs.max())
        scale = _LARGEST_TOUR // len(costs) / largest if largest > 0.0 else 1.0
        whole = np.rint(costs * scale).astype(np.int64).tolist()
        seconds = min(run.remaining, _LONGEST) if math.isfinite(run.remaining) else _LONGEST
        tour = fast_tsp.find_tour(whole, max(1e-3, seconds))
        run.offer(opened(problem, np.array(tour, dtype=np.int64)))
        run.stop_reason = StopReason.TIME if run.remaining <= 0.0 else StopReason.FINISHED
        return Status.FEASIBLE
