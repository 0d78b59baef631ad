"""Tours that are known: circles, lines, and all orders of a few places."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import InvalidProblem, InvalidSolution, Stop, solve
from solvers.tour import TourProblem
from solvers.tour.closing import closed, closed_costs, opened

BEST = ("two-opt", "ortools")


def distances(places):
    return np.linalg.norm(places[:, None] - places[None, :], axis=2)


@pytest.mark.parametrize("solver", BEST)
def test_a_circle_is_walked_once_around(solver):
    angle = np.random.default_rng(0).permutation(np.linspace(0, 2 * np.pi, 30, endpoint=False))
    problem = TourProblem(distances(np.column_stack([np.cos(angle), np.sin(angle)])))
    result = solve(problem, solver, stop=Stop(iterations=40))
    assert result.cost == pytest.approx(60 * np.sin(np.pi / 30))


@pytest.mark.parametrize("solver", BEST)
@pytest.mark.parametrize(
    ("ends", "length"),
    [({}, 19), ({"start": 0}, 19), ({"end": 5}, 24), ({"start": 5, "end": 6}, 37)],
)
def test_a_line_is_walked_from_end_to_end(solver, ends, length):
    problem = TourProblem(distances(np.arange(20.0)[:, None]), closed=False, **ends)
    assert solve(problem, solver, stop=Stop(iterations=60)).cost == pytest.approx(length)


@given(st.integers(0, 10**6), st.integers(4, 40), st.integers(0, 4))
@settings(max_examples=60, deadline=None)
def test_descent_leaves_no_move_of_two_edges(seed, n, kind):
    rng = np.random.default_rng(seed)
    ends = [{}, {"closed": False}, {"start": 1}, {"closed": False, "start": 0}]
    ends.append({"closed": False, "start": 2, "end": 0})
    problem = TourProblem(distances(rng.random((n, 2))), **ends[kind])
    result = solve(problem, "two-opt", seed=1, stop=Stop(iterations=2))
    assert result.refused == 0
    costs = closed_costs(problem)
    tour = closed(problem, result.solution)
    if len(costs) > 11:
        return  # neighbour lists leave moves out
    for i in range(len(tour)):
        for j in range(i + 2, len(tour) - (i == 0)):
            a, b, c, d = tour[i], tour[i + 1], tour[j], tour[(j + 1) % len(tour)]
            assert costs[a, c] + costs[b, d] >= costs[a, b] + costs[c, d] - 1e-9


@given(st.integers(0, 10**6), st.booleans())
def test_closing_and_opening_give_the_order_back(seed, is_closed):
    rng = np.random.default_rng(seed)
    problem = TourProblem(distances(rng.random((6, 2))), is_closed, start=2)
    order = np.concatenate([[2], rng.permutation([0, 1, 3, 4, 5])])
    turned = np.roll(closed(problem, order), 3)
    np.testing.assert_array_equal(opened(problem, turned), order)


def test_no_solver_is_needed_for_three_places():
    result = solve(TourProblem(distances(np.array([[0.0], [5], [1]])), closed=False), "nearest")
    assert (result.cost, result.status, result.iterations) == (5.0, "optimal", 0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"costs": np.ones((2, 3))}, "shape"),
        ({"costs": np.zeros((0, 0))}, "shape"),
        ({"costs": -np.ones((3, 3))}, "least 0"),
        ({"costs": np.full((3, 3), np.inf)}, "finite"),
        ({"costs": np.ones((3, 3)), "start": 3}, "start"),
        ({"costs": np.ones((3, 3)), "end": 1}, "closed"),
        ({"costs": np.ones((3, 3)), "closed": False, "start": 1, "end": 1}, "both"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(InvalidProblem, match=message):
        TourProblem(**arguments)


def test_fixed_ends_are_held():
    problem = TourProblem(np.ones((4, 4)), closed=False, start=0, end=3)
    assert problem.cost([0, 2, 1, 3]) == 3.0
    for wrong in ([1, 0, 2, 3], [0, 3, 1, 2]):
        with pytest.raises(InvalidSolution):
            problem.cost(wrong)
