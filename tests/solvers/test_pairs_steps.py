"""Each compiled step of a search for pairs does what plain code over all candidates does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from solvers.pairs import PairCoverProblem, chord_table
from solvers.pairs.bounds import lower_bound
from solvers.pairs.state import empty_state

SEEDS = st.integers(0, 2**32 - 1)


def case(seed, candidates=300, elements=20, share=0.5, cheapest=0):
    """A problem with unlike prices and conflicts, the state of a random choice, and the dice."""
    rng = np.random.default_rng(seed)
    hits = csr_array((rng.random((candidates, elements)) < 0.3).astype(np.int32))
    rays = rng.normal(size=(hits.nnz, 3)) * [0.35, 0.35, 0.0] + [0.0, 0.0, 1.0]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    problem = PairCoverProblem(
        hits,
        rays,
        rng.uniform(-0.1, 0.9, hits.nnz),
        rays[:, 2],
        weights=chord_table(lambda angle: np.exp(-((angle - 0.3) ** 2) / 0.05)),
        target=rng.uniform(0.5, 4.0, elements),
        fine=rng.random(hits.nnz) < 0.5,
        fine_demand=rng.integers(0, 3, elements),
        prices=rng.integers(cheapest, 4, candidates) / 2.0,
        conflicts=[rng.choice(candidates, 3, replace=False) for _ in range(10)],
    )
    return problem, chosen_state(problem, rng, share), rng


def chosen_state(problem, rng, share):
    from solvers.pairs import state_kernels

    state = empty_state(problem)
    for candidate in np.flatnonzero(rng.random(problem.candidates) < share):
        if not state.blocked[candidate]:
            state_kernels.flip(state, candidate)
    return state


def plain_key(amount, price):
    return amount / price if price > 0.0 else np.inf


@given(SEEDS, st.sampled_from([0.0, 0.02, 0.1]))
@settings(deadline=None, max_examples=30)
def test_the_best_addition_is_that_of_a_search_through_all(seed, share):
    from solvers.pairs import search_kernels

    problem, state, rng = case(seed, share=share)
    limit, banned = state.totals[1] + rng.integers(0, 3), int(rng.integers(300))
    best, best_key = -1, 0.0
    for c in range(problem.candidates):
        allowed = not (state.taken[c] or state.blocked[c] or c == banned)
        if allowed and problem.prices[c] <= limit - state.totals[1] and state.gain[c] > 0.0:
            key = plain_key(state.gain[c], problem.prices[c])
            if key > best_key:
                best, best_key = c, key
    assert search_kernels.best_addition(state, limit, banned) == best


@given(SEEDS)
@settings(deadline=None, max_examples=20)
def test_pruning_drops_what_costs_fewest_elements_then_least_worth(seed):
    from solvers.pairs import search_kernels, state_kernels

    problem, state, _ = case(seed, candidates=60)
    wanted = int(0.8 * state.totals[0])
    plain = empty_state(problem)
    state_kernels.adopt(plain, np.flatnonzero(state.taken), np.inf)
    while True:
        rows = [c for c in np.flatnonzero(plain.taken) if problem.prices[c] > 0.0]
        losses = [state_kernels.loss_of(plain, c) for c in rows]
        keys = [(n, loss / problem.prices[c]) for c, (n, loss) in zip(rows, losses, strict=True)]
        best = min(range(len(rows)), key=keys.__getitem__, default=-1)
        if best < 0 or plain.totals[0] - keys[best][0] < wanted:
            break
        state_kernels.flip(plain, rows[best])
    search_kernels.prune(state, wanted)
    np.testing.assert_array_equal(state.taken, plain.taken)


@given(SEEDS, st.integers(1, 12))
@settings(deadline=None, max_examples=20)
def test_neighbours_share_most_elements(seed, count):
    from solvers.pairs import search_kernels

    problem, state, rng = case(seed, candidates=80, share=0.2)
    rows = np.flatnonzero(state.taken)
    centre = int(rng.choice(rows))
    dense = csr_array(
        (np.ones(len(problem.indices), dtype=np.int64), problem.indices, problem.indptr),
        shape=(problem.candidates, problem.elements),
    ).toarray()
    shared = dense[rows] @ dense[centre]
    others = rows[np.lexsort((rows, -shared))]
    others = others[(others != centre) & (dense[others] @ dense[centre] > 0)]
    got = search_kernels.neighbours(state, centre, count)
    np.testing.assert_array_equal(got, [centre, *others[: count - 1]])


@given(SEEDS)
@settings(deadline=None, max_examples=20)
def test_losses_are_known_after_any_changes(seed):
    """What is remembered of elements follows every change."""
    from solvers.pairs import search_kernels, state_kernels

    _, state, rng = case(seed, candidates=60, elements=30, share=0.3)
    for candidate in rng.integers(0, 60, 40):
        search_kernels.least_loss(state)
        state_kernels.flip(state, candidate)
        assert state.gain[candidate] == -np.inf or not state.taken[candidate]
    for candidate in np.flatnonzero(state.taken):
        before = state.totals.copy()
        lost, loss = state_kernels.loss_of(state, candidate)
        state_kernels.flip(state, candidate)
        assert lost == before[0] - state.totals[0]
        assert loss == before[2] - state.totals[2]
        state_kernels.flip(state, candidate)


@pytest.mark.parametrize("seed", range(3))
def test_hits_are_ordered_element_by_element(seed):
    problem, _, _ = case(seed)
    starts, at, owner = problem.by_element
    np.testing.assert_array_equal(at, np.argsort(problem.indices, kind="stable"))
    np.testing.assert_array_equal(np.diff(starts), np.bincount(problem.indices, minlength=20))
    of = np.repeat(np.arange(problem.candidates), np.diff(problem.indptr))
    np.testing.assert_array_equal(owner, of[at])
    np.testing.assert_array_equal(problem.sight[:3].T, problem.rays[at])
    np.testing.assert_array_equal(problem.sight[3], problem.nearness[at])
    np.testing.assert_array_equal(problem.sight[4], problem.facing[at])


@pytest.mark.parametrize("seed", range(3))
def test_an_element_is_in_reach_where_all_its_hits_together_reach_the_target(seed):
    problem, _, _ = case(seed, candidates=14)
    everything = np.arange(problem.candidates)
    np.testing.assert_array_equal(problem.reachable, problem.values(everything) >= problem.target)
    assert problem.reachable.sum() > 0


@given(SEEDS)
@settings(deadline=None, max_examples=20)
def test_relaxed_rows_are_those_of_dense_sums(seed):
    from solvers.pairs import bound_kernels

    problem, _, rng = case(seed, candidates=40)
    hits, worth = len(problem.indices), rng.random((20, 3)) * 0.1
    sums, slope = rng.random(hits), np.empty((20, 3))
    fine = problem.fine.astype(float)
    of = np.repeat(np.arange(problem.candidates), np.diff(problem.indptr))
    parts = np.column_stack([np.ones(hits), sums, fine])
    earned = (parts * worth[problem.indices]).sum(axis=1)
    reduced = problem.prices - np.bincount(of, earned, minlength=problem.candidates)
    args = (problem.indptr, problem.indices, sums, problem.fine, problem.prices, worth, slope)
    assert bound_kernels.relaxed(*args) == pytest.approx(reduced.clip(max=0.0).sum())
    paying = (reduced < 0.0)[of]
    for row in range(3):
        expected = np.bincount(problem.indices, parts[:, row] * paying, minlength=20)
        np.testing.assert_allclose(-slope[:, row], expected, atol=1e-9)


def test_more_steps_never_give_a_lower_bound(monkeypatch):
    monkeypatch.setattr("solvers.pairs.bounds._SMALL", 0)
    problem = case(0, cheapest=1)[0]
    bounds = [lower_bound(problem, steps=steps) for steps in (1, 10, 60, 200)]
    assert bounds == sorted(bounds)
    assert bounds[-1] > bounds[0] > 0.0
