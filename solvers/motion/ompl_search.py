"""Run a planner of OMPL with the problem's own exact checks, counted one by one."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from traceback import format_exc
from typing import Any

import numpy as np

from solvers.arrays import Floats
from solvers.motion.graph import shortest_route
from solvers.motion.problem import MotionProblem, Waypoints
from solvers.motion.shortcut import shortcut, straightened, tightened
from solvers.result import Status, StopReason
from solvers.run import Run

_PATIENCE = 100_000  # looks at the limits without a check in between after which a search is over
_POLISH = 0.1  # share of the seconds that is kept for the last shortcuts
_LEAST_CHECKS = 100  # that each attempt may take
_SWEEPS = 2  # of the last tightening


class Search:
    """What a planner may ask, and where its paths go; no to everything once a limit is reached.

    Attributes
    ----------
    error
        What a check raised. It must not cross OMPL's C++ frames, so :meth:`finish` raises it.
    cap
        Number of iterations at which the attempt at hand is over.

    """

    def __init__(self, problem: MotionProblem, run: Run[Waypoints]) -> None:
        self.problem = problem
        self.run = run
        self.error: BaseException | None = None
        self.cap = math.inf
        self._stopped = False
        self._idle = 0
        run.bound = float(np.linalg.norm(problem.goal - problem.start))  # no path is shorter
        self._reserve = _POLISH * (run.stop.seconds or 0.0)

    def spent(self) -> bool:
        """Whether OMPL should give up; it looks here again and again."""
        self._idle += 1
        return self.stopped or self.run.iteration >= self.cap

    @property
    def stopped(self) -> bool:
        """Whether the whole search is over."""
        if not self._stopped:
            if self._idle > _PATIENCE or self.run.limit() is not None:
                self._stopped = True
            elif self.run.remaining <= self._reserve:
                self.run.stop_reason, self._stopped = StopReason.TIME, True
        return self._stopped

    def point_is_free(self, state: Any) -> bool:
        """Whether a state of OMPL is free."""
        return self._ask(lambda: self.problem.is_free(self.point(state)))

    def motion_is_free(self, a: Any, b: Any) -> bool:
        """Whether the straight edge between two states of OMPL is free."""
        return self._ask(lambda: self.problem.edge_is_free(self.point(a), self.point(b)))

    def found(self, states: Any) -> None:
        """Offer a path of OMPL's states as it is, and pulled taut."""
        path = np.array([self.point(state) for state in states])
        path[0], path[-1] = self.problem.start, self.problem.goal
        self.run.offer(path)

        def edge_is_free(a: Floats, b: Floats) -> bool:
            return self._ask(lambda: self.problem.edge_is_free(a, b))

        self.run.offer(tightened(straightened(path, edge_is_free), edge_is_free, sweeps=1))

    def finish(self, shortcuts: int) -> Status:
        """Shorten the best path with checks that do not count, as long as there is time."""
        if self.error is not None:
            raise self.error
        run = self.run
        run.stop_reason = run.limit() or run.stop_reason
        if run.best is None:
            return Status.UNKNOWN

        def edge_is_free(a: Floats, b: Floats) -> bool:
            return run.remaining > 0.0 and self.problem.edge_is_free(a, b)

        path = shortcut(run.best, edge_is_free, run.rng, rounds=shortcuts)
        run.offer(tightened(path, edge_is_free, sweeps=_SWEEPS))
        return Status.FEASIBLE

    def _ask(self, question: Callable[[], Any]) -> bool:
        try:
            if self.stopped or not self.run.proceed():
                self._stopped = True
                return False
            self._idle = 0
            return bool(question())  # OMPL takes nothing but a real bool
        except BaseException as error:
            error.add_note(format_exc())
            # Its frames hold OMPL objects in cycles that nobody could collect.
            self.error, self._stopped = error.with_traceback(None), True
            return False

    def point(self, state: Any) -> Floats:
        """Coordinates of a state of OMPL, shape (d,)."""
        return np.array([state[axis] for axis in range(len(self.problem.start))])


@contextmanager
def opened(search: Search, planner_name: str, settings: Mapping[str, Any]) -> Iterator[Any]:
    """An OMPL set-up of the search's problem; whoever takes it must let go of it at the end.

    Parameters
    ----------
    search
        Answers the checks.
    planner_name
        Class in ``ompl.geometric``.
    settings
        Setter of the planner -> its argument.

    """
    from ompl import base, geometric, util

    level = util.getLogLevel()
    util.setLogLevel(util.LogLevel.LOG_NONE)  # also silences the complaint about a second seed
    try:
        util.RNG.setSeed(int(search.run.rng.integers(1, 2**31)))
        problem, d = search.problem, len(search.problem.start)
        space, box = base.RealVectorStateSpace(d), base.RealVectorBounds(d)
        for axis, (low, high) in enumerate(problem.bounds.T.tolist()):
            box.setLow(axis, low)
            box.setHigh(axis, high)
        space.setBounds(box)
        setup = geometric.SimpleSetup(space)
        information = setup.getSpaceInformation()
        setup.setStateValidityChecker(search.point_is_free)
        information.setMotionValidator(_exact_edges(base.MotionValidator, information, search))
        setup.setStartAndGoalStates(*(_state(space, end) for end in (problem.start, problem.goal)))
        setup.setOptimizationObjective(base.PathLengthOptimizationObjective(information))
        planner = getattr(geometric, planner_name)(information)
        for setter, value in settings.items():
            getattr(planner, setter)(value)
        setup.setPlanner(planner)
        setup.setup()
        yield setup
    finally:
        util.setLogLevel(level)


def attempt(search: Search, setup: Any, attempts: int) -> None:
    """Plan anew that often; each attempt after the first path ends at twice its checks."""
    from ompl import base

    for _ in range(attempts):
        begun = search.run.iteration
        setup.clear()
        setup.solve(base.PlannerTerminationCondition(search.spent))
        if search.error is not None:
            return
        if setup.haveExactSolutionPath():
            if math.isinf(search.cap):
                share = max(_LEAST_CHECKS, 2 * (search.run.iteration - begun))
            search.found(setup.getSolutionPath().getStates())
        elif math.isinf(search.cap):
            return  # it would not find the first path by trying again
        search.cap = search.run.iteration + share


def improve(search: Search, setup: Any) -> None:
    """Let an anytime planner go on until the limit, and hand over each better path it has."""
    from ompl import base

    better = _Better(search, setup.getPlanner())
    try:
        while True:
            setup.solve(base.PlannerTerminationCondition(better.over))
            if search.error is not None or not better.than_before():
                return
            search.found(setup.getSolutionPath().getStates())
    finally:
        better.planner = None  # a planner that keeps the condition would keep itself alive


def grow(search: Search, setup: Any) -> None:
    """Grow a roadmap; look for its shortest path whenever the checks have grown by half.

    OMPL's own look-up runs in a second thread beside the growth: that would not repeat.
    """
    from ompl import base

    planner = setup.getPlanner()
    planner.solve(base.plannerAlwaysTerminatingCondition())  # only puts start and goal in
    while not search.stopped:
        search.cap = max(_LEAST_CHECKS, 1.5 * search.run.iteration)
        planner.growRoadmapPtc(base.PlannerTerminationCondition(search.spent))
        if search.error is not None:
            return
        roadmap = base.PlannerData(setup.getSpaceInformation())
        planner.getPlannerData(roadmap)
        states = [roadmap.getVertex(v).getState() for v in range(roadmap.numVertices())]
        edges = [(v, w) for v in range(len(states)) for w in roadmap.getEdges(v)]
        route = shortest_route(
            np.array([search.point(state) for state in states]),
            np.array(edges, dtype=np.int64).reshape(-1, 2),
            roadmap.getStartIndex(0),
            roadmap.getGoalIndex(0),
        )
        if route:
            search.found([states[node] for node in route])


class _Better:
    """Notices that a planner has improved its path."""

    def __init__(self, search: Search, planner: Any) -> None:
        self.search = search
        self.planner = planner
        self.known = math.inf

    def over(self) -> bool:
        """Whether to leave the planner, for a better path or for good."""
        return self.search.spent() or float(self.planner.bestCost().value()) < self.known

    def than_before(self) -> bool:
        """Whether the cost has fallen since the last call."""
        before, self.known = self.known, float(self.planner.bestCost().value())
        return self.known < before


def _exact_edges(parent: Any, information: Any, search: Search) -> Any:
    """Motion validator that asks the problem about the whole edge."""

    class ExactEdges(parent):  # type: ignore[misc]  # known only once OMPL is loaded
        def checkMotion(self, a: Any, b: Any, *_last_valid: Any) -> bool:  # noqa: N802
            return search.motion_is_free(a, b)

    return ExactEdges(information)


def _state(space: Any, point: Floats) -> Any:
    state = space.allocState()
    for axis, value in enumerate(point.tolist()):
        state[axis] = value
    return state
