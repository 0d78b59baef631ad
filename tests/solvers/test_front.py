"""What `solve` promises whatever the solver does."""

import pickle
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from solvers import (
    InvalidProblem,
    InvalidSolution,
    SolverFailed,
    SolverUnavailable,
    Status,
    Stop,
    StopReason,
    solve,
)
from solvers.registry import catalogue, load, names
from solvers.testing import ConformanceFailure, check_solver
from solvers.tour import TourProblem


def square(n=8):
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    places = np.column_stack([np.cos(angle), np.sin(angle)])
    return TourProblem(np.linalg.norm(places[:, None] - places[None, :], axis=2))


@dataclass(frozen=True)
class RandomTours:
    """Shuffle until told to stop."""

    name = "random"

    def run(self, problem, run):
        while run.proceed():
            run.offer(run.rng.permutation(len(problem.costs)))
        return Status.FEASIBLE


@dataclass(frozen=True)
class Behaves:
    """Does what the test says."""

    action: object
    name = "behaves"

    def run(self, problem, run):
        return self.action(problem, run)


def test_a_solver_of_eight_lines_passes_the_whole_battery():
    assert "repeats_by_seed" in check_solver(RandomTours(), "tour")


@pytest.mark.parametrize(
    ("stop", "reason"),
    [
        (Stop(iterations=20), StopReason.ITERATIONS),
        (Stop(stall=20), StopReason.STALL),
        (Stop(target=1e9), StopReason.TARGET),
        (Stop(seconds=0.05), StopReason.TIME),
        (Stop(), StopReason.ITERATIONS),
    ],
)
def test_each_limit_ends_the_run_and_is_named(stop, reason):
    assert solve(square(), RandomTours(), stop=stop).stop_reason is reason


def test_illegal_candidates_are_counted_and_never_become_the_answer():
    def action(problem, run):
        for wrong in ([0, 1], [0] * 8, np.arange(8) + 1, np.arange(8.0), "tour"):
            assert not run.offer(wrong)
        return Status.OPTIMAL

    result = solve(square(), Behaves(action))
    assert (result.status, result.solution, result.refused) == (Status.UNKNOWN, None, 5)


def test_the_incumbent_is_a_copy():
    def action(problem, run):
        order = np.arange(8)
        run.offer(order)
        order[:] = 0
        return Status.FEASIBLE

    result = solve(square(), Behaves(action))
    np.testing.assert_array_equal(result.solution, np.arange(8))
    assert result.cost == pytest.approx(16 * np.sin(np.pi / 8))


def test_a_bound_that_meets_the_cost_is_a_proof():
    def action(problem, run):
        run.offer(np.arange(8))
        run.bound = run.best_cost
        return Status.FEASIBLE

    result = solve(square(), Behaves(action))
    assert (result.status, result.gap) == (Status.OPTIMAL, 0.0)


def test_a_bound_above_the_cost_is_a_lie_that_is_told():
    def action(problem, run):
        run.offer(np.arange(8))
        run.bound = 2 * run.best_cost
        return Status.FEASIBLE

    with pytest.raises(SolverFailed, match="bound"):
        solve(square(), Behaves(action))


def test_a_false_claim_of_infeasibility_fails_the_battery():
    with pytest.raises(ConformanceFailure, match="infeasible"):
        check_solver(Behaves(lambda *_: Status.INFEASIBLE), "tour")


def test_a_crash_names_the_solver():
    with pytest.raises(SolverFailed, match="'behaves' crashed: ZeroDivisionError"):
        solve(square(), Behaves(lambda *_: 1 / 0))


def test_a_warm_start_is_kept_and_a_wrong_one_refused():
    kept = solve(square(), Behaves(lambda *_: Status.UNKNOWN), initial=range(8))
    assert kept.status is Status.FEASIBLE
    with pytest.raises(InvalidSolution, match="not visited"):
        solve(square(), "nearest", initial=[0] * 8)


def test_results_travel_to_another_process():
    result = solve(square(), "nearest")
    assert pickle.loads(pickle.dumps(result)).cost == result.cost  # noqa: S301


def test_unknown_name_lists_the_known_ones_and_the_nearest():
    with pytest.raises(InvalidProblem, match=r"nearest, two-opt.*Did you mean 'two-opt'"):
        solve(square(), "two-optt")


@pytest.mark.parametrize(
    "wrong", ["no_such_module:Thing", "math:nothing", "math:pi", ":", object()]
)
def test_what_is_no_solver_is_refused(wrong):
    with pytest.raises(InvalidProblem):
        solve(square(), wrong)


def test_parameters_reach_the_solver_and_unknown_ones_do_not_pass():
    assert load("tour", "two-opt", neighbours=3).neighbours == 3
    for wrong in ({"neighbors": 3}, {"neighbours": 0}):
        with pytest.raises(InvalidProblem, match="neighbo"):
            load("tour", "two-opt", **wrong)


def test_a_plug_in_is_found_by_its_entry_point(monkeypatch):
    spec = f"{__name__}:RandomTours"
    monkeypatch.setitem(sys.modules, __name__, sys.modules.get(__name__) or _this_module())

    def installed(*, group):
        return [EntryPoint("random", spec, group)] if group == "solvers.tour" else []

    monkeypatch.setattr("importlib.metadata.entry_points", installed)
    assert names("tour")[-1] == "random"
    assert solve(square(), "random").solver == "random"
    assert solve(square(), spec).solver == "random"
    rows = {(row["family"], row["name"]): row for row in catalogue()}
    assert rows["tour", "random"]["source"] == spec
    assert rows["tour", "random"]["available"]


def test_a_plug_in_that_does_not_load_is_a_row_with_its_reason(monkeypatch):
    broken = EntryPoint("broken", "no_such_module:Thing", "solvers.cover")
    monkeypatch.setattr(
        "importlib.metadata.entry_points",
        lambda *, group: [broken] if group == "solvers.cover" else [],
    )
    row = next(row for row in catalogue() if row["name"] == "broken")
    assert not row["available"]
    assert "no_such_module" in row["missing"]


def test_every_built_in_solver_but_the_optional_one_can_run_here():
    rows = [row for row in catalogue() if row["source"] == "built in"]
    assert {row["name"] for row in rows if not row["available"]} <= {"fast-tsp"}


def _this_module():
    module = type(sys)(__name__)
    module.RandomTours = RandomTours
    return module


def test_a_missing_package_is_named():
    class Needy(RandomTours):
        requires = ("no_such_package_at_all",)

    with pytest.raises(SolverUnavailable, match="pip install no_such_package_at_all"):
        solve(square(), Needy())


def test_what_a_solver_cannot_do_is_refused_beforehand():
    with pytest.raises(InvalidProblem, match="asymmetric"):
        solve(TourProblem(np.random.default_rng(0).random((5, 5))), "two-opt")

    class Deaf(RandomTours):
        ignores = frozenset({"target"})

    with pytest.raises(InvalidProblem, match="target"):
        solve(square(), Deaf(), stop=Stop(target=1.0))


@pytest.mark.parametrize(
    "wrong", [{"seconds": 0}, {"iterations": 0}, {"stall": 1.5}, {"target": np.nan}]
)
def test_limits_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Stop(**wrong)


def test_importing_the_package_loads_no_back_end():
    code = (
        "import sys, solvers; solvers.solve; import solvers.registry as r\n"
        "import solvers.cover, solvers.pairs, solvers.tour, solvers.motion\n"
        "[r.load(f, n) for f in r.families() for n in r.names(f)]\n"
        "heavy = {'numba', 'scipy', 'cvxpy', 'ortools', 'ompl', 'highspy'} & set(sys.modules)\n"
        "sys.exit(str(heavy) if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
