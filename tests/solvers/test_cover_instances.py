"""Files of the OR-Library, and covers from dice."""

import json

import numpy as np
import pytest

from solvers import InvalidProblem, Status, solve
from solvers.cases import cases
from solvers.cover import CoverProblem
from solvers.cover.instances import (
    disc_instance,
    planted_instance,
    read_orlib,
    write_cover,
    write_orlib,
)

HITS = np.array([[1, 0, 1], [0, 1, 1]])
FORMATS = {
    "rows": "3 2\n5 7\n1\n1\n1\n2\n2\n1 2\n",
    "rail": "3 2\n5 2 1 3\n7 2 2 3\n",
}


@pytest.mark.parametrize("form", FORMATS)
def test_both_formats_of_one_problem_read_the_same(tmp_path, form):
    path = tmp_path / "tiny.txt"
    path.write_text(FORMATS[form])
    instance = read_orlib(path)
    assert instance.name == "tiny"
    np.testing.assert_array_equal(instance.problem.covers.toarray(), HITS)
    np.testing.assert_array_equal(instance.problem.prices, [5.0, 7.0])


def test_steiner_triples_cost_one_each(tmp_path):
    path = tmp_path / "sts3.txt"
    path.write_text("4 2\n1 2 3\n2 3 4\n")
    problem = read_orlib(path).problem
    np.testing.assert_array_equal(problem.covers.toarray().T, [[1, 1, 1, 0], [0, 1, 1, 1]])
    assert solve(problem, "cp-sat").cost == 1.0


def test_what_is_written_reads_the_same(tmp_path):
    rng = np.random.default_rng(0)
    problem = CoverProblem((rng.random((30, 20)) < 0.3) | (np.arange(20) == 3), rng.random(30))
    write_orlib(tmp_path / "a.txt", problem)
    again = read_orlib(tmp_path / "a.txt").problem
    for name in ("indptr", "indices", "prices", "demand"):
        np.testing.assert_array_equal(getattr(again, name), getattr(problem, name))
    result = solve(problem, "greedy")
    write_cover(tmp_path / "a.cover", result.solution, cost=result.cost)
    cost, count, *sets = (tmp_path / "a.cover").read_text().split()
    assert (float(cost), int(count)) == (result.cost, len(sets))
    assert problem.cost(np.array(sets, dtype=int) - 1) == result.cost


def test_demand_and_what_the_format_cannot_say(tmp_path):
    (tmp_path / "a.txt").write_text(FORMATS["rows"])
    problem = read_orlib(tmp_path / "a.txt", demand=2).problem
    np.testing.assert_array_equal(problem.demand, [1, 1, 2])
    with pytest.raises(InvalidProblem, match="demand"):
        write_orlib(tmp_path / "b.txt", problem)
    assert not (tmp_path / "b.txt").exists()


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "two finite numbers"),
        ("3 two", "no number"),
        ("3 nan", "finite"),
        ("3 2 5 7 1 1", "ends after 1 of 3 lists"),
        ("3 2 5 7 1 1 1 3 2 1 2", "3 is no set of 2"),
        ("3 2 5 7 1 1 1 2 9 1 2", "cannot be 9 long"),
        ("3 2 5 7 1 1 1 2 2 1 2 4", "1 numbers are left over"),
        ("0 2 5", "0 is no size"),
        ("999999999 1 1 2 3", "999999999 is no size"),
        ("1 1 -5 1 1", "prices must be at least"),
        ("3 2.5 5", "2.5 is no size"),
        ("3 2 5 7 1 1 1 2 2 1 1.5", "1.5 is no set"),
    ],
)
def test_broken_files_are_named(tmp_path, content, told):
    path = tmp_path / "broken.txt"
    path.write_text(content)
    with pytest.raises(InvalidProblem, match=told) as caught:
        read_orlib(path)
    assert str(caught.value).startswith(str(path))
    with pytest.raises(InvalidProblem, match="cannot be read"):
        read_orlib(tmp_path / "none.txt")


def test_published_sizes_and_optima(shared_data):
    folder = shared_data / "optimisation" / "scp"
    listed = json.loads((folder / "best_known.json").read_text())["instances"]
    for name, facts in listed.items():
        problem = read_orlib(folder / f"{name}.txt").problem
        sizes = {"rows": problem.elements, "columns": problem.sets}
        sizes |= {"nonzeros": len(problem.indices)}
        assert sizes.items() >= {key: facts[key] for key in sizes if key in facts}.items(), name
        assert solve(problem, "greedy").bound <= facts["best_known"], name
    for name in ("scp41", "scp61", "sts27"):
        case = cases("cover", [str(folder / f"{name}.txt")])[0]
        result = solve(case.problem, "cp-sat")
        assert (result.status, result.cost) == (Status.OPTIMAL, case.best_known), name


@pytest.mark.parametrize("seed", range(3))
def test_a_planted_partition_is_found_and_never_beaten(seed):
    instance = planted_instance(100, 60, seed, parts=6)
    for solver in ("cp-sat", "cvxpy"):
        result = solve(instance.problem, solver, seed=1)
        assert (result.cost, result.status) == (instance.best_known, Status.OPTIMAL)
    for solver in ("greedy", "local-search", "lagrangian"):
        result = solve(instance.problem, solver, seed=1)
        assert result.bound <= instance.best_known <= result.cost


def test_made_up_covers_repeat_and_have_the_sizes_asked_for():
    first, again, other = (disc_instance(300, 400, seed).problem for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.indices, again.indices)
    assert not np.array_equal(first.indices[:50], other.indices[:50])
    assert (first.sets, first.elements) == (300, 400)
    assert 30.0 < len(first.indices) / 300 <= 45.0  # fewer at the edge
    sizes = np.diff(disc_instance(300, 400, 0, spread=0.7).problem.indptr)
    assert sizes.std() > 1.5 * np.diff(first.indptr).std()
    with pytest.raises(InvalidProblem, match="partition"):
        planted_instance(10, 100, 0, parts=20)
