"""Searches for good tours: what they find, and what they leave when they are stopped."""

import itertools
import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import InvalidProblem, Status, Stop, StopReason, solve
from solvers.errors import SolverUnavailable
from solvers.registry import load, missing
from solvers.run import Run
from solvers.tour import TourProblem, ant_colony, ant_kernels
from solvers.tour.ant_colony import AntColony
from solvers.tour.bounds import held_karp_bound
from solvers.tour.candidates import likely_lists, nearest_lists
from solvers.tour.instances import random_instance, read_tsplib
from solvers.tour.nearest import nearest_order
from solvers.tour.search_kernels import chain, new_walk, settle

SEARCHES = ("auto", "iterated-local-search", "ant-colony", "particle-swarm", "christofides")
OPEN = ({"closed": False}, {"closed": False, "start": 3}, {"closed": False, "end": 5})
ENDS = (*OPEN, {"closed": False, "start": 3, "end": 5}, {"start": 4})


def distances(places):
    return np.linalg.norm(places[:, None] - places[None, :], axis=2)


@pytest.mark.parametrize("solver", SEARCHES)
def test_a_circle_is_walked_once_around(solver):
    angle = np.random.default_rng(0).permutation(np.linspace(0, 2 * np.pi, 30, endpoint=False))
    problem = TourProblem(distances(np.column_stack([np.cos(angle), np.sin(angle)])))
    result = solve(problem, solver, stop=Stop(iterations=400))
    assert result.cost == pytest.approx(60 * np.sin(np.pi / 30))


@pytest.mark.parametrize("solver", SEARCHES)
@pytest.mark.parametrize("ends", ENDS)
def test_ends_are_held(solver, ends):
    """`evaluate` refuses what breaks them, so that none may be refused."""
    problem = TourProblem(random_instance(20, 7).problem.costs, **ends)
    result = solve(problem, solver, stop=Stop(iterations=30))
    assert (result.refused, result.status is Status.UNKNOWN) == (0, False)
    assert result.cost >= held_karp_bound(problem) - 1e-9


@pytest.mark.parametrize("solver", ["ant-colony", "particle-swarm", "auto"])
def test_one_way_streets_are_walked_the_right_way(solver):
    n = 12
    costs = np.full((n, n), 10.0)
    costs[np.arange(n), (np.arange(n) + 1) % n] = 1.0
    result = solve(TourProblem(costs), solver, stop=Stop(iterations=200))
    assert result.cost == n
    with pytest.raises(InvalidProblem, match="asymmetric"):
        solve(TourProblem(costs), load("tour", "ant-colony", local_search=True))


@pytest.mark.parametrize("size", [5, 40, 200])
def test_auto_repeats_without_any_limit_and_says_how_good_it_is(size):
    problem = random_instance(size, 3).problem
    first, second = (solve(problem, "auto", seed=9) for _ in range(2))
    np.testing.assert_array_equal(first.solution, second.solution)
    assert (first.iterations, first.bound) == (second.iterations, second.bound)
    assert first.gap < 0.015
    assert (first.status is Status.OPTIMAL) == (size < 100)


def test_auto_bounds_one_way_streets():
    problem = TourProblem(np.random.default_rng(0).random((30, 30)))
    result = solve(problem, "auto")
    assert 0.5 * result.cost < result.bound <= result.cost


def test_published_optima_are_found_by_the_defaults(shared_data):
    folder = shared_data / "optimisation" / "tsplib"
    for name, facts in json.loads((folder / "best_known.json").read_text()).items():
        if facts["dimension"] <= 130:
            result = solve(read_tsplib(folder / f"{name}.tsp").problem, "auto", seed=1)
            assert result.cost == facts["best_known"], name


@pytest.mark.slow
def test_published_optima_of_hundreds_of_places_are_close(shared_data):
    folder = shared_data / "optimisation" / "tsplib"
    best = json.loads((folder / "best_known.json").read_text())
    for name, share in (("a280", 1.0005), ("pcb442", 1.005), ("pr1002", 1.01)):
        result = solve(read_tsplib(folder / f"{name}.tsp").problem, "auto", seed=1)
        assert result.cost <= share * best[name]["best_known"]
        assert result.bound >= 0.97 * best[name]["best_known"]


@pytest.mark.parametrize(
    ("solver", "parameters", "iterations", "share"),
    [
        ("ant-colony", {}, 400, 1.06),
        ("ant-colony", {"local_search": True}, 20, 1.005),
        ("particle-swarm", {}, 1500, 1.03),
        ("iterated-local-search", {}, 10_000, 1.002),
        ("christofides", {}, 1, 1.25),
    ],
)
def test_each_search_is_near_the_optimum_of_berlin(
    shared_data, solver, parameters, iterations, share
):
    problem = read_tsplib(shared_data / "optimisation" / "tsplib" / "berlin52.tsp").problem
    result = solve(problem, load("tour", solver, **parameters), stop=Stop(iterations=iterations))
    assert 7542.0 <= result.cost <= share * 7542.0


@given(st.integers(0, 10**6), st.integers(5, 40))
@settings(max_examples=60, deadline=None)
def test_settled_tours_have_no_better_neighbour_by_two_or_three_edges(seed, n):
    """All 2-opt moves and moved stretches, with every place a candidate."""
    costs = distances(np.random.default_rng(seed).random((n, 2)))
    costs.setflags(write=False)
    order = np.random.default_rng(seed + 1).permutation(n)
    walk = new_walk(order)
    saved = settle(costs, nearest_lists(costs, n - 1), walk, 1e-12)
    tour = walk.tour
    length = costs[tour, np.roll(tour, -1)].sum()
    assert sorted(tour) == list(range(n))
    np.testing.assert_array_equal(tour[walk.position], np.arange(n))
    assert length + saved == pytest.approx(costs[order, np.roll(order, -1)].sum())
    for i, j in itertools.combinations(range(n), 2):
        turned = np.concatenate([tour[:i], tour[i : j + 1][::-1], tour[j + 1 :]])
        assert costs[turned, np.roll(turned, -1)].sum() >= length - 1e-9
        moved = np.concatenate([tour[:i], tour[j:], tour[i:j]])  # a stretch to the very end
        assert costs[moved, np.roll(moved, -1)].sum() >= length - 1e-9


@given(st.integers(0, 10**6), st.integers(4, 30), st.floats(0.0, 1.0))
@settings(max_examples=40, deadline=None)
def test_kicks_lose_no_place_and_the_cost_is_that_of_the_best(seed, n, heat):
    rng = np.random.default_rng(seed)
    costs = distances(rng.random((n, 2)))
    costs.setflags(write=False)
    near = nearest_lists(costs, min(5, n - 1))
    walk = new_walk(rng.permutation(n))
    settle(costs, near, walk, 1e-12)
    best = walk.tour.copy()
    before = costs[best, np.roll(best, -1)].sum()
    cost = chain(costs, near, walk, best, 200, min(10, n - 2), heat, 1e-12, rng)
    for tour in (walk.tour, best):
        assert sorted(tour) == list(range(n))
    assert costs[best, np.roll(best, -1)].sum() == pytest.approx(cost)
    assert cost <= before + 1e-9
    np.testing.assert_array_equal(walk.tour[walk.position], np.arange(n))


def test_likely_neighbours_lead_out_of_a_crowd():
    problem = random_instance(120, 5, clusters=4).problem
    crowd = nearest_lists(problem.costs, 6)
    likely = likely_lists(problem.costs, np.zeros(120), 6, 4)
    assert likely.shape == crowd.shape
    rows = np.arange(120)[:, None]
    assert (np.diff(problem.costs[rows, likely], axis=1) >= 0).all()
    assert all(len(set(row)) == 6 and i not in row for i, row in enumerate(likely.tolist()))

    def reached(lists):
        found, todo = {0}, [0]
        while todo:
            place = todo.pop()
            ways = {*lists[place].tolist(), *np.flatnonzero((lists == place).any(axis=1)).tolist()}
            todo += ways - found
            found |= ways
        return len(found)

    assert reached(crowd) < reached(likely) == 120


def test_christofides_keeps_its_guarantee():
    for seed in range(5):
        problem = random_instance(60, seed).problem
        result = solve(problem, "christofides")
        assert result.cost <= 1.5 * solve(problem, "branch-and-bound").cost
    with pytest.raises(InvalidProblem, match="seconds"):
        solve(problem, "christofides", stop=Stop(seconds=1.0))


def test_a_limit_on_seconds_is_kept_with_a_bound():
    problem = random_instance(600, 0).problem
    solve(problem, "auto", stop=Stop(iterations=1))
    result = solve(problem, "auto", stop=Stop(seconds=0.5))
    assert result.stop_reason is StopReason.TIME
    assert result.bound > 0.8 * result.cost  # after the first steps of the ascent


@pytest.mark.parametrize(
    ("solver", "wrong"),
    [
        ("iterated-local-search", {"reach": 1}),
        ("iterated-local-search", {"heat": -1.0}),
        ("ant-colony", {"persistence": 1.0}),
        ("ant-colony", {"ants": 0}),
        ("ant-colony", {"beta": -1.0}),
        ("particle-swarm", {"particles": 1}),
        ("particle-swarm", {"inertia": 2.0}),
        ("branch-and-bound", {"steps": 0}),
        ("branch-and-bound", {"kicks": 1.5}),
        ("two-opt", {"neighbours": 2.5}),
        ("two-opt", {"neighbours": "abc"}),
        ("two-opt", {"neighbours": True}),
        ("iterated-local-search", {"neighbours": None}),
        ("iterated-local-search", {"heat": float("inf")}),
        ("ant-colony", {"ants": "many"}),
        ("ant-colony", {"alpha": float("nan")}),
        ("ant-colony", {"quantity": 0.0}),
        ("ant-colony", {"local_search": 1}),
        ("particle-swarm", {"last_inertia": "0.5"}),
        ("particle-swarm", {"pull": float("nan")}),
        ("ortools", {"metaheuristic": 3}),
    ],
)
def test_parameters_out_of_range_are_refused(solver, wrong):
    with pytest.raises(InvalidProblem, match=f"refuses its parameters: {next(iter(wrong))} must"):
        load("tour", solver, **wrong)


def test_whole_numbers_of_any_kind_are_parameters():
    solver = load("tour", "ant-colony", ants=np.int64(3), alpha=1, beta=np.float64(2.0))
    assert solve(random_instance(8, 0).problem, solver, stop=Stop(iterations=2)).refused == 0


@pytest.mark.parametrize("local_search", [False, True])
def test_ants_in_batches_walk_as_all_at_once(monkeypatch, local_search):
    problem, solver = random_instance(40, 2).problem, AntColony(local_search=local_search)
    whole = solve(problem, solver, seed=4, stop=Stop(iterations=8))
    monkeypatch.setattr(ant_colony, "_BATCH", 3 * 40**2)
    batches = solve(problem, solver, seed=4, stop=Stop(iterations=8))
    np.testing.assert_array_equal(whole.solution, batches.solution)
    assert [(p.iteration, p.cost) for p in whole.trace] == [
        (p.iteration, p.cost) for p in batches.trace
    ]
    generous = solve(problem, solver, seed=4, stop=Stop(iterations=8, seconds=1000.0))
    np.testing.assert_array_equal(whole.solution, generous.solution)


@pytest.mark.parametrize("local_search", [False, True])
def test_time_may_end_a_cycle_of_ants_early(monkeypatch, local_search):
    """The clock is over once two batches of one ant have walked."""
    looks = itertools.count()
    monkeypatch.setattr(ant_colony, "_BATCH", 1)
    monkeypatch.setattr(Run, "remaining", property(lambda _: 1.0 if next(looks) < 2 else 0.0))
    walked, lengths = [], ant_kernels.lengths
    monkeypatch.setattr(
        ant_kernels, "lengths", lambda *given: walked.append(len(given[1])) or lengths(*given)
    )
    solver = AntColony(local_search=local_search)
    result = solve(random_instance(30, 1).problem, solver, stop=Stop(seconds=1.0))
    assert walked == [2]
    assert result.stop_reason is StopReason.TIME
    assert (result.iterations, result.refused) == (1, 0)
    assert result.trace[0].iteration == 0  # the nearest-neighbour tour


def test_one_way_streets_have_an_order_before_all_else():
    problem = TourProblem(np.random.default_rng(0).random((400, 400)))
    result = solve(problem, "auto", stop=Stop(seconds=1e-6))
    assert result.cost <= problem.cost(nearest_order(problem, 0))
    assert result.stop_reason is StopReason.TIME


def test_fast_tsp_says_how_to_install_it():
    if not missing(load("tour", "fast-tsp")):
        pytest.skip("it is installed")
    with pytest.raises(SolverUnavailable, match="pip install fast-tsp"):
        solve(random_instance(5, 0).problem, "fast-tsp")


@pytest.mark.parametrize("ends", [{}, *ENDS])
def test_fast_tsp_gets_whole_numbers_and_gives_an_order(monkeypatch, ends):
    """With a stand-in for the package, which solves the same whole numbers exactly."""
    given = {}

    def find_tour(costs, seconds):
        given.update(costs=costs, seconds=seconds)
        return solve(TourProblem(costs), "branch-and-bound").solution.tolist()

    monkeypatch.setitem(sys.modules, "fast_tsp", SimpleNamespace(find_tour=find_tour, __spec__=1))
    problem = TourProblem(random_instance(12, 0).problem.costs, **ends)
    result = solve(problem, "fast-tsp", stop=Stop(seconds=7.0))
    assert all(isinstance(cost, int) for row in given["costs"] for cost in row)
    assert len(given["costs"]) * max(map(max, given["costs"])) <= 2**31
    assert 6.0 < given["seconds"] <= 7.0
    assert result.cost == pytest.approx(solve(problem, "branch-and-bound").cost)
