"""Sums over pairs kept up to date, searches on them, and what no choice can be cheaper than."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from solvers import InvalidSolution, Status, Stop, solve
from solvers.pairs import PairCoverProblem, chord_table
from solvers.pairs.bounds import lower_bound
from solvers.pairs.greedy import Greedy
from solvers.pairs.lns import LargeNeighbourhood
from solvers.pairs.state import empty_state


def parallax(angle):
    """Worth of an angle to stereo: nothing below 5 degrees, best at 20, little above 60."""
    near = 1.0 / (1.0 + np.exp(-32.0 * (angle - np.pi / 16.0)))
    return near * (1.0 - 1.0 / (1.0 + np.exp(-8.0 * (angle - np.pi / 4.0))))


WEIGHTS = chord_table(parallax)


def random_problem(seed, candidates=11, elements=8, density=0.6, **options):
    rng = np.random.default_rng(seed)
    hits = csr_array((rng.random((candidates, elements)) < density).astype(np.int32))
    rays = rng.normal(size=(hits.nnz, 3)) * [0.35, 0.35, 0.0] + [0.0, 0.0, 1.0]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    near, facing = rng.uniform(-0.1, 0.9, hits.nnz), rays[:, 2] * rng.uniform(0.7, 1.0, hits.nnz)
    given = {"weights": WEIGHTS, "target": 1.0, "fine": near > 0.3, "fine_demand": 1}
    return PairCoverProblem(hits, rays, near, facing, **{**given, **options})


def cheapest(problem):
    best = np.inf
    for size in range(problem.candidates + 1):
        for choice in itertools.combinations(range(problem.candidates), size):
            try:
                best = min(best, problem.cost(np.array(choice, dtype=np.int64)))
            except InvalidSolution:
                continue
    return best


def test_table_holds_the_weights_at_seven_angles():
    angles = np.radians([5, 10, 15, 20, 30, 45, 60])
    expected = [0.0295, 0.330, 0.877, 0.963, 0.890, 0.500, 0.110]
    chords = 2.0 * np.sin(angles / 2.0)
    at = np.interp(chords, np.linspace(0.0, 2.0, len(WEIGHTS)), WEIGHTS)
    np.testing.assert_allclose(at, expected, atol=6e-4)
    np.testing.assert_allclose(at, parallax(angles), atol=1e-5)


@given(st.floats(0.0, np.pi), st.floats(0.0, 2.0 * np.pi), st.floats(0.0, 1.0))
@settings(deadline=None)
def test_table_is_within_a_ten_thousandth_of_the_formula(angle, around, height):
    level = np.sqrt(1.0 - height**2)
    first = np.array([level * np.cos(around), level * np.sin(around), height])
    side = np.cross(first, [1.0, 0.3, 0.2])
    second = np.cos(angle) * first + np.sin(angle) * side / np.linalg.norm(side)
    pair = PairCoverProblem(
        csr_array(np.ones((2, 1))), [first, second], weights=WEIGHTS, target=1.0
    )
    assert pair.values(np.arange(2))[0] == pytest.approx(parallax(angle), abs=1e-4)


def formula(problem, chosen):
    """Values without table, rounding or any of the code under test."""
    total = np.zeros(problem.elements)
    owner = np.repeat(np.arange(problem.candidates), np.diff(problem.indptr))
    rays = problem.rays.astype(np.float64)
    for i, j in itertools.combinations(np.flatnonzero(np.isin(owner, chosen)), 2):
        if problem.indices[i] == problem.indices[j]:
            angle = np.arccos(np.clip(rays[i] @ rays[j], -1.0, 1.0))
            near = max(0.0, min(problem.nearness[i], problem.nearness[j]))
            facing = max(0.0, min(problem.facing[i], problem.facing[j]))
            total[problem.indices[i]] += parallax(angle) * near * facing
    return total


@pytest.mark.parametrize("seed", range(3))
def test_values_are_those_of_the_formula(seed):
    problem = random_problem(seed)
    chosen = np.flatnonzero(np.random.default_rng(seed).random(problem.candidates) < 0.7)
    np.testing.assert_allclose(problem.values(chosen), formula(problem, chosen), atol=1e-4)


def fresh(problem, chosen):
    from solvers.pairs import state_kernels

    state = empty_state(problem)
    for candidate in chosen:
        state_kernels.flip(state, candidate)
    return state


def test_after_ten_thousand_changes_every_sum_is_that_of_brute_force():
    from solvers.pairs import state_kernels

    problem = random_problem(
        0, 40, 25, 0.4, prices=np.arange(40) % 3 / 2.0, target=1.003 + np.arange(25) % 3
    )
    state = empty_state(problem)
    for candidate in np.random.default_rng(1).integers(0, 40, 10_000):
        state_kernels.flip(state, candidate)
    chosen = np.flatnonzero(state.taken)
    assert 5 < len(chosen) < 35
    np.testing.assert_allclose(state.value, problem.values(chosen), atol=1e-9, rtol=0)
    np.testing.assert_array_equal(state.fine_hits, problem.fine_hits(chosen))
    assert state.totals[0] == problem.satisfied(chosen).sum()
    assert state.totals[1] == problem.prices[chosen].sum()
    again = fresh(problem, chosen)
    free = ~state.taken
    np.testing.assert_array_equal(state.gain[free], again.gain[free])
    state_kernels.settle(state)
    state_kernels.settle(again)
    for name in SUMS:
        np.testing.assert_array_equal(getattr(state, name), getattr(again, name))


SUMS = ("value", "hits", "fine_hits", "taken", "blocked", "totals", "partial")


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=40)
def test_a_choice_adopted_is_one_made_step_by_step(seed):
    from solvers.pairs import state_kernels

    rng = np.random.default_rng(seed)
    groups = [rng.choice(30, 3, replace=False) for _ in range(4)]
    problem = random_problem(seed, 30, 20, 0.5, prices=rng.integers(0, 4, 30), conflicts=groups)
    chosen = np.flatnonzero(rng.random(30) < 0.8)
    plain, adopted = empty_state(problem), empty_state(problem)
    for candidate in chosen:
        fits = plain.totals[1] + problem.prices[candidate] <= 20.0
        if fits and not plain.blocked[candidate]:
            state_kernels.flip(plain, candidate)
    state_kernels.adopt(adopted, chosen, 20.0)
    for candidate in rng.integers(0, 30, 8):
        for state in (plain, adopted):
            state_kernels.flip(state, candidate)
    np.testing.assert_array_equal(adopted.gain[~plain.taken], plain.gain[~plain.taken])
    for state in (plain, adopted):
        state_kernels.settle(state)
    for name in SUMS:
        np.testing.assert_array_equal(getattr(adopted, name), getattr(plain, name))


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(deadline=None, max_examples=40)
def test_the_least_loss_is_that_of_a_search_through_all(seed, priced):
    from solvers.pairs import search_kernels, state_kernels

    rng = np.random.default_rng(seed)
    prices = rng.integers(0, 4, 30) if priced else 1.0
    problem = random_problem(seed, 30, 20, 0.5, prices=prices)
    state = fresh(problem, np.flatnonzero(rng.random(30) < 0.7))
    while state.taken.any():
        rows = np.flatnonzero(state.taken)
        losses = [state_kernels.loss_of(state, c) for c in rows]
        with np.errstate(divide="ignore", invalid="ignore"):
            worth = np.array([loss for _, loss in losses]) / problem.prices[rows]
        keys = np.where(problem.prices[rows] > 0.0, worth, np.inf)
        best = int(np.argmin(keys))
        assert search_kernels.least_loss(state) == (rows[best], losses[best][0])
        state_kernels.flip(state, rows[best])


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=40)
def test_gains_and_losses_are_what_changes_bring(seed):
    from solvers.pairs import state_kernels

    rng = np.random.default_rng(seed)
    problem = random_problem(seed, 12, 10, 0.6)
    state = fresh(problem, np.flatnonzero(rng.random(12) < 0.5))
    candidate = int(rng.integers(12))
    before, taken = state.totals.copy(), state.taken[candidate]
    promised = state_kernels.loss_of(state, candidate) if taken else state.gain[candidate]
    state_kernels.flip(state, candidate)
    if taken:
        assert promised[0] == before[0] - state.totals[0]
        assert promised[1] == pytest.approx(before[2] - state.totals[2], abs=1e-9)
    else:
        seen = problem.indices[problem.indptr[candidate] : problem.indptr[candidate + 1]]
        lone = (state.hits[seen] <= 2) & problem.reachable[seen]
        rise = state.totals[2] - before[2]
        assert promised >= rise - 1e-9
        if not lone.any():
            assert promised == pytest.approx(rise, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_bound_lies_between_six_tenths_and_all_of_the_optimum(seed):
    problem = random_problem(seed)
    best, bound = cheapest(problem), lower_bound(problem)
    assert 0.6 * best <= bound <= best
    assert solve(problem, "lns", stop=Stop(iterations=150)).cost == best


@pytest.mark.parametrize("seed", range(8))
def test_bound_holds_where_a_share_may_be_left_out(seed):
    problem = random_problem(seed, share=0.8)
    best, bound = cheapest(problem), lower_bound(problem)
    assert 0.6 * best <= bound <= best
    assert solve(problem, "lns", stop=Stop(iterations=150)).cost == best


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("small", [0, 3_000])
def test_bound_holds_where_each_element_has_a_target_of_its_own(seed, small, monkeypatch):
    monkeypatch.setattr("solvers.pairs.bounds._SMALL", small)
    targets = np.random.default_rng(seed).uniform(0.2, 1.6, 8)
    problem = random_problem(seed, share=0.8, target=targets)
    best, bound = cheapest(problem), lower_bound(problem)
    assert (0.6 if small else 0.3) * best <= bound <= best
    assert solve(problem, "lns", stop=Stop(iterations=150)).cost == best


@pytest.mark.parametrize("seed", [0, 1, 3, 4])
def test_bound_by_prices_holds_as_that_of_the_integer_programme_does(seed, monkeypatch):
    problem = random_problem(seed, share=0.8, conflicts=[[0, 1]])
    best, bound = cheapest(problem), lower_bound(problem)
    monkeypatch.setattr("solvers.pairs.bounds._SMALL", 0)
    assert 0.0 < lower_bound(problem) <= bound <= best < np.inf


def test_greedy_takes_its_start_and_never_ends_above_a_warm_start():
    problem = random_problem(3, 60, 40, 0.3, share=0.9)
    plain = solve(problem, "greedy")
    started = solve(problem, Greedy(start=(5, 7, 9)))
    assert plain.status is Status.FEASIBLE
    assert started.solution is not None
    warm = solve(problem, "greedy", initial=plain.solution)
    assert warm.cost <= plain.cost
    assert solve(problem, Greedy(pruned=False)).cost >= plain.cost


def test_no_chosen_candidate_of_greedy_can_go():
    problem = random_problem(4, 60, 40, 0.3, share=0.9)
    chosen = solve(problem, "greedy").solution
    for candidate in chosen:
        with pytest.raises(InvalidSolution):
            problem.cost(chosen[chosen != candidate])


def test_search_finds_a_planted_choice():
    """Three copies of six good views among sixty bad ones."""
    rng = np.random.default_rng(0)
    elements = 30
    tilt = np.radians([[0, 0], [18, 0], [18, 120], [18, 240]])
    rays = np.stack(
        [
            np.sin(tilt[:, 0]) * np.cos(tilt[:, 1]),
            np.sin(tilt[:, 0]) * np.sin(tilt[:, 1]),
            np.cos(tilt[:, 0]),
        ],
        axis=1,
    )
    good = np.repeat(np.arange(elements) // 10, 4).reshape(3, 10, 4)[:, 0]
    rows = [(np.arange(10) + 10 * block, rays[k]) for block in good[:, 0] for k in range(4)]
    rows += [(np.sort(rng.choice(elements, 8, replace=False)), rays[0]) for _ in range(60)]
    indptr = np.concatenate([[0], np.cumsum([len(seen) for seen, _ in rows])])
    hits = csr_array(
        (np.ones(indptr[-1]), np.concatenate([seen for seen, _ in rows]), indptr),
        shape=(len(rows), elements),
    )
    ray = np.concatenate([np.tile(r, (len(seen), 1)) for seen, r in rows])
    problem = PairCoverProblem(hits, ray, weights=WEIGHTS, target=4.0)
    result = solve(problem, "lns", seed=1, stop=Stop(iterations=300))
    assert result.cost <= 12


def test_search_goes_on_where_greedy_ends():
    problem = random_problem(8, 150, 100, 0.12, share=0.9, target=2.0)
    greedy = solve(problem, "greedy")
    found = solve(problem, "lns", stop=Stop(iterations=400))
    assert found.cost < greedy.cost
    assert found.bound <= found.cost
    assert found.trace[0].cost == greedy.cost


def test_a_budget_is_kept_and_used():
    problem = random_problem(8, 150, 100, 0.12, target=2.0, budget=25.0)
    greedy = solve(problem, "greedy")
    found = solve(problem, LargeNeighbourhood(most=3), stop=Stop(iterations=200))
    assert problem.prices[found.solution].sum() <= 25.0
    assert found.cost < greedy.cost


def test_fine_hits_that_cannot_be_had_are_not_asked_for():
    problem = random_problem(2, fine=False, fine_demand=2)
    np.testing.assert_array_equal(problem.fine_demand, 0)
    np.testing.assert_array_equal(problem.fine_shortfall, 2)
    asked = random_problem(2, fine=True, fine_demand=5)
    chosen = solve(asked, "greedy").solution
    assert (asked.fine_hits(chosen) >= asked.fine_demand)[asked.reachable].all()
    assert (asked.fine_demand + asked.fine_shortfall == 5).all()
