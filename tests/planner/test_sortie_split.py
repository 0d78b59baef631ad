"""Sorties never break a limit, and no other cut of the order, or of any order, is better."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from planner.sorties.choose import choose_sorties
from planner.sorties.problem import ENDS, SortieProblem
from planner.sorties.routing import route_sorties
from planner.sorties.split import split_order


def random_problem(seed, count=None, stations=None):
    """Photos on a plane, one metre a second, with what a sortie may take."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 26)) if count is None else count
    stations = int(rng.integers(1, 4)) if stations is None else stations
    spots, homes = rng.uniform(0, 100, (count, 2)), rng.uniform(0, 100, (stations, 2))
    legs = np.linalg.norm(spots[:, None] - spots[None], axis=2) + rng.uniform(0, 5)
    np.fill_diagonal(legs, 0.0)
    out = np.linalg.norm(homes[:, None] - spots[None], axis=2) + rng.uniform(0, 5)
    points = np.where(rng.random((count, count)) < 0.1, 4, 1)
    alone = (out + out).min(axis=0).max()
    most = int(rng.integers(ENDS, ENDS + 12)) if rng.random() < 0.7 else None
    endurance = alone * rng.uniform(1.0, 3.0)
    ways = [np.where(rng.random(out.shape) < 0.1, 3, 1) for _ in range(2)]
    most = most and max(most, 2 + int((ways[0] + ways[1]).max()))
    return SortieProblem(legs, out, out, points, *ways, endurance, most, rng.uniform(0, 60))


def cuts(order):
    """Every way to cut an order."""
    for marks in itertools.product([False, True], repeat=len(order) - 1):
        edges = [0, *(k + 1 for k, mark in enumerate(marks) if mark), len(order)]
        yield [np.array(order[a:b]) for a, b in itertools.pairwise(edges)]


def brute_force(problem, orders):
    best = np.inf
    for order in orders:
        for cut in cuts(order):
            total = 0.0
            for photos in cut:
                allowed = [
                    problem.seconds(home, photos) + problem.turnaround
                    for home in range(len(problem.out))
                    if problem.allows(home, photos)
                ]
                total += min(allowed, default=np.inf)
            best = min(best, total)
    return best


def assert_sound(problem, split):
    assert sorted(split.order.tolist()) == list(range(problem.size))
    total = 0.0
    for home, photos in zip(split.stations, split.sorties, strict=True):
        assert problem.allows(home, photos)
        total += problem.seconds(home, photos) + problem.turnaround
    assert split.cost == pytest.approx(total)


@pytest.mark.parametrize("seed", range(40))
def test_the_split_of_an_order_is_the_best_of_all(seed):
    problem = random_problem(seed, count=2 + seed % 8)
    order = np.random.default_rng(seed).permutation(problem.size)
    split = split_order(problem, order)
    best = brute_force(problem, [order.tolist()])
    if split is None:
        assert best == np.inf
    else:
        assert_sound(problem, split)
        np.testing.assert_array_equal(split.order, order)
        assert split.cost == pytest.approx(best)


@pytest.mark.parametrize("seed", range(6))
def test_small_cases_reach_the_best_of_all_orders(seed):
    problem = random_problem(seed, count=5)
    best = brute_force(problem, itertools.permutations(range(5)))
    found = choose_sorties(problem, np.arange(5))
    if best == np.inf:
        assert found is None
    else:
        assert best - 1e-9 <= found.cost <= 1.05 * best


def test_200_random_cases_keep_their_limits_and_both_methods_are_matched():
    counted = 0
    for seed in range(200):  # each has up to 25 photos and 3 stations
        problem = random_problem(seed)
        order = np.random.default_rng(seed).permutation(problem.size)
        given = split_order(problem, order)
        routed = route_sorties(problem, given, solutions=10)
        found = choose_sorties(problem, order, solutions=10)
        assert given is not None  # each photo alone is within reach
        for split in (given, routed, found):
            if split is not None:
                assert_sound(problem, split)
        costs = [split.cost for split in (given, routed) if split is not None]
        assert found.cost <= min(costs) + 1e-9
        counted += routed is not None and routed.cost < given.cost - 1e-6
    assert counted > 100  # a random order is hardly ever the best


def test_other_orders_are_searched_without_a_cut_to_begin_with():
    problem = random_problem(3, count=9)
    alone = route_sorties(problem)
    assert_sound(problem, alone)
    assert alone.method == "routing"


def test_the_same_numbers_give_the_same_sorties():
    problem = random_problem(11, count=20)
    first, second = (choose_sorties(problem, np.arange(20)) for _ in range(2))
    np.testing.assert_array_equal(first.order, second.order)
    assert first.stations == second.stations


def test_true_seconds_of_flown_sorties_count_instead_of_the_sums():
    legs = np.full((4, 4), 10.0)
    out = np.full((1, 4), 10.0)
    problem = SortieProblem(legs, out, out, np.ones((4, 4)), np.ones((1, 4)), np.ones((1, 4)), 50.0)
    whole = split_order(problem, np.arange(4))
    assert [len(photos) for photos in whole.sorties] == [4]  # 50 s, just enough
    known = {(0, (0, 1, 2, 3)): np.inf}
    two = split_order(problem, np.arange(4), known)
    assert len(two.sorties) == 2
    key = (0, tuple(two.sorties[0].tolist()))
    slower = split_order(problem, np.arange(4), {**known, key: 45.0})
    assert slower.cost == pytest.approx(60.0)
    assert (0, tuple(slower.sorties[0].tolist())) != key
    elsewhere = {(0, (3, 1)): np.inf, (0, (0, 2)): 0.0}  # no stretches of this order
    assert split_order(problem, np.arange(4), elsewhere).cost == whole.cost


def test_what_cannot_be_is_told():
    problem = random_problem(0, count=6)
    assert choose_sorties(replace(problem, endurance=1.0), np.arange(6)) is None
    assert choose_sorties(replace(problem, most=2), np.arange(6)) is None
    with pytest.raises(ValueError, match="endurance"):
        replace(problem, endurance=0.0)
    with pytest.raises(ValueError, match="waypoint"):
        replace(problem, points=np.zeros((6, 6)))
    with pytest.raises(ValueError, match="legs"):
        replace(problem, legs=-problem.legs)
