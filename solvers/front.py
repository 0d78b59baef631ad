"""The one way in: a problem and the name of a solver give a result."""

import math
import operator
from collections.abc import Callable
from typing import Any, TypeVar

from solvers.errors import InvalidProblem, SolverError, SolverFailed
from solvers.problem import Problem, Solver
from solvers.registry import load, require
from solvers.result import Result, Status, StopReason, TracePoint
from solvers.run import Run
from solvers.stop import Stop

S = TypeVar("S")

FALLBACK_STOP = Stop(iterations=1000)
"""Limit of a solver that declares no ``default_stop``, when the caller sets none."""

_ROUNDING = 1e-6  # relative; what a floating-point back end may be off by in its bound


def solve(
    problem: Problem[S],
    solver: str | Solver,
    *,
    seed: int = 0,
    stop: Stop = Stop(),  # noqa: B008 - an immutable value
    initial: S | None = None,
    listener: Callable[[TracePoint], None] | None = None,
) -> Result[S]:
    """Solve a problem and say what is proven about the answer.

    Parameters
    ----------
    problem
        One of the families' problems.
    solver
        Built-in name, entry point, ``"module:Class"`` or the solver itself.
    seed
        Root of all chance, at least 0; the same seed gives the same result unless
        ``stop.seconds`` ends the run.
    stop
        Limits; with none set, the solver's own default.
    initial
        Warm start; the result is never worse than it.
    listener
        Called with every improvement.

    Raises
    ------
    InvalidProblem
        If the solver is unknown, or cannot take this problem or any of these limits.
    InvalidSolution
        If ``initial`` breaks a constraint.
    SolverUnavailable
        If a package that the solver needs is missing.
    SolverFailed
        If the solver crashes or claims what cannot be true.

    """
    family = getattr(problem, "family", None)
    if not isinstance(family, str):
        raise InvalidProblem(f"{type(problem).__name__} is not a problem of any family.")
    try:
        seed = operator.index(seed)
    except TypeError as error:
        raise InvalidProblem(f"seed must be a whole number, got {seed!r}.") from error
    if seed < 0:
        raise InvalidProblem(f"seed must be at least 0, got {seed}.")
    if not isinstance(stop, Stop):
        raise InvalidProblem(f"stop must be a Stop, such as Stop(seconds=5), got {stop!r}.")
    chosen: Solver = load(family, solver)
    require(chosen)
    stop = _admit(problem, chosen, stop)

    run: Run[S] = Run(problem.evaluate, stop=stop, seed=seed, listener=listener)
    if initial is not None:
        problem.evaluate(initial)  # raises where `offer` would only count a refusal
        run.offer(initial)
        run.initial = run.best
    status = _perform(problem, chosen, run)
    return _settle(run, status, chosen.name)


def _admit(problem: Problem[Any], solver: Solver, stop: Stop) -> Stop:
    """Refuse what the solver cannot do; fill in its default limits."""
    refused = sorted(frozenset(getattr(solver, "cannot", ())) & problem.features)
    if refused:
        raise InvalidProblem(
            f"solver {solver.name!r} cannot take problems with {' and '.join(refused)}; "
            f"choose another one of family {problem.family!r}."
        )
    if not stop.limits:
        default = getattr(solver, "default_stop", FALLBACK_STOP)
        return default(problem) if callable(default) else default
    if stop.limits <= frozenset(getattr(solver, "ignores", ())):
        raise InvalidProblem(
            f"solver {solver.name!r} cannot obey a limit on {' and '.join(sorted(stop.limits))}."
        )
    return stop


def _perform(problem: Problem[S], solver: Solver, run: Run[S]) -> Status:
    """Run the solver; an interrupt keeps what it has, a crash is named."""
    try:
        answer = problem.trivial()
        if answer is None:
            return Status(solver.run(problem, run))
        if answer.solution is not None:
            run.offer(answer.solution)
        return answer.status
    except KeyboardInterrupt:
        run.stop_reason = StopReason.INTERRUPTED
        return Status.UNKNOWN
    except SolverError:
        raise
    except Exception as error:  # a plug-in may raise anything
        raise SolverFailed(
            f"solver {solver.name!r} crashed: {type(error).__name__}: {error}"
        ) from error


def _settle(run: Run[S], status: Status, name: str) -> Result[S]:
    """Bring the claimed status in line with what was accepted and proven."""
    cost, bound = run.best_cost, run.bound
    slack = _ROUNDING * max(1e-9, abs(cost)) if math.isfinite(cost) else 0.0
    if math.isnan(bound) or bound > cost + slack:
        raise SolverFailed(f"solver {name!r} claims a bound of {bound} above the cost {cost}.")
    bound = min(bound, cost)
    if run.best is None:
        if status is not Status.INFEASIBLE:
            no_hope = bound == math.inf  # proven to be above any cost
            status = Status.INFEASIBLE if no_hope else Status.UNKNOWN
    elif status is Status.INFEASIBLE:
        raise SolverFailed(f"solver {name!r} calls infeasible what it has solved at {cost}.")
    elif status is Status.OPTIMAL:
        bound = cost
    else:
        status = Status.OPTIMAL if bound == cost else Status.FEASIBLE
    return Result(
        solution=run.best,
        cost=cost,
        bound=bound,
        status=status,
        stop_reason=run.stop_reason,
        trace=tuple(run.trace),
        solver=name,
        seed=run.seed,
        iterations=run.iteration,
        seconds=run.elapsed,
        refused=run.refused,
    )
