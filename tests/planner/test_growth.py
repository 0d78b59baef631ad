"""A number of photos is spent on photos that all match."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from planner.viewpoints.growth import _Crew
from solvers.pairs import PairCoverProblem, chord_table


def crew(seed, begun, candidates=40, elements=25):
    rng = np.random.default_rng(seed)
    hits = csr_array((rng.random((candidates, elements)) < 0.4).astype(np.int32))
    rays = rng.normal(size=(hits.nnz, 3)) * [0.35, 0.35, 0.0] + [0.0, 0.0, 1.0]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    weights = chord_table(lambda angle: np.sin(angle) ** 2)
    problem = PairCoverProblem(hits, rays, weights=weights, target=1.0, budget=20.0)
    linked = rng.random((candidates, candidates)) < 0.5
    linked |= linked.T
    np.fill_diagonal(linked, False)
    return problem, linked, _Crew(problem, linked, begun)


@given(st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_a_crew_grown_from_nothing_is_one_piece_and_its_worth_is_that_of_the_problem(seed):
    problem, linked, grown = crew(seed, 0)
    while len(grown.chosen) < 12 and grown.add():
        rows = np.array(grown.chosen)
        among = linked[np.ix_(rows, rows)]
        assert connected_components(among, directed=False)[0] == 1
        assert among.sum(axis=1).min() >= min(3, len(rows) - 1)
    before = grown.worth
    grown.exchange(10)
    assert grown.worth >= before
    assert len(grown.chosen) == len(set(grown.chosen)) <= 12
    assert grown.worth[0] == problem.satisfied(np.sort(grown.chosen)).sum()


@given(st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_what_is_dropped_leaves_the_rest_as_firm_as_before(seed):
    problem, linked, crowd = crew(seed, 20)

    def looseness():
        rows = np.array(crowd.chosen)
        among = linked[np.ix_(rows, rows)]
        lack = (min(3, len(rows) - 1) - among.sum(axis=1)).clip(0).sum()
        return connected_components(among, directed=False)[0], lack

    while len(crowd.chosen) > 5:
        before = looseness()
        if not crowd.drop():
            break
        after = looseness()
        assert after[0] <= before[0]
        assert after[1] <= before[1]
        assert crowd.worth[0] == problem.satisfied(np.sort(crowd.chosen)).sum()
