"""How fast tours are bounded, proven and improved, on made-up places."""

import pytest

from solvers import Status, Stop, solve
from solvers.tour.bounds import held_karp_bound
from solvers.tour.instances import random_instance


@pytest.mark.parametrize("places", [12, 50, 100])
def test_proof(benchmark, places):
    problem = random_instance(places, 0).problem
    solve(problem, "branch-and-bound")
    result = benchmark.pedantic(solve, (problem, "branch-and-bound"), rounds=3)
    assert result.status is Status.OPTIMAL


@pytest.mark.parametrize("places", [100, 400, 1000])
def test_bound(benchmark, places):
    problem = random_instance(places, 0).problem
    held_karp_bound(problem, steps=1)
    assert benchmark.pedantic(held_karp_bound, (problem,), rounds=3) > 0.0


@pytest.mark.parametrize("places", [100, 400, 1000])
def test_default_limit(benchmark, places):
    problem = random_instance(places, 0).problem
    solve(problem, "auto", stop=Stop(iterations=1))
    assert benchmark.pedantic(solve, (problem, "auto"), rounds=1).gap < 0.03
