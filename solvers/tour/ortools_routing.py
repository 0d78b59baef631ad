"""The routing library of OR-Tools with one vehicle."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from solvers.arrays import Ints
from solvers.errors import InvalidProblem
from solvers.result import Status, StopReason
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.closing import limited
from solvers.tour.problem import Order, TourProblem

_LARGEST = 2.0**36  # integer that the largest cost becomes: room for penalties in 63 bits
_ENDLESS = 10**8  # seconds; the library needs some limit where the caller sets none


@dataclass(frozen=True, slots=True)
class OrtoolsRouting:
    """Constraint-based local search; an iteration is one solution of the routing library.

    Each accepted move of the local search is such a solution, and each is offered. Costs
    become integers inside, the largest one 2^36. A limit on iterations repeats exactly; a
    limit on seconds does not.

    Parameters
    ----------
    metaheuristic
        How to leave a local optimum: a name of ``LocalSearchMetaheuristic``.
    first_solution
        How to build the first tour: a name of ``FirstSolutionStrategy``.

    """

    metaheuristic: str = "GUIDED_LOCAL_SEARCH"
    first_solution: str = "PATH_CHEAPEST_ARC"
    name: ClassVar[str] = "ortools"
    requires: ClassVar[tuple[str, ...]] = ("ortools",)

    def __post_init__(self) -> None:
        for name in ("metaheuristic", "first_solution"):
            value = getattr(self, name)
            if not isinstance(value, str):
                raise ValueError(f"{name} must be a name, got {value!r}.")

    @staticmethod
    def default_stop(problem: TourProblem) -> Stop:
        """Enough solutions for the first descent and some more; there are few a second."""
        return Stop(iterations=problem.size // 2 + 30)

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer each solution that the search passes through."""
        if (reached := run.limit()) is not None:
            run.stop_reason = reached
            return Status.UNKNOWN
        from ortools.constraint_solver import pywrapcp

        costs, first, last = _depots(problem)
        manager = pywrapcp.RoutingIndexManager(len(costs), 1, [first], [last])
        model = pywrapcp.RoutingModel(manager)
        model.SetArcCostEvaluatorOfAllVehicles(model.RegisterTransitMatrix(costs.tolist()))
        interrupts: list[KeyboardInterrupt] = []

        def on_solution() -> None:
            try:
                if run.proceed():
                    run.offer(_order(model, manager, problem))
                if run.limit() is not None:
                    model.CancelSearch()
            except KeyboardInterrupt as interrupt:  # must not cross the C++ frames below
                interrupts.append(interrupt)
                model.CancelSearch()

        model.AddAtSolutionCallback(on_solution)
        parameters = self._parameters(run)
        model.CloseModelWithParameters(parameters)
        hint = None
        if run.initial is not None:
            inner = [int(place) for place in run.initial if place not in (first, last)]
            if problem.closed:  # a round trip may be turned so that it begins at the depot
                at = int(np.flatnonzero(run.initial == first)[0])
                inner = np.roll(run.initial, -at)[1:].tolist()
            hint = model.ReadAssignmentFromRoutes([[manager.NodeToIndex(i) for i in inner]], True)
        if hint is not None:
            model.SolveFromAssignmentWithParameters(hint, parameters)
        else:
            model.SolveWithParameters(parameters)
        if interrupts:
            raise interrupts[0]
        run.stop_reason = run.limit() or StopReason.FINISHED
        return Status.FEASIBLE

    def _parameters(self, run: Run[Order]) -> Any:
        """Limits and strategies in the words of the library."""
        from ortools.constraint_solver import pywrapcp, routing_enums_pb2

        parameters = pywrapcp.DefaultRoutingSearchParameters()
        try:
            parameters.first_solution_strategy = (
                routing_enums_pb2.FirstSolutionStrategy.Value.Value(self.first_solution)
            )
            parameters.local_search_metaheuristic = (
                routing_enums_pb2.LocalSearchMetaheuristic.Value.Value(self.metaheuristic)
            )
        except ValueError as error:
            raise InvalidProblem(f"ortools knows no such strategy: {error}") from error
        milliseconds = math.ceil(1000.0 * min(run.remaining, _ENDLESS))
        parameters.time_limit.FromMilliseconds(max(1, milliseconds))
        if run.stop.iterations is not None:
            parameters.solution_limit = run.stop.iterations
        return parameters


def _depots(problem: TourProblem) -> tuple[Ints, int, int]:
    """Integer costs, and the places where the vehicle leaves and ends.

    A free end becomes the place n, which is not there and costs nothing to go to.
    """
    n = problem.size
    legs = limited(problem)
    largest = float(legs.max())
    scaled = np.rint(legs / largest * _LARGEST) if largest > 0.0 else legs
    if problem.closed:
        depot = problem.start or 0
        return scaled.astype(np.int64), depot, depot
    first = n if problem.start is None else problem.start
    last = n if problem.end is None else problem.end
    size = n + 1 if n in (first, last) else n
    costs = np.zeros((size, size), dtype=np.int64)
    costs[:n, :n] = scaled
    return costs, first, last


def _order(model: Any, manager: Any, problem: TourProblem) -> Order:
    """Places of the solution at hand, without the one that is not there."""
    places, index = [], model.Start(0)
    while not model.IsEnd(index):
        places.append(manager.IndexToNode(index))
        index = model.NextVar(index).Value()
    if not problem.closed:
        places.append(manager.IndexToNode(index))
    return np.array([place for place in places if place < problem.size], dtype=np.int64)
