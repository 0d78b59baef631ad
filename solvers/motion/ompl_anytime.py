"""Planners of OMPL that strive for the shortest path: trees, batches and roadmaps."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from solvers.motion import ompl_search
from solvers.motion.problem import MotionProblem, Waypoints
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop


@dataclass(frozen=True, slots=True)
class Shortest:
    """Search for ever shorter paths until the limit; the best one is shortened at the end.

    An iteration is one validity check, of a point or of an edge. The last shortcuts do not
    count; they are bounded by ``shortcuts`` alone.

    Parameters
    ----------
    shortcuts
        How many random shortcuts to try on the best path at the end, from 0; pulling it taut
        comes on top.

    """

    shortcuts: int = 60
    name: ClassVar[str]
    planner: ClassVar[str]
    requires: ClassVar[tuple[str, ...]] = ("ompl",)
    default_stop: ClassVar[Stop] = Stop(iterations=10_000)

    def __post_init__(self) -> None:
        if self.shortcuts < 0:
            raise ValueError(f"shortcuts must be at least 0, got {self.shortcuts}.")

    def settings(self, step: float) -> dict[str, Any]:  # noqa: ARG002 - some ranges need it
        """Setter of OMPL's planner -> its argument."""
        return {}

    def run(self, problem: MotionProblem, run: Run[Waypoints]) -> Status:
        """Offer each better path as found and shortened."""
        return self._searched(problem, run, ompl_search.improve)

    def _searched(
        self,
        problem: MotionProblem,
        run: Run[Waypoints],
        drive: Callable[[ompl_search.Search, Any], None],
    ) -> Status:
        search = ompl_search.Search(problem, run)
        with ompl_search.opened(search, self.planner, self.settings(problem.step)) as setup:
            drive(search, setup)
            del setup
        return search.finish(self.shortcuts)


@dataclass(frozen=True, slots=True)
class RRTstar(Shortest):
    """A tree that is rewired wherever that shortens it.

    Karaman and Frazzoli (2011, doi:10.1177/0278364911406761).

    Parameters
    ----------
    shortcuts
        As for every planner here.
    reach
        Longest edge of the tree, as a multiple of the problem's ``step``, positive; 0 leaves
        it to OMPL, which takes a fifth of the box's diagonal.
    goal_bias
        Share of the samples that are the goal, in [0, 1].

    """

    reach: float = 0.0
    goal_bias: float = 0.05
    name: ClassVar[str] = "rrt-star"
    planner: ClassVar[str] = "RRTstar"

    def settings(self, step: float) -> dict[str, Any]:
        """Range and bias."""
        settings = {"setGoalBias": self.goal_bias}
        if self.reach > 0.0:
            settings["setRange"] = self.reach * step
        return settings


@dataclass(frozen=True, slots=True)
class InformedRRTstar(RRTstar):
    """RRT* that samples only where a shorter path could pass: an ellipsoid about both ends.

    Gammell, Srinivasa and Barfoot (2014, doi:10.1109/IROS.2014.6942976).
    """

    name: ClassVar[str] = "informed-rrt-star"
    planner: ClassVar[str] = "InformedRRTstar"


@dataclass(frozen=True, slots=True)
class SORRTstar(RRTstar):
    """Informed RRT* that takes its samples in the order of how much they could gain.

    Gammell, Barfoot and Srinivasa (2020, doi:10.1177/0278364919890396).
    """

    name: ClassVar[str] = "sorrt-star"
    planner: ClassVar[str] = "SORRTstar"


@dataclass(frozen=True, slots=True)
class BITstar(Shortest):
    """Batches of samples, searched like a graph, best edges first.

    Gammell, Srinivasa and Barfoot (2015, doi:10.1109/ICRA.2015.7139620).

    Parameters
    ----------
    shortcuts
        As for every planner here.
    batch
        Samples in a batch, at least 1.

    """

    batch: int = 100
    name: ClassVar[str] = "bit-star"
    planner: ClassVar[str] = "BITstar"

    def settings(self, step: float) -> dict[str, Any]:  # noqa: ARG002 - some ranges need it
        """Size of the batches."""
        return {"setSamplesPerBatch": self.batch}


@dataclass(frozen=True, slots=True)
class AORRTC(Shortest):
    """RRT-Connect again and again, each time for a path shorter than the last.

    Wilson, Thomason, Kingston, Kavraki and Gammell (2025, arXiv:2505.10542).
    """

    name: ClassVar[str] = "aorrtc"
    planner: ClassVar[str] = "AORRTC"


@dataclass(frozen=True, slots=True)
class FMT(Shortest):
    """Fast marching over one batch of samples; finishes by itself.

    Janson, Schmerling, Clark and Pavone (2015, doi:10.1177/0278364915577958).

    Parameters
    ----------
    shortcuts
        As for every planner here.
    samples
        Size of the batch, at least 1.

    """

    samples: int = 1000
    name: ClassVar[str] = "fmt"
    planner: ClassVar[str] = "FMT"
    default_stop: ClassVar[Stop] = Stop(iterations=20_000)

    def settings(self, step: float) -> dict[str, Any]:  # noqa: ARG002 - some ranges need it
        """Size of the batch."""
        return {"setNumSamples": self.samples}

    def run(self, problem: MotionProblem, run: Run[Waypoints]) -> Status:
        """Offer the one path as found and shortened."""
        return self._searched(problem, run, _once)


@dataclass(frozen=True, slots=True)
class BFMT(FMT):
    """Fast marching from both ends.

    Starek, Gomez, Schmerling, Janson, Moreno and Pavone (2015,
    doi:10.1109/IROS.2015.7353641).
    """

    name: ClassVar[str] = "bfmt"
    planner: ClassVar[str] = "BFMT"


@dataclass(frozen=True, slots=True)
class PRM(Shortest):
    """A roadmap of random places joined to their neighbours.

    Kavraki, Svestka, Latombe and Overmars (1996, doi:10.1109/70.508439).
    """

    name: ClassVar[str] = "prm"
    planner: ClassVar[str] = "PRM"

    def run(self, problem: MotionProblem, run: Run[Waypoints]) -> Status:
        """Offer each better path of the roadmap as found and shortened."""
        return self._searched(problem, run, ompl_search.grow)


@dataclass(frozen=True, slots=True)
class PRMstar(PRM):
    """A roadmap whose places have ever more neighbours, so that its paths tend to the shortest.

    Karaman and Frazzoli (2011, doi:10.1177/0278364911406761).
    """

    name: ClassVar[str] = "prm-star"
    planner: ClassVar[str] = "PRMstar"


def _once(search: ompl_search.Search, setup: Any) -> None:
    ompl_search.attempt(search, setup, 1)
