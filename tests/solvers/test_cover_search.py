"""Bounds on covers, the state of the local search against brute force, and the heuristics."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.sparse import csr_array

from solvers import Status, Stop, solve
from solvers.cover import CoverProblem
from solvers.cover import state_kernels as kernels
from solvers.cover.bounds import lagrangian_bound, lp_bound, price_unit, quick_bound
from solvers.cover.instances import disc_instance, read_orlib
from solvers.cover.local_search import Search, polish
from solvers.cover.rows import rivals_of, rows_of


def random_problem(seed, sets=14, elements=12, *, conflicts=False, sectors=True):
    rng = np.random.default_rng(seed)
    hits = csr_array((rng.random((sets, elements)) < 0.4).astype(int))
    wide = {"sectors": rng.integers(0, 4, hits.nnz), "sector_demand": rng.integers(0, 4, elements)}
    groups = [rng.choice(sets, 3, replace=False) for _ in range(2)] if conflicts else []
    demand = rng.integers(0, 4, elements)
    prices = np.round(5 * rng.random(sets), 1)
    return CoverProblem(hits, prices, demand, conflicts=groups, **(wide if sectors else {}))


@given(st.integers(0, 10**6), st.booleans(), st.booleans())
@settings(max_examples=25, deadline=None)
def test_no_bound_is_above_the_optimum(seed, conflicts, sectors):
    problem = random_problem(seed, conflicts=conflicts, sectors=sectors)
    exact = solve(problem, "cvxpy")
    for bound in (quick_bound(problem), lagrangian_bound(problem), lp_bound(problem)):
        assert bound <= exact.cost * (1 + 1e-9) + 1e-12


@pytest.mark.parametrize("seed", range(6))
def test_the_linear_bound_is_that_of_another_solver_and_the_multipliers_come_close(seed):
    problem = random_problem(seed, 60, 80, sectors=False)
    relaxed = linprog(
        problem.prices, -problem.covers.T.toarray(), -problem.demand, bounds=(0, 1)
    ).fun
    assert lp_bound(problem) == pytest.approx(relaxed, rel=1e-6)
    assert lagrangian_bound(problem) >= 0.98 * relaxed


@pytest.mark.parametrize(
    ("prices", "unit"),
    [([2, 4, 6], 2.0), ([0.5, 1.25], 0.25), ([0.1, 0.2], 0.1), ([np.pi, 1], None), ([0, 0], None)],
)
def test_the_unit_of_prices(prices, unit):
    assert price_unit(np.array(prices, dtype=float)) == (unit and pytest.approx(unit))


def worked_out(rows, state):
    """Scores of all sets from the definition."""
    plain = rows.group_starts[0]
    hits = np.zeros(len(rows.wanted), dtype=int)
    for j in np.flatnonzero(state.chosen):
        hits[rows.rows[rows.starts[j] : rows.starts[j + 1]]] += 1
    distinct = [
        np.count_nonzero(hits[a:b])
        for a, b in zip(rows.group_starts[:-1], rows.group_starts[1:], strict=True)
    ]
    scores = np.zeros(len(rows.prices), dtype=int)
    for j, chosen in enumerate(state.chosen):
        for r in rows.rows[rows.starts[j] : rows.starts[j + 1]]:
            if r < plain:
                counts = hits[r] <= rows.wanted[r] if chosen else hits[r] < rows.wanted[r]
                scores[j] += state.weight[r] * counts
                continue
            g = np.searchsorted(rows.group_starts, r, side="right") - 1
            if chosen:
                counts = hits[r] == 1 and distinct[g] <= rows.group_wanted[g]
            else:
                counts = hits[r] == 0 and distinct[g] < rows.group_wanted[g]
            scores[j] += state.weight[plain + g] * counts
    return scores, hits, np.array(distinct, dtype=int)


@pytest.mark.parametrize("seed", range(5))
def test_scores_stay_those_of_the_definition_over_thousands_of_changes(seed):
    problem = random_problem(seed, 25, 20)
    rows, rng = rows_of(problem), np.random.default_rng(seed)
    search = Search(rows, rivals_of(problem))
    search.begin(np.empty(0, dtype=np.int64))
    state, columns = search._state, search._columns
    for step in range(1500):
        j = int(rng.integers(problem.sets))
        if rng.random() < 0.2 and len(state.weight):
            kernels.weigh(rows, columns, state, int(rng.integers(len(state.weight))), 1)
        elif state.chosen[j]:
            kernels.drop(rows, columns, state, j)
        else:
            kernels.add(rows, columns, state, j)
        if step % 50 == 0:
            scores, hits, distinct = worked_out(rows, state)
            np.testing.assert_array_equal(state.score, scores)
            np.testing.assert_array_equal(state.hits, hits)
            np.testing.assert_array_equal(state.distinct, distinct)
            short = [*(hits < rows.wanted)[: rows.group_starts[0]], *(distinct < rows.group_wanted)]
            assert set(state.open[: state.size[1]]) == set(np.flatnonzero(short))
            assert set(state.picks[: state.size[0]]) == set(np.flatnonzero(state.chosen))


@given(st.integers(0, 10**6), st.booleans())
@settings(max_examples=20, deadline=None)
def test_polish_gives_a_cover_that_is_never_dearer(seed, from_greedy):
    problem = random_problem(seed, 30, 25)
    greedy = solve(problem, "greedy")
    start = greedy.solution if from_greedy else np.empty(0, dtype=np.int64)
    better = polish(problem, start, steps=500, rng=np.random.default_rng(seed))
    limit = greedy.cost if from_greedy else np.inf
    assert problem.cost(better) <= limit
    assert problem.cost(better) >= solve(problem, "cvxpy").cost - 1e-9


@given(st.integers(0, 10**6), st.booleans())
@settings(max_examples=15, deadline=None)
def test_small_covers_are_solved_to_the_optimum(seed, conflicts):
    problem = random_problem(seed, conflicts=conflicts)
    exact = solve(problem, "cp-sat")
    for solver in ("lagrangian", "local-search"):
        result = solve(problem, solver, seed=seed, stop=Stop(iterations=60))
        if exact.status is Status.INFEASIBLE:
            assert result.solution is None
        else:
            assert result.cost == pytest.approx(exact.cost, rel=1e-9)


def test_searches_beat_the_greedy_on_discs_and_do_not_pass_the_bound():
    problem = disc_instance(800, 1000, 0).problem
    greedy = solve(problem, "greedy")
    for solver in ("lagrangian", "local-search"):
        result = solve(problem, solver, stop=Stop(iterations=100))
        assert result.bound <= result.cost <= 0.93 * greedy.cost


@pytest.mark.slow
def test_published_optima_of_single_and_double_covers(shared_data):
    folder = shared_data / "optimisation" / "scp"
    listed = json.loads((folder / "best_known.json").read_text())["instances"]
    for name in ("scp41", "scp51", "scp61", "scpa1", "scpd1", "scpnre1"):
        problem = read_orlib(folder / f"{name}.txt").problem
        result = solve(problem, "lagrangian", stop=Stop(iterations=1000))
        assert listed[name]["best_known"] <= result.cost <= 1.02 * listed[name]["best_known"]
        assert 0.98 * lp_bound(problem) <= result.bound <= listed[name]["best_known"]
    for name in ("scp41", "scp61", "scpa1"):
        double = read_orlib(folder / f"{name}.txt", demand=2).problem
        optimum = listed[name]["multicover_b2_value"]
        exact = solve(double, "cvxpy")
        assert (exact.status, exact.cost) == (Status.OPTIMAL, optimum)
        assert solve(double, "lagrangian").cost <= 1.005 * optimum
