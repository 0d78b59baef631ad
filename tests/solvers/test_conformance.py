"""Every registered solver, built in or plugged in, must pass every check of the battery."""

import random
from dataclasses import dataclass, field, fields

import numpy as np
import pytest

from solvers import InvalidProblem, Status, StopReason
from solvers.known_problems import known_problems
from solvers.registry import entries, families, load, missing, names, require
from solvers.testing import CHECKS, ConformanceFailure, check_solver
from solvers.tour.nearest import first_places, nearest_order

EVERY = [entry for family in families() for entry in entries(family)]

EXPECTED = {
    "cover": {"greedy", "cvxpy", "cp-sat", "local-search", "lagrangian"},
    "tour": {
        *("auto", "nearest", "two-opt", "iterated-local-search", "ant-colony", "particle-swarm"),
        *("branch-and-bound", "ortools", "christofides", "fast-tsp"),
    },
    "motion": {
        *("rrt-connect", "rrt-star", "informed-rrt-star", "sorrt-star", "bit-star", "aorrtc"),
        *("fmt", "bfmt", "prm", "prm-star", "rrt", "kpiece", "bkpiece", "lbkpiece"),
    },
}


@pytest.mark.parametrize("family", EXPECTED)
def test_no_expected_solver_is_missing(family):
    assert EXPECTED[family] <= set(names(family))


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS.keys())
@pytest.mark.parametrize("entry", EVERY, ids=lambda entry: f"{entry.family}-{entry.name}")
def test_solver_keeps_its_contract(entry, check, record_property):
    solver = load(entry.family, entry.name)
    if getattr(solver, "optional", False) and missing(solver):
        pytest.skip(f"{solver.name} is not installed, and needs not be")
    require(solver)  # a built-in solver that cannot run is a failure, never a skip
    check(solver, entry.family)
    record_property("conformance", f"{entry.family} {entry.name}")


@pytest.mark.parametrize("family", families())
def test_known_problems_have_names_of_their_own_and_keep_their_arrays(family):
    known = known_problems(family)
    assert len({case.name for case in known}) == len(known)
    assert any(np.isinf(case.optimum) for case in known) or family == "tour"
    held = [getattr(case.problem, f.name) for case in known for f in fields(case.problem)]
    arrays = [value for value in held if isinstance(value, np.ndarray)]
    assert not any(array.flags.writeable for array in arrays)


def test_there_is_no_battery_for_what_is_no_family():
    with pytest.raises(InvalidProblem, match="parking"):
        known_problems("parking")


@dataclass(frozen=True)
class Nearly:
    """A sound tour solver but for one fault."""

    fault: str
    notes: list = field(default_factory=list)
    name = "nearly"

    def run(self, problem, run):
        if self.fault == "says infeasible":
            return Status.INFEASIBLE
        if self.fault == "nothing found":
            return Status.FEASIBLE
        if self.fault == "writes":
            problem.costs.setflags(write=True)
            problem.costs[0, 1] += 1.0
        order = nearest_order(problem, next(first_places(problem)))
        try:
            run.offer(order)
        except KeyboardInterrupt:
            if self.fault != "swallows":
                raise
        if self.fault == "calls it optimal":
            return Status.OPTIMAL
        if self.fault == "bound":
            run.bound = run.best_cost
        while self.fault != "own end" and run.proceed():
            mixed = {
                "global dice": lambda: np.random.permutation(problem.size),  # noqa: NPY002
                "system dice": lambda: random.sample(range(problem.size), problem.size),
                "memory": lambda: np.roll(order, len(self.notes)),
            }.get(self.fault, lambda: run.rng.permutation(problem.size))()
            self.notes.append(1)
            run.offer(np.array(mixed))
        if self.fault == "overruns":
            run.iteration += 1
        if self.fault == "own end":
            run.stop_reason = StopReason.STALL
        return Status.FEASIBLE


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("says infeasible", "called infeasible"),
        ("nothing found", "found nothing"),
        ("calls it optimal", "above"),
        ("bound", "above"),
        ("global dice", "another|global random state"),
        ("system dice", "another|global random state"),
        ("memory", "another"),
        ("overruns", "iterations, limit"),
        ("own end", "stopped by stall"),
        ("swallows", "swallowed|lost"),
        ("writes", "changed|is not the cost|below|read-only|not optimal|writeable"),
    ],
)
def test_each_fault_fails_the_battery(fault, told):
    with pytest.raises((ConformanceFailure, InvalidProblem, RuntimeError), match=told):
        check_solver(Nearly(fault), "tour")


def test_without_a_fault_it_passes():
    assert check_solver(Nearly(""), "tour") == tuple(CHECKS)
