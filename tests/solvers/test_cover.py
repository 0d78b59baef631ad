"""Covers small enough to work out by hand, and properties of all of them."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from solvers import InvalidProblem, InvalidSolution, Status, Stop, solve
from solvers.cover import CoverProblem
from solvers.cover.cp_sat import CpSat
from solvers.cover.cvxpy_ilp import CvxpyILP
from solvers.cover.lagrangian import Lagrangian
from solvers.cover.local_search import LocalSearch

TRAP = np.array([[1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1], [0, 1, 1, 1, 1, 0]])


def directed(hits, **wanted):
    """Cover problem from a matrix of sectors, -1 where a set does not hit."""
    hits = np.asarray(hits)
    matrix = csr_array((hits >= 0).astype(int))
    return CoverProblem(matrix, sectors=hits[hits >= 0], **wanted)


def random_problem(seed, sets=12, elements=10):
    rng = np.random.default_rng(seed)
    hits = csr_array((rng.random((sets, elements)) < 0.4).astype(int))
    return CoverProblem(
        hits,
        rng.integers(0, 5, sets),
        rng.integers(0, 4, elements),
        sectors=rng.integers(0, 4, hits.nnz),
        sector_demand=rng.integers(0, 4, elements),
    )


def test_greedy_falls_into_the_trap_and_pruning_gets_it_out():
    greedy, exact = (solve(CoverProblem(TRAP), name) for name in ("greedy", "cvxpy"))
    np.testing.assert_array_equal(greedy.solution, [0, 1])
    assert (exact.cost, exact.bound, exact.status) == (2.0, 2.0, Status.OPTIMAL)


def test_demand_beyond_supply_is_clipped_and_listed():
    problem = CoverProblem(TRAP, demand=[1, 2, 3, 3, 2, 0])
    np.testing.assert_array_equal(problem.demand, [1, 2, 2, 2, 2, 0])
    np.testing.assert_array_equal(problem.shortfall, [0, 0, 1, 1, 0, 0])


def test_sectors_beyond_supply_are_clipped_and_listed():
    problem = directed([[0, 3], [0, 1], [2, -1]], demand=0, sector_demand=3)
    np.testing.assert_array_equal(problem.sector_demand, [2, 2])
    np.testing.assert_array_equal(problem.sector_shortfall, [1, 1])


@pytest.mark.parametrize("solver", ["greedy", "cvxpy"])
def test_two_sectors_cost_a_third_set_where_two_look_from_one_side(solver):
    hits = [[0, 0], [0, 0], [5, 5]]
    plain = solve(directed(hits, demand=2), solver)
    wide = solve(directed(hits, demand=2, sector_demand=2), solver)
    three = solve(directed(hits, demand=3, sector_demand=2), solver)
    assert (plain.cost, wide.cost, three.cost) == (2, 2, 3)
    assert 2 in wide.solution


@pytest.mark.parametrize("solver", ["greedy", "cvxpy"])
def test_of_conflicting_sets_only_one_is_chosen(solver):
    problem = CoverProblem(TRAP, [1, 1, 1.5], conflicts=[[0, 2]])
    np.testing.assert_array_equal(solve(problem, solver).solution, [0, 1])


@pytest.mark.parametrize("solver", ["greedy", "cvxpy", "cp-sat", "lagrangian", "local-search"])
def test_conflicts_that_leave_no_cover_are_proven(solver):
    problem = CoverProblem(np.eye(2), conflicts=[[0, 1]])
    result = solve(problem, solver, stop=Stop(iterations=20))
    assert (result.status, result.solution) == (Status.INFEASIBLE, None)


def mixed(seed, dearest, unit=1.0):
    """A problem and the same with one dear set that would do alone, and its true optimum."""
    rng = np.random.default_rng(seed)
    hits = rng.random((40, 30)) < 0.15
    hits[0] |= ~hits.any(axis=0)
    prices = rng.integers(1, 30, 40).astype(float)
    plain = solve(CoverProblem(hits, prices), "cp-sat").cost
    both = np.vstack([hits, np.ones((1, 30), dtype=bool)])
    return CoverProblem(both, unit * np.append(prices, dearest)), unit * plain


@pytest.mark.parametrize("solver", ["cvxpy", "cp-sat", "greedy", "lagrangian", "local-search"])
@pytest.mark.parametrize(("dearest", "unit"), [(1e8, 1), (1e12, 1), (1e11, 1e-11), (1e6, 1e-3)])
def test_one_dear_set_among_cheap_ones_changes_neither_bound_nor_optimum(solver, dearest, unit):
    problem, optimum = mixed(1, dearest, unit)
    result = solve(problem, solver, stop=Stop(iterations=2000))
    assert result.bound <= optimum * (1 + 1e-9)
    assert result.cost >= optimum * (1 - 1e-9)
    if solver in {"cvxpy", "cp-sat"} or result.status is Status.OPTIMAL:
        assert result.cost == pytest.approx(optimum, rel=1e-9)


def test_a_wide_gap_is_not_called_optimal():
    problem, optimum = mixed(2, 1e3)
    result = solve(problem, CvxpyILP(gap=0.9))
    assert result.bound <= optimum <= result.cost
    assert result.status is (Status.OPTIMAL if result.bound == result.cost else Status.FEASIBLE)


def test_limits_reach_other_back_ends_or_are_refused():
    problem, optimum = mixed(3, 1e3)
    result = solve(problem, CvxpyILP(backend="scipy"), stop=Stop(seconds=30))
    assert (result.cost, result.status) == (optimum, Status.OPTIMAL)
    with pytest.raises(InvalidProblem, match="iterations"):
        solve(problem, CvxpyILP(backend="SCIPY"), stop=Stop(iterations=3))


@pytest.mark.parametrize(
    ("solver", "fault"),
    [
        (CpSat, {"workers": 0}),
        (CvxpyILP, {"gap": np.nan}),
        (CvxpyILP, {"gap": -1.0}),
        (Lagrangian, {"patience": 0}),
        (Lagrangian, {"noise": 7.0}),
        (Lagrangian, {"ascent": 2.5}),
        (LocalSearch, {"patience": 0}),
        (LocalSearch, {"steps": "many"}),
    ],
)
def test_parameters_out_of_range_are_named(solver, fault):
    with pytest.raises(ValueError, match=next(iter(fault))):
        solver(**fault)


@pytest.mark.parametrize("solver", ["cp-sat", "cvxpy"])
def test_ctrl_c_is_heard_in_the_midst_of_foreign_code(solver):
    code = f"""
import numpy as np
from solvers import Stop, solve
from solvers.cover.instances import disc_instance
problem = disc_instance(1500, 2000, 0).problem
print("begun", flush=True)
result = solve(problem, "{solver}", stop=Stop(seconds=100))
print(result.stop_reason, result.solution is not None, result.seconds < 60)
"""
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "begun\n"
        time.sleep(8)
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=80)[0] == "interrupted True True\n"
        assert process.returncode == 0


def test_the_order_of_columns_does_not_mix_up_sectors():
    hits = csr_array(([1, 1, 1], [2, 0, 1], [0, 2, 3]), shape=(2, 3))
    problem = CoverProblem(hits, demand=0, sectors=[7, 5, 6], sector_demand=1)
    np.testing.assert_array_equal(problem.indices, [0, 2, 1])
    np.testing.assert_array_equal(problem.sectors, [5, 7, 6])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"prices": [1, 2]}, "prices"),
        ({"prices": [1, 2, -1]}, "prices"),
        ({"prices": [1, 2, np.nan]}, "prices"),
        ({"demand": -1}, "demand"),
        ({"demand": 0.5}, "whole"),
        ({"sector_demand": 1}, "sectors"),
        ({"sectors": [0, 1]}, "sparse"),
        ({"conflicts": [[0, 3]]}, "conflicts"),
        ({"covers": np.ones(3)}, "covers"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(InvalidProblem, match=message):
        CoverProblem(**{"covers": TRAP, **change})


@pytest.mark.parametrize("wrong", [[0], [0, 0, 1], [0, 1, 3], [-1, 0, 1], [0.5, 1.5], [[0, 1]]])
def test_what_is_no_cover_is_refused(wrong):
    with pytest.raises(InvalidSolution):
        CoverProblem(TRAP).cost(wrong)


@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_greedy_covers_everything_and_keeps_nothing_redundant(seed):
    problem = random_problem(seed)
    chosen = solve(problem, "greedy").solution
    assert (problem.coverage(chosen) >= problem.demand).all()
    assert (problem.sector_coverage(chosen) >= problem.sector_demand).all()
    for one in chosen:
        with pytest.raises(InvalidSolution):
            problem.cost(chosen[chosen != one])


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_the_optimum_lies_between_bound_and_greedy(seed):
    problem = random_problem(seed)
    exact = solve(problem, "cvxpy")
    assert exact.status is Status.OPTIMAL
    assert exact.bound <= exact.cost <= solve(problem, "greedy").cost


def test_lazy_greedy_is_plain_greedy():
    problem = random_problem(3, sets=60, elements=80)
    need, wide = problem.demand.copy(), problem.sector_demand.copy()
    seen, chosen = set(), []
    while need.sum() + wide.sum():

        def gain(j, need=need, wide=wide):
            at = range(problem.indptr[j], problem.indptr[j + 1])
            pairs = [(problem.indices[k], problem.sectors[k]) for k in at]
            return sum(
                (need[e] > 0) + (wide[e] > 0 and (e, s) not in seen) for e, s in pairs
            ), pairs

        free = [j for j in range(problem.sets) if j not in chosen]
        with np.errstate(divide="ignore"):
            worth = [np.divide(gain(j)[0], problem.prices[j]) if gain(j)[0] else -1 for j in free]
        best = free[int(np.argmax(worth))]
        for e, s in gain(best)[1]:
            need[e] -= need[e] > 0
            wide[e] -= wide[e] > 0 and (e, s) not in seen
            seen.add((e, s))
        chosen.append(best)
    from solvers.cover.greedy import select

    np.testing.assert_array_equal(select(problem, pruned=False), np.sort(chosen))


def test_a_limit_keeps_the_greedy_cover_and_the_bound():
    rng = np.random.default_rng(0)
    hits = csr_array((rng.random((150, 100)) < 0.06).astype(int))
    problem = CoverProblem(hits, 1 + 0.2 * rng.random(150), 2)
    result = solve(problem, "cvxpy", stop=Stop(iterations=1))
    assert result.solution is not None
    assert 0 < result.bound <= result.cost <= solve(problem, "greedy").cost
