"""Bounds that never lie and proofs that hold, against trying everything and published optima."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import InvalidProblem, InvalidSolution, Status, Stop, StopReason, solve
from solvers.registry import load
from solvers.tour import TourProblem
from solvers.tour.bounds import assignment_bound, grain, held_karp_bound
from solvers.tour.closing import closed_costs
from solvers.tour.instances import random_instance, read_tsplib
from solvers.tour.one_tree_kernels import new_one_tree, one_tree, spare

ENDS = (
    {},
    {"start": 1},
    {"closed": False},
    {"closed": False, "start": 1},
    {"closed": False, "end": 0},
    {"closed": False, "start": 2, "end": 0},
)


def distances(places):
    return np.linalg.norm(places[:, None] - places[None, :], axis=2)


def by_trying_everything(problem):
    best = np.inf
    for order in itertools.permutations(range(problem.size)):
        try:
            best = min(best, problem.cost(np.array(order)))
        except InvalidSolution:
            continue
    return best


def drawn(seed, n, kind, ends):
    """Random problem: places in the plane, whole numbers with many ties, or any numbers."""
    rng = np.random.default_rng(seed)
    if kind == "plane":
        costs = distances(rng.random((n, 2)))
    elif kind == "ties":
        costs = rng.integers(0, 4, (n, n)).astype(float)
    else:
        costs = rng.random((n, n)) * 10.0 ** rng.integers(-9, 9)
    if kind != "asymmetric":
        costs = np.triu(costs, 1)
        costs += costs.T
    return TourProblem(costs, **ends)


KINDS = st.sampled_from(["plane", "ties", "any"])


@given(st.integers(0, 10**6), st.integers(4, 7), KINDS, st.sampled_from(ENDS))
@settings(max_examples=60, deadline=None)
def test_branch_and_bound_proves_the_cheapest_of_all_orders(seed, n, kind, ends):
    problem = drawn(seed, n, kind, ends)
    result = solve(problem, load("tour", "branch-and-bound", kicks=0), seed=seed)
    assert result.cost == pytest.approx(by_trying_everything(problem), rel=1e-9)
    assert (result.status, result.stop_reason) == (Status.OPTIMAL, StopReason.FINISHED)


@given(st.integers(0, 10**6), st.integers(4, 7), KINDS, st.sampled_from(ENDS))
@settings(max_examples=60, deadline=None)
def test_bounds_are_below_the_cheapest_of_all_orders(seed, n, kind, ends):
    problem = drawn(seed, n, kind, ends)
    best = by_trying_everything(problem)
    for bound in (held_karp_bound(problem), held_karp_bound(problem, steps=3)):
        assert 0.0 <= bound <= best * (1.0 + 1e-9)
    assert 0.0 <= assignment_bound(problem) <= best * (1.0 + 1e-9)


@given(st.integers(0, 10**6), st.integers(4, 7), st.sampled_from(ENDS))
@settings(max_examples=30, deadline=None)
def test_the_assignment_bound_takes_one_way_streets(seed, n, ends):
    problem = drawn(seed, n, "asymmetric", ends)
    best = by_trying_everything(problem)
    assert 0.0 < assignment_bound(problem) <= best * (1.0 + 1e-9)
    with pytest.raises(InvalidProblem, match="assignment"):
        held_karp_bound(problem)


@given(st.integers(0, 10**6), st.integers(4, 9), KINDS)
@settings(max_examples=30, deadline=None)
def test_spare_is_what_an_edge_adds_to_the_cheapest_one_tree(seed, n, kind):
    """Against a second 1-tree in which that edge is nearly free."""
    costs = drawn(seed, n, kind, {}).costs
    scale = costs.max() or 1.0
    prices = scale * np.random.default_rng(seed).normal(size=n)
    tree = new_one_tree(n)
    bound = one_tree(costs, prices, tree)
    rise = spare(costs, prices, tree)
    for i, j in itertools.combinations(range(n), 2):
        drawn_in, wall = costs.copy(), 100.0 * n * scale
        drawn_in[i, j] = drawn_in[j, i] = costs[i, j] - wall
        forced = one_tree(drawn_in, prices, new_one_tree(n)) + wall
        assert rise[i, j] == pytest.approx(forced - bound, abs=1e-9 * wall)


@pytest.mark.parametrize("ends", ENDS[:4])
def test_bounds_of_a_hundred_places_are_close(ends):
    problem = TourProblem(random_instance(100, 4).problem.costs, **ends)
    result = solve(problem, "branch-and-bound", stop=Stop(iterations=100_000))
    assert result.status is Status.OPTIMAL
    assert 0.97 * result.cost <= held_karp_bound(problem) <= result.cost


def test_bounds_of_published_problems(shared_data):
    folder = shared_data / "optimisation" / "tsplib"
    for name, facts in json.loads((folder / "best_known.json").read_text()).items():
        problem = read_tsplib(folder / f"{name}.tsp").problem
        bound = held_karp_bound(problem, steps=300 if problem.size > 500 else 1500)
        assert 0.97 * facts["best_known"] <= bound <= facts["best_known"]


def test_published_optima_are_proven(shared_data):
    folder = shared_data / "optimisation" / "tsplib"
    for name, facts in json.loads((folder / "best_known.json").read_text()).items():
        if facts["dimension"] > 130:
            continue
        result = solve(read_tsplib(folder / f"{name}.tsp").problem, "branch-and-bound")
        assert (result.cost, result.status) == (facts["best_known"], Status.OPTIMAL)


def test_a_limit_leaves_a_tour_and_a_bound():
    problem = random_instance(120, 2, clusters=8).problem
    solver = load("tour", "branch-and-bound", kicks=0)
    optimum = solve(problem, "branch-and-bound").cost
    for nodes in (1, 2, 5, 30):
        result = solve(problem, solver, stop=Stop(iterations=nodes))
        assert result.iterations <= nodes
        assert result.bound <= optimum + 1e-9 <= result.cost + 2e-9


def test_costs_of_whole_numbers_round_the_bound_up():
    costs = random_instance(30, 1).problem.costs
    assert grain(costs) == 0.0
    assert grain(np.array([[0.0, 12.0], [18.0, 0.0]])) == 6.0
    problem = TourProblem(6.0 * np.rint(costs))
    assert held_karp_bound(problem) % 6.0 == 0.0


def test_closing_an_open_tour_keeps_tiny_costs_exact():
    problem = TourProblem(1e-12 * random_instance(20, 1).problem.costs, closed=False, start=3)
    assert closed_costs(problem).max() < 1e-6
    result = solve(problem, "branch-and-bound")
    assert result.status is Status.OPTIMAL
    large = TourProblem(random_instance(20, 1).problem.costs, closed=False, start=3)
    assert result.cost == pytest.approx(1e-12 * solve(large, "branch-and-bound").cost)
