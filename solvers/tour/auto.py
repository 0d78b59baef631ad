"""The solver to take when none is named: it picks by size."""

from dataclasses import dataclass
from typing import ClassVar

from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.bounds import assignment_bound
from solvers.tour.branch_and_bound import BranchAndBound
from solvers.tour.iterated import IteratedLocalSearch
from solvers.tour.limits import part
from solvers.tour.nearest import first_places, nearest_order
from solvers.tour.ortools_routing import OrtoolsRouting
from solvers.tour.problem import Order, TourProblem

_TINY = 12  # places up to which the proof takes milliseconds
_PROVABLE = 150  # places up to which it mostly takes seconds at most
_NODE = 100  # kicks that take as long as a node
_NODES = 1000  # nodes that the default limit leaves for a proof
_ENOUGH = 2000  # kicks a place after which more hardly help so few places
_ASSIGNABLE = 2000  # places up to which the bound of an asymmetric problem takes a second
_ASSIGNMENT = 2e-9  # seconds for it, several times over, by the cube of the number of places


@dataclass(frozen=True, slots=True)
class Auto:
    """Prove small tours, search large ones, and say how far from the optimum they may be.

    ===================== ==================================================================
    up to 12 places       ``branch-and-bound``: proven in milliseconds
    up to 150 places      ``iterated-local-search`` for half of the limits at most, then
                          ``branch-and-bound`` for the rest
    more places           ``iterated-local-search``
    asymmetric costs      ``ortools``
    ===================== ==================================================================

    The result carries the bound of Held and Karp, up to 6000 places (that of the assignment
    problem for asymmetric costs, up to 2000 and where a limit on seconds leaves time enough).
    Its time counts: half a second for 1000 places, and a tenth of a limit on seconds at most.
    An iteration is a kick or, of ``ortools``, a solution; a node of ``branch-and-bound`` counts
    as 100. The default limit takes two seconds or so for 400 places and less for fewer.
    """

    name: ClassVar[str] = "auto"
    requires: ClassVar[tuple[str, ...]] = ("numba", "ortools")

    @staticmethod
    def default_stop(problem: TourProblem) -> Stop:
        """That of the solver picked, and up to 150 places 1000 nodes on top."""
        if not problem.symmetric:
            return OrtoolsRouting.default_stop(problem)
        kicks = IteratedLocalSearch.default_stop(problem).iterations or 1
        return Stop(iterations=kicks + _NODES * _NODE if problem.size <= _PROVABLE else kicks)

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Have the solver for this size run."""
        if not problem.symmetric:
            run.offer(nearest_order(problem, next(first_places(problem))))
            if problem.size <= _ASSIGNABLE and _ASSIGNMENT * problem.size**3 < run.remaining:
                run.bound = assignment_bound(problem)
            return OrtoolsRouting().run(problem, run)
        if problem.size > _PROVABLE:
            return IteratedLocalSearch().run(problem, run)
        if problem.size <= _TINY:
            return BranchAndBound().run(problem, run)
        with part(run, 0.5, most=_ENOUGH * problem.size):
            IteratedLocalSearch().run(problem, run)
        return (
            Status.UNKNOWN
            if run.best is None
            else BranchAndBound().prove(problem, run, weight=_NODE)
        )
