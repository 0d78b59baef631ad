"""Paths round one box, whose shortest length is known."""

import itertools

import numpy as np
import pytest

from solvers import InvalidProblem, InvalidSolution, Status, Stop, StopReason, solve
from solvers.motion import MotionProblem
from solvers.motion.shortcut import shortcut
from solvers.testing import _clear, _outside

BOUNDS = [[0, 0], [10, 10]]


def round_a_box(edge_is_free=_clear):
    return MotionProblem([1, 5], [9, 5], BOUNDS, _outside, edge_is_free, step=0.5)


@pytest.mark.parametrize("seed", range(8))
def test_every_edge_of_the_path_is_free_and_it_is_not_much_too_long(seed):
    result = solve(round_a_box(), "rrt-connect", seed=seed)
    path = result.solution
    assert all(_clear(a, b) for a, b in itertools.pairwise(path))
    assert 2 * np.hypot(3, 3) + 2 <= result.cost <= 1.3 * (2 * np.hypot(3, 3) + 2)


def test_the_number_of_checks_ends_the_search():
    result = solve(round_a_box(), "rrt-connect", stop=Stop(iterations=3))
    assert (result.status, result.stop_reason) == (Status.UNKNOWN, StopReason.ITERATIONS)


def test_ctrl_c_inside_of_a_check_comes_out_as_interrupted():
    asked = []

    def edge(a, b):
        asked.append(1)
        if len(asked) > 5:
            raise KeyboardInterrupt
        return _clear(a, b)

    result = solve(round_a_box(edge), "rrt-connect")
    assert result.stop_reason is StopReason.INTERRUPTED


def test_a_blocked_end_is_infeasible():
    problem = MotionProblem([5, 5], [9, 5], BOUNDS, _outside, _clear, step=0.5)
    assert solve(problem, "rrt-connect").status is Status.INFEASIBLE


def test_without_an_edge_check_points_are_tried():
    problem = MotionProblem([1, 5], [9, 5], BOUNDS, _outside, step=0.1)
    assert not problem.edge_is_free(problem.start, problem.goal)
    assert solve(problem, "rrt-connect", seed=1).solution is not None


def test_shortcuts_never_lengthen_and_keep_the_ends():
    path = np.array([[1.0, 5], [2, 9], [3, 9.5], [8, 9.5], [9, 9], [9, 5]])
    shorter = shortcut(path, _clear, np.random.default_rng(0), rounds=50)
    np.testing.assert_array_equal(shorter[[0, -1]], path[[0, -1]])
    problem = round_a_box()
    assert problem.cost(shorter) < problem.cost(path)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ([[1, 5], [9, 5]], "edge 0"),
        ([[1, 5], [1, 9]], "start to goal"),
        ([[1, 5], [5, 11], [9, 5]], "bounds"),
        ([[1, 5], [np.nan, 9], [9, 5]], "finite"),
        ([1, 5], "waypoints"),
    ],
)
def test_what_is_no_path_is_refused(wrong, message):
    with pytest.raises(InvalidSolution, match=message):
        round_a_box().cost(wrong)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": [11, 0]}, "outside"),
        ({"step": 0}, "step"),
        ({"bounds": [[0, 0], [0, 1]]}, "corner"),
    ],
)
def test_bad_input_is_named(change, message):
    given = {"start": [1, 5], "goal": [9, 5], "bounds": BOUNDS, "is_free": _outside, "step": 1.0}
    with pytest.raises(InvalidProblem, match=message):
        MotionProblem(**{**given, **change})
