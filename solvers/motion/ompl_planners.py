"""Planners of OMPL that stop at the first path they find, tried several times over."""

from dataclasses import dataclass
from typing import Any, ClassVar

from solvers.motion import ompl_search
from solvers.motion.problem import MotionProblem, Waypoints
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop


@dataclass(frozen=True, slots=True)
class FirstPath:
    """Search for any path, shorten it, search again, keep the shortest.

    An iteration is one validity check, of a point or of an edge. The last shortcuts do not
    count; they are bounded by ``shortcuts`` alone.

    Parameters
    ----------
    attempts
        How many searches, at least 1. Each may pass the obstacles on other sides. After the
        first path each may take twice the checks that led to it.
    shortcuts
        How many random shortcuts to try on the shortest path at the end, from 0; pulling it
        taut comes on top.
    reach
        Longest edge of the trees, as a multiple of the problem's ``step``, positive; 0
        leaves it to OMPL, which takes a fifth of the box's diagonal.

    """

    attempts: int = 4
    shortcuts: int = 60
    reach: float = 0.0
    name: ClassVar[str]
    planner: ClassVar[str]
    requires: ClassVar[tuple[str, ...]] = ("ompl",)
    default_stop: ClassVar[Stop] = Stop(iterations=20_000)

    def __post_init__(self) -> None:
        if self.attempts < 1 or self.shortcuts < 0 or not self.reach >= 0.0:
            raise ValueError(
                f"need attempts from 1, shortcuts and reach from 0, got {self.attempts}, "
                f"{self.shortcuts} and {self.reach}."
            )

    def run(self, problem: MotionProblem, run: Run[Waypoints]) -> Status:
        """Offer each path as found and shortened."""
        search = ompl_search.Search(problem, run)
        settings: dict[str, Any] = {}
        if self.reach > 0.0:
            settings["setRange"] = self.reach * problem.step
        with ompl_search.opened(search, self.planner, settings) as setup:
            ompl_search.attempt(search, setup, self.attempts)
            del setup
        return search.finish(self.shortcuts)


@dataclass(frozen=True, slots=True)
class RRT(FirstPath):
    """One tree that grows towards random points.

    LaValle (1998), Rapidly-exploring random trees: a new tool for path planning.
    """

    name: ClassVar[str] = "rrt"
    planner: ClassVar[str] = "RRT"


@dataclass(frozen=True, slots=True)
class RRTConnect(FirstPath):
    """Two trees that grow towards each other.

    Kuffner and LaValle (2000, doi:10.1109/ROBOT.2000.844730).
    """

    name: ClassVar[str] = "rrt-connect"
    planner: ClassVar[str] = "RRTConnect"


@dataclass(frozen=True, slots=True)
class KPIECE(FirstPath):
    """One tree that grows where a grid over a projection says it has been least.

    Sucan and Kavraki (2009, doi:10.1007/978-3-642-00312-7_28).
    """

    name: ClassVar[str] = "kpiece"
    planner: ClassVar[str] = "KPIECE1"


@dataclass(frozen=True, slots=True)
class BKPIECE(FirstPath):
    """KPIECE with a tree from each end."""

    name: ClassVar[str] = "bkpiece"
    planner: ClassVar[str] = "BKPIECE1"


@dataclass(frozen=True, slots=True)
class LBKPIECE(FirstPath):
    """KPIECE with a tree from each end and edges checked only once they join a path.

    Bohlin and Kavraki (2000, doi:10.1109/ROBOT.2000.844107) for the lazy checks.
    """

    name: ClassVar[str] = "lbkpiece"
    planner: ClassVar[str] = "LBKPIECE1"
