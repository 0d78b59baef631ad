"""Sampling-based planners of OMPL, with the problem's own exact edge check."""

from dataclasses import dataclass
from traceback import format_exc
from typing import Any, ClassVar

import numpy as np

from solvers.arrays import Floats
from solvers.motion.problem import MotionProblem, Waypoints
from solvers.motion.shortcut import shortcut
from solvers.result import Status, StopReason
from solvers.run import Run
from solvers.stop import Stop


@dataclass(frozen=True, slots=True)
class RRTConnect:
    """Two trees that grow towards each other, then shortcuts (Kuffner and LaValle, 2000).

    An iteration is one validity check, of a point or of an edge, while the trees grow.
    The shortcuts that follow are bounded by ``shortcuts`` alone.

    Parameters
    ----------
    shortcuts
        How many random shortcuts to try on the path found, from 0.
    reach
        Longest edge of the trees, as a multiple of the problem's ``step``, positive; 0
        leaves it to OMPL, which takes a fifth of the box's diagonal.

    """

    shortcuts: int = 100
    reach: float = 0.0
    name: ClassVar[str] = "rrt-connect"
    requires: ClassVar[tuple[str, ...]] = ("ompl",)
    default_stop: ClassVar[Stop] = Stop(iterations=20_000)

    def run(self, problem: MotionProblem, run: Run[Waypoints]) -> Status:
        """Offer the path as found, then shortened."""
        checks = _Checks(problem, run)
        found = _plan(checks, "RRTConnect", self.reach * problem.step)
        if checks.error is not None:
            raise checks.error
        if found is None:
            run.stop_reason = run.limit() or StopReason.FINISHED
            return Status.UNKNOWN
        run.offer(found)
        run.offer(shortcut(found, problem.edge_is_free, run.rng, rounds=self.shortcuts))
        return Status.FEASIBLE


def _plan(checks: "_Checks", planner_name: str, reach: float) -> Waypoints | None:
    """Path that an OMPL planner finds, or ``None``; every OMPL object dies here."""
    from ompl import base, geometric, util

    problem = checks.problem
    level = util.getLogLevel()
    util.setLogLevel(util.LogLevel.LOG_NONE)  # also silences the complaint about a second seed
    try:
        util.RNG.setSeed(int(checks.run.rng.integers(1, 2**31)))
        space = base.RealVectorStateSpace(len(problem.start))
        box = base.RealVectorBounds(len(problem.start))
        for axis, (low, high) in enumerate(problem.bounds.T.tolist()):
            box.setLow(axis, low)
            box.setHigh(axis, high)
        space.setBounds(box)
        setup = geometric.SimpleSetup(space)
        information = setup.getSpaceInformation()
        validator = _exact_edges(base.MotionValidator, information, checks)
        setup.setStateValidityChecker(checks.point_is_free)
        information.setMotionValidator(validator)
        ends = [_state(space, point) for point in (problem.start, problem.goal)]
        setup.setStartAndGoalStates(*ends)
        planner = getattr(geometric, planner_name)(information)
        if reach > 0.0:
            planner.setRange(reach)
        setup.setPlanner(planner)
        solved = setup.solve(base.PlannerTerminationCondition(checks.spent))
        if checks.error is not None or not solved or not setup.haveExactSolutionPath():
            return None
        d = len(problem.start)
        states = setup.getSolutionPath().getStates()
        path = np.array([[state[axis] for axis in range(d)] for state in states])
    finally:
        util.setLogLevel(level)
    path[0], path[-1] = problem.start, problem.goal
    return path


class _Checks:
    """Counts the checks; says no to everything once a limit is reached."""

    def __init__(self, problem: MotionProblem, run: Run[Waypoints]) -> None:
        self.problem = problem
        self.run = run
        self.stopped = False
        self.error: BaseException | None = None

    def spent(self) -> bool:
        """Whether OMPL should give up."""
        return self.stopped

    def point_is_free(self, state: Any) -> bool:
        """Whether a state is free."""
        return self._ask(lambda: self.problem.is_free(self._point(state)))

    def edge_is_free(self, a: Any, b: Any) -> bool:
        """Whether the straight edge between two states is free."""
        return self._ask(lambda: self.problem.edge_is_free(self._point(a), self._point(b)))

    def _ask(self, question: Any) -> bool:
        if self.stopped or not self.run.proceed():
            self.stopped = True
            return False
        try:
            return bool(question())  # OMPL takes nothing but a real bool
        except BaseException as error:  # must not cross OMPL's C++ frames; `run` raises it
            error.add_note(format_exc())
            # Its frames hold OMPL objects in cycles that nobody could collect.
            self.error, self.stopped = error.with_traceback(None), True
            return False

    def _point(self, state: Any) -> Floats:
        return np.array([state[axis] for axis in range(len(self.problem.start))])


def _exact_edges(parent: Any, information: Any, checks: _Checks) -> Any:
    """Motion validator that asks the problem about the whole edge."""

    class ExactEdges(parent):  # type: ignore[misc]  # known only once OMPL is loaded
        def checkMotion(self, a: Any, b: Any, *_last_valid: Any) -> bool:  # noqa: N802
            return checks.edge_is_free(a, b)

    return ExactEdges(information)


def _state(space: Any, point: Floats) -> Any:
    state = space.allocState()
    for axis, value in enumerate(point.tolist()):
        state[axis] = value
    return state
