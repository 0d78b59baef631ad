"""How fast the motion planners are on one field, and what its checks and shortcuts cost."""

import numpy as np
import pytest

from solvers import solve
from solvers.motion.instances import random_boxes
from solvers.motion.shortcut import shortcut, tightened
from solvers.registry import load, names


@pytest.fixture(scope="module")
def field():
    return random_boxes(0)


@pytest.mark.parametrize("solver", names("motion"))
def test_planner(benchmark, field, solver):
    result = benchmark.pedantic(solve, (field.problem, solver), rounds=3, warmup_rounds=1)
    assert result.cost >= field.best_known


def test_edge_check(benchmark, field):
    problem = field.problem
    assert not benchmark(problem.edge_is_free, problem.start, problem.goal)


@pytest.mark.parametrize("how", ["shortcut", "tightened"])
def test_shortening(benchmark, field, how):
    raw = load("motion", "rrt-connect", attempts=1, shortcuts=0)
    path = solve(field.problem, raw).solution
    free = field.problem.edge_is_free
    if how == "shortcut":
        shorter = benchmark(lambda: shortcut(path, free, np.random.default_rng(0), rounds=60))
    else:
        shorter = benchmark(lambda: tightened(path, free, sweeps=2))
    assert field.problem.cost(shorter) <= field.problem.cost(path)


def test_field_with_its_shortest_path(benchmark):
    assert benchmark(random_boxes, 1).best_known > 50.0
