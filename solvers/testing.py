"""Conformance battery: what every solver must do, built in or plugged in.

``check_solver(MySolver(), "tour")`` runs every check of a family on small problems whose
optimum is found by trying everything. Written for the authors of solvers; used on every
registered one by this project's own tests.
"""

import itertools
import math
import pickle
import random
from collections.abc import Callable
from typing import Any

import numpy as np

from solvers.errors import InvalidProblem
from solvers.front import solve
from solvers.known_problems import known_problems, larger_problem
from solvers.problem import Problem, Solver
from solvers.registry import load, require
from solvers.result import Result, Status, StopReason
from solvers.stop import Stop

Check = Callable[[Solver, str], None]

_SHORT = Stop(iterations=300, seconds=5.0)  # the seconds only end what hangs
_LATE = 5.0  # seconds that a run may end after its limit, on a busy machine
_ROUNDING = 1e-6


class ConformanceFailure(AssertionError):
    """A solver broke a rule of its contract."""


def check_solver(solver: str | Solver, family: str) -> tuple[str, ...]:
    """Run the battery of a family on a solver; return the names of the checks passed.

    Raises
    ------
    ConformanceFailure
        At the first rule that the solver breaks; the message says on which problem.
    SolverUnavailable
        If a package that it needs is missing.

    """
    for check in CHECKS.values():
        check(load(family, solver), family)
    return tuple(CHECKS)


def never_beats_the_optimum(solver: Solver, family: str) -> None:
    """Costs from the optimum up, bounds from the optimum down, proofs only of the truth."""
    for known in known_problems(family):
        result = _solved(solver, known.problem)
        if result is None:
            continue
        name, optimum = known.name, known.optimum
        slack = _ROUNDING * abs(optimum) if math.isfinite(optimum) else 0.0
        _demand(result.cost >= optimum - slack, f"{name}: cost {result.cost} below {optimum}")
        _demand(result.bound <= optimum + slack, f"{name}: bound {result.bound} above {optimum}")
        if result.status is Status.OPTIMAL:
            _demand(result.cost <= optimum + slack, f"{name}: {result.cost} is not optimal")
        if result.status is Status.INFEASIBLE:
            _demand(math.isinf(optimum), f"{name}: called infeasible, costs {optimum}")
        if getattr(solver, "exact", False) and result.stop_reason is StopReason.FINISHED:
            truth = Status.OPTIMAL if math.isfinite(optimum) else Status.INFEASIBLE
            _demand(result.status is truth, f"{name}: exact solver says {result.status}")


def finds_something(solver: Solver, family: str) -> None:
    """Every plain problem that has a solution gets one, at the cost that it says."""
    for known in known_problems(family):
        if math.isinf(known.optimum) or "conflicts" in known.problem.features:
            continue
        result = _solved(solver, known.problem)
        if result is not None and result.solution is None:
            result = _solved(solver, known.problem, stop=Stop())  # as long as it likes
        if result is not None:
            _demand(result.solution is not None, f"{known.name}: found nothing")
            cost = known.problem.evaluate(result.solution)[1]
            _demand(cost == result.cost, f"{known.name}: {result.cost} is not the cost, {cost} is")


def infeasible_is_a_result(solver: Solver, family: str) -> None:
    """A problem without a solution ends in a status, not in an exception."""
    for known in known_problems(family):
        if math.isfinite(known.optimum):
            continue
        result = _solved(solver, known.problem)
        if result is not None:
            fair = result.status in (Status.INFEASIBLE, Status.UNKNOWN)
            _demand(fair, f"{known.name}: called {result.status}")
            _demand(result.solution is None and math.isinf(result.cost), f"{known.name}: solved")


def repeats_by_seed(solver: Solver, family: str) -> None:
    """Same seed, same solution and same trace."""
    for known in known_problems(family):
        first, second = (
            _solved(solver, known.problem, seed=7, stop=Stop(iterations=25)) for _ in range(2)
        )
        if first is None or second is None:
            continue
        _demand(_same(first.solution, second.solution), f"{known.name}: another solution")
        steps = [[(p.iteration, p.cost) for p in result.trace] for result in (first, second)]
        _demand(steps[0] == steps[1], f"{known.name}: another trace")
        _demand(first.bound == second.bound, f"{known.name}: another bound")


def takes_no_other_chance(solver: Solver, family: str) -> None:
    """The dice that all programs share stay as they were."""
    before = _shared_dice()
    _solved(solver, larger_problem(family), stop=Stop(iterations=25))
    kept = before == _shared_dice()
    _demand(kept, "drew from the global random state instead of `run.rng`")


def trace_falls_to_the_cost(solver: Solver, family: str) -> None:
    """The trace falls strictly, goes on in time and ends at the cost of the result."""
    for known in known_problems(family):
        result = _solved(solver, known.problem)
        if result is None or not result.trace:
            continue
        trace, name = result.trace, known.name
        _demand(trace[-1].cost == result.cost, f"{name}: trace ends at {trace[-1].cost}")
        for a, b in itertools.pairwise(trace):
            _demand(a.cost > b.cost, f"{name}: trace rises from {a.cost} to {b.cost}")
            _demand(a.iteration <= b.iteration, f"{name}: iterations run backwards")
            _demand(a.seconds <= b.seconds, f"{name}: time runs backwards")


def keeps_to_iterations(solver: Solver, family: str) -> None:
    """A limit on iterations is never overrun."""
    for most in (1, 2, 20):
        result = _limited(solver, family, iterations=most)
        if result is not None:
            _demand(result.iterations <= most, f"{result.iterations} iterations, limit {most}")
            _ended_by(result, StopReason.ITERATIONS)


def keeps_to_stall(solver: Solver, family: str) -> None:
    """So many iterations without a better solution end the run."""
    for most in (1, 20):
        result = _limited(solver, family, stall=most)
        if result is not None:
            _ended_by(result, StopReason.STALL)


def keeps_to_target(solver: Solver, family: str) -> None:
    """Any solution ends the run where any will do."""
    result = _limited(solver, family, target=1e30)
    if result is not None:
        _demand(result.solution is not None, "found nothing, with the one limit any solution")
        _ended_by(result, StopReason.TARGET)


def keeps_to_seconds(solver: Solver, family: str) -> None:
    """A limit on seconds ends the run soon after."""
    result = _limited(solver, family, seconds=0.2)
    if result is not None:
        _demand(result.seconds < 0.2 + _LATE, f"{result.seconds:.1f} s, limit 0.2 s")
        _ended_by(result, StopReason.TIME)


def leaves_the_problem_alone(solver: Solver, family: str) -> None:
    """The arrays of the problem are the same afterwards."""
    for known in known_problems(family):
        before = _arrays(known.problem)
        _solved(solver, known.problem, stop=Stop(iterations=5))
        after = _arrays(known.problem)  # may have more: what the problem works out when asked
        kept = all(after[name] == content for name, content in before.items())
        _demand(kept, f"{known.name}: the problem was changed")


def interrupt_keeps_the_incumbent(solver: Solver, family: str) -> None:
    """Ctrl-C at the first improvement gives that improvement back."""

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    for known in known_problems(family):
        if math.isinf(known.optimum) or known.problem.trivial() is not None:
            continue
        result = _solved(solver, known.problem, listener=interrupt)
        if result is None or not result.trace:
            continue
        swallowed = result.stop_reason is not StopReason.INTERRUPTED
        _demand(not swallowed, f"{known.name}: interrupt swallowed")
        _demand(result.cost == result.trace[0].cost, f"{known.name}: incumbent lost")


def never_worse_than_its_start(solver: Solver, family: str) -> None:
    """A warm start is taken, and at least kept."""
    for known in known_problems(family):
        first = _solved(solver, known.problem, seed=1)
        if first is None or first.solution is None:
            continue
        again = _solved(solver, known.problem, initial=first.solution, stop=Stop(iterations=5))
        if again is not None:
            _demand(again.cost <= first.cost, f"{known.name}: {again.cost} after {first.cost}")


def pickles(solver: Solver, _family: str) -> None:
    """Travels to another process."""
    twin = pickle.loads(pickle.dumps(solver))  # noqa: S301 - made one line above
    _demand(twin.name == solver.name, "another name after pickling")


CHECKS: dict[str, Check] = {
    check.__name__: check
    for check in (
        never_beats_the_optimum,
        finds_something,
        infeasible_is_a_result,
        repeats_by_seed,
        takes_no_other_chance,
        trace_falls_to_the_cost,
        keeps_to_iterations,
        keeps_to_stall,
        keeps_to_target,
        keeps_to_seconds,
        leaves_the_problem_alone,
        interrupt_keeps_the_incumbent,
        never_worse_than_its_start,
        pickles,
    )
}
"""Name -> check, for a test that wants one line for each."""


def _solved(solver: Solver, problem: Any, **options: Any) -> Result[Any] | None:
    """Result, or ``None`` where the solver refuses problems or limits of this kind."""
    require(solver)
    stop = options.pop("stop", _SHORT)
    refused = frozenset(getattr(solver, "cannot", ())) & problem.features
    if stop.limits and stop.limits <= frozenset(getattr(solver, "ignores", ())):
        refused |= stop.limits
    if not refused:
        return solve(problem, solver, stop=stop, **options)
    try:
        solve(problem, solver, stop=stop, **options)
    except InvalidProblem:
        return None
    raise ConformanceFailure(f"{solver.name}: took what it declares to refuse: {sorted(refused)}")


def _limited(solver: Solver, family: str, **limit: Any) -> Result[Any] | None:
    """Result on a larger problem under one limit that the solver should obey."""
    problem = larger_problem(family)
    _solved(solver, problem, stop=Stop(iterations=1))  # what it compiles or loads is not counted
    return _solved(solver, problem, stop=Stop(**limit))


def _ended_by(result: Result[Any], limit: StopReason) -> None:
    fair = result.stop_reason in (limit, StopReason.FINISHED)
    _demand(fair, f"stopped by {result.stop_reason}; the one limit was {limit}")


def _shared_dice() -> bytes:
    return pickle.dumps((random.getstate(), np.random.get_state()))  # noqa: NPY002 - must not move


def _demand(kept: object, otherwise: str) -> None:
    if not kept:
        raise ConformanceFailure(otherwise)


def _same(one: Any, other: Any) -> bool:
    if one is None or other is None:
        return one is other
    return bool(np.array_equal(one, other))


def _arrays(problem: Problem[Any]) -> dict[str, bytes]:
    return {
        name: value.tobytes()
        for name, value in vars(problem).items()
        if isinstance(value, np.ndarray)
    }
