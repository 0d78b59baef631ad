"""Sums over pairs, worked out by hand on three candidates and two elements."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from solvers import InvalidProblem, InvalidSolution
from solvers.pairs import PairCoverProblem, chord_table

WEIGHTS = chord_table(lambda angle: np.sin(angle) ** 2, 4001)  # one at 90 degrees


def problem(**change):
    """Both elements see candidates 0, 1, 2 at right angles; element 1 lacks candidate 2."""
    hits = csr_array(np.array([[1, 1], [1, 1], [1, 0]]))
    x, y, z = np.eye(3)
    given = {"rays": [x, x, y, y, z], "weights": WEIGHTS, "target": 0.999}
    return PairCoverProblem(hits, **{**given, **change})


def test_value_is_the_sum_over_pairs():
    np.testing.assert_allclose(problem().values(np.arange(3)), [3.0, 1.0], atol=1e-5)
    np.testing.assert_allclose(problem().values(np.array([0, 1])), [1.0, 1.0], atol=1e-5)
    np.testing.assert_allclose(problem().values(np.array([0])), [0.0, 0.0])


def test_a_pair_is_as_near_and_as_facing_as_the_worse_of_the_two():
    values = problem(nearness=[0.5, 1, 1, 1, 1], facing=[1, 1, 0.25, 1, -1]).values(np.arange(3))
    np.testing.assert_allclose(values, [0.5 * 0.25, 1.0], atol=1e-5)


def test_cost_is_price_at_the_target_and_misses_under_a_budget():
    assert problem(prices=[1, 2, 4]).cost([0, 1]) == 3.0
    assert problem(budget=2.0).cost([0, 2]) == 1.0
    for wrong, options in (
        ([0], {}),
        ([0, 1, 2], {"budget": 2.0}),
        ([0, 1], {"conflicts": [[0, 1]]}),
    ):
        with pytest.raises(InvalidSolution):
            problem(**options).cost(wrong)


def test_elements_out_of_reach_are_not_asked_for():
    demanding = problem(target=2.0)
    np.testing.assert_array_equal(demanding.reachable, [True, False])
    assert demanding.cost([0, 1, 2]) == 3.0


def test_each_element_may_have_a_target_of_its_own():
    unlike = problem(target=[2.9, 0.9])
    assert unlike.cost([0, 1, 2]) == 3.0
    with pytest.raises(InvalidSolution):
        unlike.cost([0, 1])
    assert problem(target=[0.9, 0.9]).cost([0, 1]) == 2.0
    assert problem(target=[2.9, 1.1]).cost([0, 1, 2]) == 3.0  # the second is out of reach


def test_a_share_may_be_left_out():
    assert problem(share=0.5).cost([0, 2]) == 2.0


def test_bad_input_is_named():
    for change in (
        {"rays": 2 * np.ones((5, 3))},
        *({"target": wrong} for wrong in (0, -1, [1, 0], [1, 1, 1], [1, np.nan], "high")),
        {"share": 0},
        {"weights": [1]},
    ):
        with pytest.raises(InvalidProblem, match=next(iter(change))):
            problem(**change)
