"""What every problem and every solver looks like from outside."""

from typing import Any, ClassVar, NamedTuple, Protocol, TypeVar

from solvers.result import Status
from solvers.run import Run

S_co = TypeVar("S_co", covariant=True)


class Answer(NamedTuple):
    """Outcome that a problem knows by itself, without any solver."""

    status: Status
    solution: Any | None = None


class Problem(Protocol[S_co]):
    """A problem checks and costs candidates; it never searches."""

    family: ClassVar[str]

    @property
    def features(self) -> frozenset[str]:
        """What this instance asks of a solver beyond the plain case."""

    def evaluate(self, candidate: Any) -> tuple[S_co, float]:
        """Own, read-only copy of a candidate, and its cost.

        Raises
        ------
        InvalidSolution
            If the candidate breaks a constraint.

        """

    def trivial(self) -> Answer | None:
        """Answer known without search, or ``None``."""


class Solver(Protocol):
    """Any object with a name and a run; everything else is optional.

    Optional class attributes: ``requires`` (import names of the packages it needs),
    ``cannot`` (features of problems that it refuses), ``ignores`` (fields of ``Stop``
    that it cannot obey), ``default_stop`` (a ``Stop``, or a method that makes one from the
    problem), ``exact`` (proves optimality and infeasibility when it finishes) and ``optional``
    (its packages do not come with this one).
    """

    @property
    def name(self) -> str:
        """What results and tables call it."""

    def run(self, problem: Any, run: Run[Any], /) -> Status:
        """Offer candidates to ``run``; return what is known at the end."""
