"""Costs of mixed magnitudes: bounds below every order, and proofs of the cheapest."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Status, Stop, solve
from solvers.registry import load
from solvers.tour import TourProblem
from solvers.tour.bounds import assignment_bound, grain, held_karp_bound, proves, rounded_up
from solvers.tour.closing import closing, limited, quick_upper
from solvers.tour.nearest import nearest_order
from solvers.tour.proof_kernels import new_frames, with_room

ENDS = (
    {},
    {"closed": False},
    {"closed": False, "start": 1},
    {"closed": False, "end": 0},
    {"closed": False, "start": 2, "end": 0},
)
LARGE = st.sampled_from([1e6, 1e9, 1e12, 1e15])


def distances(places):
    return np.linalg.norm(places[:, None] - places[None, :], axis=2)


def by_trying_everything(problem):
    orders = (
        np.array(order)
        for order in itertools.permutations(range(problem.size))
        if problem.start in {None, order[0]} and problem.end in {None, order[-1]}
    )
    return min(problem.cost(order) for order in orders)


def with_dear_legs(seed, n, dear, legs, *, symmetric=True, **ends):
    """Places in a unit square, some legs between them made dear."""
    rng = np.random.default_rng(seed)
    costs = distances(rng.random((n, 2)))
    for a, b in zip(rng.integers(0, n, legs), rng.integers(0, n, legs), strict=True):
        costs[a, b] = dear
        if symmetric:
            costs[b, a] = dear
    return TourProblem(costs, **ends)


@given(st.integers(0, 10**6), st.integers(4, 7), LARGE, st.integers(1, 8), st.sampled_from(ENDS))
@settings(max_examples=60, deadline=None)
def test_dear_legs_leave_proofs_and_bounds_true(seed, n, dear, legs, ends):
    problem = with_dear_legs(seed, n, dear, legs, **ends)
    best = by_trying_everything(problem)
    for solver in ("auto", "branch-and-bound"):
        result = solve(problem, solver, seed=seed)
        assert result.status is Status.OPTIMAL
        assert result.cost <= best * (1.0 + 1e-9)
    assert 0.0 <= held_karp_bound(problem) <= best
    assert 0.0 <= held_karp_bound(problem, upper=0.5 * best) <= best
    assert 0.0 <= assignment_bound(problem) <= best


@given(st.integers(0, 10**6), st.integers(4, 7), st.sampled_from(ENDS))
@settings(max_examples=60, deadline=None)
def test_proofs_hold_however_dear_the_first_tour_was(seed, n, ends):
    """Costs over twenty orders of magnitude, and no kick that would mend the first tour."""
    costs = np.triu(np.exp(np.random.default_rng(seed).normal(0.0, 12.0, (n, n))), 1)
    problem = TourProblem(costs + costs.T, **ends)
    result = solve(problem, load("tour", "branch-and-bound", kicks=0), seed=seed)
    assert result.status is Status.OPTIMAL
    assert result.cost <= by_trying_everything(problem) * (1.0 + 1e-9)


def test_a_proof_that_begins_with_a_dear_tour_ends_with_the_cheapest():
    """The first tour costs 6e10, which blurs what is between 7 and 0.09."""
    rng = np.random.default_rng(1724)
    n = int(rng.integers(4, 9))
    costs = np.triu(np.exp(rng.normal(0.0, 12.0, (n, n))), 1)
    problem = TourProblem(costs + costs.T, closed=False, start=0)
    result = solve(problem, load("tour", "branch-and-bound", kicks=0), seed=1724)
    assert result.trace[0].cost > 1e10
    assert result.cost == pytest.approx(by_trying_everything(problem), rel=1e-9)


@given(st.integers(0, 10**6), st.integers(4, 7), LARGE, st.integers(1, 8), st.sampled_from(ENDS))
@settings(max_examples=40, deadline=None)
def test_dear_legs_leave_the_assignment_bound_true_one_way(seed, n, dear, legs, ends):
    problem = with_dear_legs(seed, n, dear, legs, symmetric=False, **ends)
    assert 0.0 <= assignment_bound(problem) <= by_trying_everything(problem)


@given(st.integers(0, 10**6), st.sampled_from([1e8, 1e10, 1e12]), st.sampled_from(ENDS))
@settings(max_examples=40, deadline=None)
def test_bounds_stay_below_the_optimum_where_digits_run_out(seed, side, ends):
    costs = side * distances(np.random.default_rng(seed).random((7, 2)))
    for own in (np.rint(costs), costs):
        problem = TourProblem(own, **ends)
        best = by_trying_everything(problem)
        assert held_karp_bound(problem) <= best
        assert assignment_bound(problem) <= best
        assert solve(problem, "branch-and-bound").cost <= best * (1.0 + 1e-9)


@pytest.mark.parametrize("solver", ["two-opt", "iterated-local-search", "ortools", "ant-colony"])
@pytest.mark.parametrize("ends", [{}, {"closed": False, "start": 0}])
def test_searches_are_not_dazzled_by_one_dear_leg(solver, ends):
    """Places on a circle, one chord of it very dear; the best walk goes around."""
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    costs = distances(np.column_stack([np.cos(angle), np.sin(angle)]))
    costs[3, 8] = costs[8, 3] = 1e15
    legs = 12 if ends == {} else 11
    result = solve(TourProblem(costs, **ends), solver, stop=Stop(iterations=300))
    assert result.cost == pytest.approx(legs * 2.0 * np.sin(np.pi / 12))


def test_no_leg_is_much_dearer_than_a_quick_order():
    """Nearest neighbours lead into a dear leg at the end, and 3-opt out of it."""
    line = np.array([0.0, 1.0, -1.5, 2.9, -3.5])[:, None]
    costs = distances(line)
    costs[2, 4] = costs[4, 2] = 1e15
    problem = TourProblem(costs, closed=False, start=0)
    assert nearest_order(problem, 0).tolist() == [0, 1, 3, 2, 4]
    best = by_trying_everything(problem)
    assert best <= quick_upper(problem) <= 2.0 * best
    whole = closing(problem)
    assert whole.dearest == limited(problem).max() <= (1.0 + 2e-6) * quick_upper(problem)
    assert whole.surcharge == 6.0 * whole.dearest
    plain = TourProblem(distances(line))
    assert limited(plain) is plain.costs  # nothing to do


def test_dear_legs_do_not_hide_the_grain():
    costs = np.array([[0, 6, 12, 10**9 + 1], [6, 0, 18, 6], [12, 18, 0, 6], [10**9 + 1, 6, 6, 0]])
    assert grain(costs.astype(float)) == 1.0
    assert grain(costs.astype(float), dearest=18.0) == 6.0
    assert grain(np.full((9, 9), 1e13)) == 1e13
    assert grain(1e13 * np.ones((9, 9)) + np.eye(9)) == 0.0  # sums of rounding reach a unit


def test_what_counts_as_proof():
    assert (rounded_up(12.1, 6.0), rounded_up(12.0, 6.0), rounded_up(-1.0, 0.0)) == (
        18.0,
        12.0,
        0.0,
    )
    assert proves(5.0, 5.0, 1.0)
    assert not proves(5.0 - 1e-12, 5.0, 1.0)
    assert proves(5.0 - 1e-12, 5.0, 0.0)
    assert not proves(5.0 - 1e-6, 5.0, 0.0)


def test_a_full_branch_gets_room_and_keeps_what_it_holds():
    frames = new_frames(2, 5)
    frames.prices[:] = np.arange(10.0).reshape(2, 5)
    frames.edge[:] = 3, 4
    assert with_room(frames) is frames
    frames.at[0] = 2
    larger = with_room(frames)
    assert larger.prices.shape == (4, 5)
    np.testing.assert_array_equal(larger.prices[:2], frames.prices)
    np.testing.assert_array_equal(larger.edge[:2], [3, 4])
    assert larger.at.tolist() == [2, 1]


def test_room_for_the_branch_changes_no_proof(monkeypatch):
    import solvers.tour.branch_and_bound as module
    from solvers.tour.instances import random_instance

    problem = random_instance(60, 3, clusters=5).problem
    wide = solve(problem, module.BranchAndBound(kicks=0))
    monkeypatch.setattr(module, "_FRAMES", 1)
    narrow = solve(problem, module.BranchAndBound(kicks=0))
    assert (narrow.cost, narrow.bound, narrow.iterations) == (
        wide.cost,
        wide.bound,
        wide.iterations,
    )
    np.testing.assert_array_equal(narrow.solution, wide.solution)


def test_too_many_edges_end_the_proof_with_tour_and_bound(monkeypatch):
    import solvers.tour.branch_and_bound as module
    from solvers.tour.instances import random_instance

    monkeypatch.setattr(module, "_MOST_EDGES", 10)
    problem = random_instance(60, 3, clusters=5).problem
    result = solve(problem, module.BranchAndBound(kicks=0))
    assert result.status is Status.FEASIBLE
    assert 0.9 * result.cost < result.bound < result.cost
