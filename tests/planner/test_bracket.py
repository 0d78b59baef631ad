"""Few trials find the most that may be asked for."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.bracket import Trial, trials_within


def search(costs, limit, *, least=1, most_trials=6):
    """Trials where a number costs what the list says; the last is the whole."""
    asked = []

    def trial(number):
        asked.append(number)
        return Trial(number, costs[number], None)

    whole = Trial(len(costs) - 1, costs[-1], None)
    made = trials_within(whole, trial, limit, least=least, most_trials=most_trials)
    assert [found.asked for found in made] == asked
    return made


@given(st.integers(10, 400), st.floats(0.5, 9.0), st.floats(0.06, 0.99))
def test_costs_that_rise_evenly_take_two_trials(count, each, share):
    limit = share * each * count
    made = search([each * number for number in range(count + 1)], limit, most_trials=9)
    best = max((found.asked for found in made if found.cost <= limit), default=0)
    assert best == min(count - 1, math.floor(limit / each * (1 + 1e-12)))
    assert len(made) <= 2


@given(
    st.lists(st.floats(0.0, 10.0), min_size=3, max_size=200),
    st.floats(0.01, 0.99),
    st.integers(1, 3),
    st.integers(1, 8),
)
def test_whatever_rising_costs_the_answer_is_within_the_limit_or_the_least_is_not(
    steps, share, least, most_trials
):
    costs = [0.0]
    for step in steps:
        costs.append(costs[-1] + step)
    limit = share * costs[-1]
    if not costs[-1] > limit:
        return
    made = search(costs, limit, least=least, most_trials=most_trials)
    asked = [found.asked for found in made]
    assert len(set(asked)) == len(asked)
    assert all(least <= number < len(costs) - 1 for number in asked)
    assert len(made) <= most_trials + math.ceil(math.log2(len(costs)))
    good = [number for number in asked if costs[number] <= limit]
    if not good:  # then nothing was
        assert costs[least] > limit or len(costs) - 1 <= least
    elif len(made) < most_trials:  # then no larger number was, but for less than one photo's cost
        best = max(good)
        assert costs[best + 1] > limit or limit - costs[best] < costs[best] / best


def test_answers_that_cannot_be_made_are_beyond_the_limit():
    costs = [0.0, 1.0, 2.0, *[math.inf] * 20]
    assert max(found.asked for found in search(costs, 50.0) if found.cost <= 50.0) == 2


@pytest.mark.parametrize("whole", [1, 2])
def test_nothing_is_tried_where_nothing_is_less(whole):
    assert search([9.0] * (whole + 1), 5.0, least=whole) == []
