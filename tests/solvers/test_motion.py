"""Paths round boxes, whose shortest length is known."""

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import (
    InvalidProblem,
    InvalidSolution,
    SolverFailed,
    Status,
    Stop,
    StopReason,
    solve,
)
from solvers.motion import MotionProblem
from solvers.motion.boxes import Boxes
from solvers.motion.instances import random_boxes, random_instances
from solvers.motion.shortcut import shortcut, tightened
from solvers.motion.visibility import shortest_path
from solvers.registry import load, names

BOUNDS = [[0, 0], [10, 10]]
BOX = Boxes([[[4, 2], [6, 8]]])
AROUND = 2 * np.hypot(3, 3) + 2


def round_a_box(edge_is_free=BOX.edge_is_free):
    return MotionProblem([1, 5], [9, 5], BOUNDS, BOX.is_free, edge_is_free, step=0.5)


def length(path):
    return np.linalg.norm(np.diff(path, axis=0), axis=1).sum()


@pytest.mark.parametrize("seed", range(8))
def test_every_edge_of_the_path_is_free_and_it_is_hardly_too_long(seed):
    result = solve(round_a_box(), "rrt-connect", seed=seed)
    assert not any(BOX.meets(a, b) for a, b in itertools.pairwise(result.solution))
    assert AROUND <= result.cost <= 1.01 * AROUND
    assert result.bound == 8.0  # as the crow flies
    assert result.gap == pytest.approx(1 - 8.0 / result.cost)


@pytest.mark.parametrize(
    "solver",
    [
        "rrt-connect",
        pytest.param("rrt-star", marks=pytest.mark.slow),
        pytest.param("bit-star", marks=pytest.mark.slow),
    ],
)
def test_seeded_fields_are_all_solved_close_to_the_shortest(solver):
    ratios = []
    for instance in random_instances(24):
        result = solve(instance.problem, solver, seed=1, stop=Stop(iterations=5000))
        path = result.solution
        assert path is not None
        assert result.refused == 0
        assert not any(instance.boxes.meets(a, b) for a, b in itertools.pairwise(path))
        ratios.append(result.cost / instance.best_known)
    assert min(ratios) >= 1.0
    assert np.mean(ratios) <= 1.10
    assert np.percentile(ratios, 95) <= 1.30


@pytest.mark.parametrize("solver", names("motion"))
def test_planners_give_up_on_a_goal_that_is_walled_in(solver):
    walls = [[[4, 4], [6, 4.2]], [[4, 5.8], [6, 6]], [[4, 4], [4.2, 6]], [[5.8, 4], [6, 6]]]
    room = Boxes(walls)
    problem = MotionProblem([1, 1], [5, 5], BOUNDS, room.is_free, room.edge_is_free, step=0.5)
    result = solve(problem, solver, stop=Stop(iterations=1500))
    assert (result.status, result.solution) == (Status.UNKNOWN, None)
    assert result.iterations == 1500
    assert result.stop_reason is StopReason.ITERATIONS


@pytest.mark.slow
def test_paths_are_the_same_in_another_process_and_ompl_leaves_nothing_behind():
    code = (
        "from solvers import Stop, solve\n"
        "from solvers.motion.instances import random_boxes\n"
        "from solvers.registry import names\n"
        "for name in names('motion'):\n"
        "    for seed in (3, 4):\n"
        "        result = solve(random_boxes(1).problem, name, seed=seed, "
        "stop=Stop(iterations=3000))\n"
        "        print(name, seed, result.cost.hex(), len(result.trace))\n"
    )
    runs = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert runs[0].stdout == runs[1].stdout
    assert len(runs[0].stdout.splitlines()) >= 28
    assert [run.stderr for run in runs] == ["", ""]


def test_the_number_of_checks_ends_the_search():
    result = solve(round_a_box(), "rrt-connect", stop=Stop(iterations=3))
    assert (result.status, result.stop_reason) == (Status.UNKNOWN, StopReason.ITERATIONS)


@pytest.mark.parametrize("solver", ["rrt-connect", "rrt-star", "bit-star", "prm", "fmt"])
def test_ctrl_c_inside_of_a_check_comes_out_as_interrupted(solver):
    asked = []

    def edge(a, b):
        asked.append(1)
        if len(asked) > 5:
            raise KeyboardInterrupt
        return BOX.edge_is_free(a, b)

    result = solve(round_a_box(edge), solver)
    assert result.stop_reason is StopReason.INTERRUPTED
    assert len(asked) == 6


def test_a_crash_inside_of_a_check_is_told_with_its_place():
    def edge(a, b):
        return 1 / 0 if BOX.edge_is_free(a, b) else False

    with pytest.raises(SolverFailed, match="ZeroDivisionError") as told:
        solve(round_a_box(edge), "rrt-star")
    assert "in edge" in told.value.__cause__.__notes__[0]


def test_more_attempts_and_a_warm_start_never_hurt():
    problem = random_boxes(0, boxes=15).problem
    costs = [
        solve(problem, load("motion", "rrt-connect", attempts=n), seed=2).cost for n in (1, 4, 16)
    ]
    assert costs == sorted(costs, reverse=True)
    first = solve(problem, load("motion", "rrt-connect", attempts=1, shortcuts=0), seed=2)
    again = solve(problem, "fmt", initial=first.solution, stop=Stop(iterations=10))
    assert again.cost < first.cost  # the search had no time; the last shortcuts had


def test_a_blocked_end_is_infeasible():
    problem = MotionProblem([5, 5], [9, 5], BOUNDS, BOX.is_free, BOX.edge_is_free, step=0.5)
    assert solve(problem, "rrt-connect").status is Status.INFEASIBLE


def test_without_an_edge_check_points_are_tried():
    problem = MotionProblem([1, 5], [9, 5], BOUNDS, BOX.is_free, step=0.1)
    assert not problem.edge_is_free(problem.start, problem.goal)
    assert solve(problem, "rrt-connect", seed=1).solution is not None


def test_parameters_out_of_range_are_refused():
    for name, wrong in (("rrt-connect", {"attempts": 0}), ("rrt-star", {"shortcuts": -1})):
        with pytest.raises(InvalidProblem, match=r"at least|from"):
            load("motion", name, **wrong)


@given(st.integers(0, 10**6))
def test_shortening_never_lengthens_and_keeps_ends_and_freedom(seed):
    rng = np.random.default_rng(seed)
    corners = [[2, 8.5 + 1.5 * rng.random()], [8, 8.5 + 1.5 * rng.random()]]
    path = np.array([[1.0, 5], [1.5, rng.uniform(0, 9)], *corners, [9, 5]])
    if not all(BOX.edge_is_free(a, b) for a, b in itertools.pairwise(path)):
        return
    problem = round_a_box()
    for shorter in (
        shortcut(path, BOX.edge_is_free, rng, rounds=20),
        tightened(path, BOX.edge_is_free, sweeps=3),
    ):
        np.testing.assert_array_equal(shorter[[0, -1]], path[[0, -1]])
        assert problem.cost(shorter) <= problem.cost(path) + 1e-12


def test_a_tightened_path_lies_along_the_box():
    path = np.array([[1.0, 5], [2, 9.5], [8, 9.9], [9, 5]])
    assert length(tightened(path, BOX.edge_is_free, sweeps=20)) == pytest.approx(AROUND, rel=5e-3)


def test_the_height_is_pulled_straight_even_where_a_corner_is_in_the_way():
    path = np.array([[1.0, 5, 0], [4, 8.01, 3], [6, 8.01, -3], [9, 5, 0]])
    taut = tightened(path, BOX.edge_is_free, sweeps=5)
    assert np.abs(taut[:, 2]).max() < 0.05


@given(st.integers(0, 10**6))
def test_what_the_edge_check_calls_free_is_free_by_rational_arithmetic(seed):
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 8, (3, 2)).astype(float)
    boxes = Boxes(np.stack([low, low + rng.integers(1, 4, (3, 2))], axis=1))
    a, b = rng.integers(0, 12, (2, 3)) / rng.integers(1, 4)  # many touch sides and corners
    if boxes.edge_is_free(a, b):
        assert not boxes.meets(a, b)
    grown = Boxes(boxes.corners + np.array([-1e-6, 1e-6])[:, None])
    if not grown.meets(a, b):
        assert boxes.edge_is_free(a, b)
    assert boxes.is_free(a) == boxes.edge_is_free(a, a)
    assert boxes.edge_is_free(a, b) == boxes.edge_is_free(b, a)


def test_touching_a_box_is_not_entering_it():
    along, corner = np.array([[4.0, 8], [6, 8]]), np.array([[2.0, 8], [5, 5]])
    assert not BOX.meets(*along)
    assert not BOX.meets(np.array([3.0, 7]), np.array([5.0, 9]))  # through the corner (4, 8)
    assert BOX.meets(*corner)


@pytest.mark.parametrize(
    ("start", "goal", "expected"),
    [
        ([1, 5], [9, 5], AROUND),
        ([1, 4], [9, 4], 2 * np.hypot(3, 2) + 2),
        ([1, 5, 0], [9, 5, 7], np.hypot(AROUND, 7)),
        ([1, 1], [9, 1], 8),
        ([4, 2], [6, 8], 8),
        ([4, 5], [4, 5], 0),
    ],
)
def test_shortest_paths_match_hand_worked_values(start, goal, expected):
    path = shortest_path(BOX, np.array(start, dtype=float), np.array(goal, dtype=float))
    assert length(path) == pytest.approx(expected, abs=1e-12)
    np.testing.assert_array_equal(path[[0, -1]], [start, goal])


def test_a_closed_ring_has_no_way_in():
    ring = Boxes([[[4, 4], [6, 5]], [[4, 5.5], [6, 6]], [[4, 4], [4.5, 6]], [[5.5, 4], [6, 6]]])
    assert shortest_path(ring, np.array([1.0, 1]), np.array([5.0, 5.2])) is None


@pytest.mark.parametrize("seed", range(20))
def test_shortest_paths_touch_boxes_and_never_enter_them(seed):
    instance = random_boxes(seed, boxes=25)
    problem, path = instance.problem, instance.shortest
    shrunk = Boxes(instance.boxes.corners + np.array([1e-9, -1e-9])[:, None])
    assert not any(shrunk.meets(a, b) for a, b in itertools.pairwise(path))
    assert not problem.edge_is_free(problem.start, problem.goal)
    assert instance.best_known == pytest.approx(length(path))
    np.testing.assert_array_equal(path[[0, -1]], [problem.start, problem.goal])
    slope = np.diff(path[:, 2]) / np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1)
    np.testing.assert_allclose(slope, slope[0])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_long_search_comes_within_half_a_percent_of_the_visibility_graph(seed):
    instance = random_boxes(seed)
    result = solve(instance.problem, "aorrtc", stop=Stop(iterations=10_000))
    assert 1.0 <= result.cost / instance.best_known < 1.005


def test_seeded_fields_repeat_and_differ():
    first, again, other = random_boxes(5), random_boxes(5), random_boxes(6)
    np.testing.assert_array_equal(first.boxes.corners, again.boxes.corners)
    assert first.best_known == again.best_known != other.best_known


@pytest.mark.parametrize("wrong", [{"boxes": 0}, {"side": -1.0}, {"boxes": 2000}])
def test_fields_that_cannot_be_are_refused(wrong):
    with pytest.raises(InvalidProblem, match="boxes"):
        random_boxes(0, **wrong)


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
    given = {"start": [1, 5], "goal": [9, 5], "bounds": BOUNDS, "is_free": BOX.is_free, "step": 1.0}
    with pytest.raises(InvalidProblem, match=message):
        MotionProblem(**{**given, **change})


def test_the_comparison_of_planners_runs_and_finds_no_edge_inside_a_box():
    page = Path(__file__).parents[2] / "docs" / "comparisons" / "repairs.py"
    done = subprocess.run(
        [sys.executable, str(page), "3", "6", "rrt-connect", "kpiece"],
        capture_output=True,
        text=True,
        check=True,
    )
    rows = [line.split(" | ") for line in done.stdout.splitlines() if " 3/3 " in line]
    assert [row[0].strip("| ") for row in rows] == ["rrt-connect", "kpiece"]
    assert [row[5] for row in rows] == ["0", "0"]
