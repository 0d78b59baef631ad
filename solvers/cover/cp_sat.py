"""Exact multi-cover by constraint programming, through CP-SAT of OR-Tools."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from solvers.arrays import Floats, Ints
from solvers.cover.bounds import price_unit, quick_bound
from solvers.cover.greedy import select
from solvers.cover.problem import Chosen, CoverProblem
from solvers.cover.sector_rows import sector_rows
from solvers.interruptible import heedful
from solvers.parameters import check_whole
from solvers.result import Status, StopReason
from solvers.run import Run
from solvers.stop import Stop

_LARGEST = 2**50  # that all prices together become, where they are not whole already
_STRIDE = 0.01  # units of deterministic time in an iteration
_ENDLESS = 1e9  # seconds, or units of deterministic time
_ROUNDING = 1e-12  # relative, of the bound in floating point
_PROVEN = 1e-9  # relative gap that rounding prices down may leave in a proof


@dataclass(frozen=True, slots=True)
class CpSat:
    """Clauses, propagation and large-neighbourhood search, with the greedy selection as a hint.

    Prices become integers inside. Where they are multiples of one unit nothing is lost; else
    they are rounded down, so that the bound stays valid. An iteration is a hundredth of a unit
    of the deterministic time of CP-SAT, about 10 ms. A stall limit runs it in pieces, each from
    the best cover so far.

    Parameters
    ----------
    workers
        Threads, at least 1. The strategies take turns in a fixed order whatever their number,
        so that the result depends on the seed alone unless seconds end the run.
    interleaved
        Whether the strategies take turns; otherwise one worker runs one strategy, and several
        are as fast as the machine lets them and do not repeat.

    """

    workers: int = 1
    interleaved: bool = True
    name: ClassVar[str] = "cp-sat"
    requires: ClassVar[tuple[str, ...]] = ("ortools", "numba", "scipy")
    exact: ClassVar[bool] = True
    default_stop: ClassVar[Stop] = Stop()

    def __post_init__(self) -> None:
        check_whole(self, workers=1)

    def run(self, problem: CoverProblem, run: Run[Chosen]) -> Status:
        """Offer each cover that the search finds; ``OPTIMAL`` or ``INFEASIBLE`` once proven."""
        run.offer(select(problem))
        run.bound = min(quick_bound(problem), run.best_cost)
        prices, unit, exact = _whole_prices(problem.prices)
        model, x = _model(problem, prices)
        while (reached := run.limit()) is None:
            status, bound = self._search(model, x, run)
            if status is Status.INFEASIBLE:
                return status
            bound *= unit if exact else unit * (1.0 - _ROUNDING)
            run.bound = max(run.bound, min(bound, run.best_cost))
            if status is Status.OPTIMAL:  # of the whole prices
                close = run.bound >= run.best_cost * (1.0 - _PROVEN)
                return status if exact or close else Status.FEASIBLE
        run.stop_reason = reached
        return Status.UNKNOWN

    def _search(self, model: Any, x: list[Any], run: Run[Chosen]) -> tuple[Status, float]:
        """One search from the best cover so far: its status, and its bound in whole prices."""
        from ortools.sat.python import cp_model

        before, left = run.iteration, run.patience
        last = before + left
        model.clear_hints()
        if run.best is not None:
            taken = np.isin(np.arange(len(x)), run.best)
            for chosen, value in zip(x, taken.tolist(), strict=True):
                model.add_hint(chosen, value)
        solver = cp_model.CpSolver()
        limits = solver.parameters
        limits.random_seed = run.seed % 2**31
        limits.num_workers = self.workers
        limits.interleave_search = True
        limits.catch_sigint_signal = False
        limits.max_deterministic_time = min(_ENDLESS, left * _STRIDE)
        limits.max_time_in_seconds = min(_ENDLESS, run.remaining)

        def on_solution(search: Any) -> None:
            at = before + math.ceil(search.deterministic_time / _STRIDE)
            run.iteration = int(min(last, max(run.iteration, at)))
            run.offer(np.flatnonzero([search.boolean_value(chosen) for chosen in x]))

        listener = _listener(on_solution, run)
        status = heedful(lambda: solver.solve(model, listener), solver.stop_search)
        if listener.failure is not None:
            raise listener.failure
        at = before + math.ceil(solver.response_proto.deterministic_time / _STRIDE)
        run.iteration = int(min(last, max(run.iteration, at)))
        if status == cp_model.OPTIMAL:
            return Status.OPTIMAL, solver.best_objective_bound
        if status == cp_model.INFEASIBLE:
            return Status.INFEASIBLE, math.inf
        if run.limit() is None:  # ended by itself within a rounding of its limit
            run.iteration = int(min(last, before + left)) if math.isfinite(left) else run.iteration
        return Status.UNKNOWN, solver.best_objective_bound


def _listener(heard: Callable[[Any], None], run: Run[Chosen]) -> Any:
    """Callback of CP-SAT that keeps an exception for later and ends the search at a target."""
    from ortools.sat.python import cp_model

    class Listener(cp_model.CpSolverSolutionCallback):  # type: ignore[misc]  # an untyped class
        """Hears of every solution."""

        failure: BaseException | None = None

        def on_solution_callback(self) -> None:
            """Hear of one; no exception may cross the C++ frames below."""
            try:
                heard(self)
                reached = run.limit() is StopReason.TARGET
            except BaseException as failure:
                self.failure, reached = failure, True
            if reached:
                self.stop_search()

    return Listener()


def _whole_prices(prices: Floats) -> tuple[Ints, float, bool]:
    """Prices in whole units, never above the true ones; the unit; whether they are the same."""
    unit = price_unit(prices)
    if unit is not None and prices.sum() / unit < 2.0 * _LARGEST:
        return np.rint(prices / unit).astype(np.int64), unit, True
    if not prices.any():
        return np.zeros(len(prices), dtype=np.int64), 1.0, True
    unit = float(prices.sum()) / _LARGEST
    return np.floor(prices / unit).astype(np.int64), unit, False


def _model(problem: CoverProblem, prices: Ints) -> tuple[Any, list[Any]]:
    """Model and its variables: whether each set is chosen."""
    from ortools.sat.python import cp_model

    model = cp_model.CpModel()
    x = [model.new_bool_var("") for _ in range(problem.sets)]
    rows = problem.covers.T.tocsr()
    wanted = np.maximum(problem.demand, np.minimum(problem.sector_demand, 1))
    for element in np.flatnonzero(wanted).tolist():
        _at_least(model, _members(rows, element, x), int(wanted[element]))
    for group in problem.conflicts:
        model.add_at_most_one([x[j] for j in group])
    if (problem.sector_demand > 1).any():
        hits_of_pair, pairs_of_element, needed = sector_rows(problem)
        y = [model.new_bool_var("") for _ in range(hits_of_pair.shape[0])]
        for pair, seen in enumerate(y):
            model.add_at_least_one([*_members(hits_of_pair, pair, x), ~seen])
        for wish, need in enumerate(needed.tolist()):
            _at_least(model, _members(pairs_of_element, wish, y), need)
    model.minimize(cp_model.LinearExpr.weighted_sum(x, prices.tolist()))
    return model, x


def _members(rows: Any, row: int, variables: list[Any]) -> list[Any]:
    columns = rows.indices[rows.indptr[row] : rows.indptr[row + 1]]
    return [variables[column] for column in columns.tolist()]


def _at_least(model: Any, literals: list[Any], number: int) -> None:
    if number == 1:
        model.add_at_least_one(literals)
    else:
        model.add(sum(literals) >= number)
