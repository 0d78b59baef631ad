"""How fast covers are bounded, chosen and improved, on discs in a square."""

import pytest

from solvers import Stop, solve
from solvers.cover.bounds import lagrangian_bound, lp_bound, quick_bound
from solvers.cover.instances import disc_instance

PRUNED_GREEDY = {0.0: 841, 0.7: 594}
"""Spread of the discs -> sets that the pruned greedy chooses, which pins the generator."""


@pytest.fixture(scope="module", params=PRUNED_GREEDY)
def spread(request):
    """How unequal the discs are."""
    return request.param


@pytest.fixture(scope="module")
def discs(spread):
    """10,000 discs of about 45 of 13,000 places, each of which is wanted twice."""
    return disc_instance(10_000, 13_000, 0, spread=spread).problem


@pytest.mark.parametrize("bound", [quick_bound, lagrangian_bound, lp_bound])
def test_bound(benchmark, discs, bound):
    assert benchmark.pedantic(bound, (discs,), rounds=1, warmup_rounds=1) > 0.0


def test_greedy(benchmark, discs, spread):
    solve(discs, "greedy")
    assert benchmark.pedantic(solve, (discs, "greedy"), rounds=3).cost == PRUNED_GREEDY[spread]


@pytest.mark.parametrize("solver", ["local-search", "lagrangian", "cp-sat"])
def test_half_a_minute(benchmark, discs, spread, solver):
    solve(disc_instance(50, 60, 0).problem, solver, stop=Stop(iterations=1))  # compiled
    run = {"stop": Stop(seconds=30)}
    result = benchmark.pedantic(solve, (discs, solver), run, rounds=1)
    saved = 1.0 - result.cost / PRUNED_GREEDY[spread]
    benchmark.extra_info.update(cost=result.cost, bound=result.bound, saved=saved)
    assert result.cost <= PRUNED_GREEDY[spread]
