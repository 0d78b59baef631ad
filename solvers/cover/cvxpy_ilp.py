"""Exact multi-cover as an integer programme, through cvxpy."""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from solvers.cover.bounds import provable
from solvers.cover.greedy import select
from solvers.cover.problem import Chosen, CoverProblem
from solvers.cover.sector_rows import sector_rows
from solvers.errors import InvalidProblem
from solvers.interruptible import heedful
from solvers.parameters import check_number
from solvers.result import Status, StopReason
from solvers.run import Run
from solvers.stop import Stop

_PROVEN = 1e-8  # relative gap that rounding leaves in a proof


@dataclass(frozen=True, slots=True)
class CvxpyILP:
    r"""Minimise ``prices @ x`` subject to ``covers.T @ x >= demand``, x binary.

    Sectors enter through :math:`y_{es} \le \sum_{j \ni e, s_{je}=s} x_j`,
    :math:`0 \le y \le 1`, :math:`\sum_s y_{es} \ge m_e`; y may stay continuous, since its
    largest value is whole once x is. Conflicts are one row a group. The greedy selection
    is offered first, since HiGHS may run into a limit before it has any. An iteration is
    a node of the branch-and-bound tree.

    Parameters
    ----------
    backend
        Name of a mixed-integer solver that cvxpy knows. Limits on iterations, stall and target,
        and the dual bound of an unfinished run, are known for HiGHS alone; how to say seconds
        to those in :data:`SECONDS`.
    gap
        Relative gap at which HiGHS may stop, at least 0. The status is ``OPTIMAL`` only where
        its bound, rounded up to what prices can sum to, reaches the cost.

    """

    backend: str = "HIGHS"
    gap: float = 0.0
    name: ClassVar[str] = "cvxpy"
    requires: ClassVar[tuple[str, ...]] = ("cvxpy", "highspy", "numba", "scipy")
    exact: ClassVar[bool] = True
    default_stop: ClassVar[Stop] = Stop()

    def __post_init__(self) -> None:
        check_number(self, "gap", most=1.0)

    def run(self, problem: CoverProblem, run: Run[Chosen]) -> Status:
        """Offer the optimum, or the incumbent at the limit."""
        import cvxpy as cp  # heavy; only when this solver runs

        run.offer(select(problem))
        if (reached := run.limit()) is not None:
            run.stop_reason = reached
            return Status.UNKNOWN
        x = cp.Variable(problem.sets, boolean=True)
        constraints = _constraints(problem, x)
        dear = np.flatnonzero(problem.prices > run.best_cost)  # in no better cover
        if len(dear):
            constraints.append(x[dear] == 0)
        prices = np.where(problem.prices > run.best_cost, 0.0, problem.prices)
        scale = float(prices.max()) or 1.0  # back ends have absolute tolerances
        programme = cp.Problem(cp.Minimize(prices / scale @ x), constraints)
        options = self._options(run, scale)
        with _models_of_highs() as models:
            heedful(
                lambda: _solve(programme, self.backend, options),
                lambda: [model.cancelSolve() for model in models],
            )

        status = programme.status
        info = getattr(programme.solver_stats, "extra_stats", None)
        run.iteration = max(run.iteration, int(getattr(info, "mip_node_count", 0)))
        if status in (cp.INFEASIBLE, cp.settings.INFEASIBLE_OR_UNBOUNDED) and run.best is None:
            return Status.INFEASIBLE
        if x.value is not None:  # at a limit it may be all zero, which `offer` refuses
            run.offer(np.flatnonzero(x.value > 0.5))
        bound = getattr(info, "mip_dual_bound", None)
        if bound is not None and np.isfinite(bound):
            run.bound = min(provable(problem.prices, scale * float(bound)), run.best_cost)
            proven = run.bound >= run.best_cost * (1.0 - _PROVEN)
        else:
            proven = status == cp.OPTIMAL  # by the word of the back end
        if status == cp.OPTIMAL:
            return Status.OPTIMAL if proven else Status.FEASIBLE
        run.stop_reason = run.limit() or StopReason.STALL
        return Status.FEASIBLE

    def _options(self, run: Run[Chosen], scale: float) -> dict[str, Any]:
        """Limits in the words of the back end."""
        name, stop = self.backend.upper(), run.stop
        limits: dict[str, Any] = {}
        if name == "HIGHS":
            limits = {"mip_rel_gap": self.gap, "mip_abs_gap": 0.0, "random_seed": run.seed % 2**31}
            if stop.iterations is not None:
                limits["mip_max_nodes"] = stop.iterations
            if stop.stall is not None:
                limits["mip_max_stall_nodes"] = stop.stall
            if stop.target is not None:
                limits["objective_target"] = stop.target / scale
        elif stop.limits - {"seconds"}:
            unknown = " and ".join(sorted(stop.limits - {"seconds"}))
            raise InvalidProblem(f"no limit on {unknown} is known for the back end {name}.")
        if stop.seconds is not None:
            if name not in SECONDS:
                raise InvalidProblem(
                    f"no limit on seconds is known for the back end {name}; it is for "
                    f"{', '.join(SECONDS)}."
                )
            limits |= SECONDS[name](run.remaining)
        return limits


SECONDS: dict[str, Callable[[float], dict[str, Any]]] = {
    "HIGHS": lambda seconds: {"time_limit": seconds},
    "SCIPY": lambda seconds: {"scipy_options": {"time_limit": seconds}},
    "SCIP": lambda seconds: {"scip_params": {"limits/time": seconds}},
    "CBC": lambda seconds: {"maximumSeconds": max(1, round(seconds))},
    "GLPK_MI": lambda seconds: {"tm_lim": max(1, round(1000.0 * seconds))},
    "GUROBI": lambda seconds: {"TimeLimit": seconds},
    "CPLEX": lambda seconds: {"cplex_params": {"timelimit": seconds}},
}
"""Back end -> its options for a limit on seconds."""


@contextmanager
def _models_of_highs() -> Iterator[list[Any]]:
    """Every model of HiGHS that cvxpy makes meanwhile, made so that it can be told to stop.

    cvxpy hands out none of its models, and HiGHS itself does not listen for Ctrl-C.
    """
    import highspy

    models: list[Any] = []
    plain: Any = highspy.Highs

    class Watched(plain):  # type: ignore[misc]  # what it is, is known at run time
        """A model that is remembered."""

        def __init__(self) -> None:
            super().__init__()
            self.HandleUserInterrupt = True
            models.append(self)

    highspy.Highs = Watched
    try:
        yield models
    finally:
        highspy.Highs = plain


def _solve(programme: Any, backend: str, options: dict[str, Any]) -> None:
    """Solve; cvxpy warns at every limit, which the status says as well."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        programme.solve(solver=backend.upper(), **options)


def _constraints(problem: CoverProblem, x: Any) -> list[Any]:
    """Demand, sectors and conflicts as cvxpy constraints on the variable ``x``."""
    import cvxpy as cp
    from scipy.sparse import csr_array

    # One sector is the same as one hit, and needs no variables of its own.
    demand = np.maximum(problem.demand, np.minimum(problem.sector_demand, 1))
    wanting = np.flatnonzero(demand)
    rows = problem.covers.T.tocsr()[wanting].astype(np.float64)
    constraints = [rows @ x >= demand[wanting]]
    if (problem.sector_demand > 1).any():
        hits_of_pair, pairs_of_element, wanted = sector_rows(problem)
        y = cp.Variable(hits_of_pair.shape[0], bounds=[0.0, 1.0])
        constraints += [y <= hits_of_pair @ x, pairs_of_element @ y >= wanted]
    if problem.conflicts:
        owner = np.repeat(np.arange(len(problem.conflicts)), [len(g) for g in problem.conflicts])
        members = np.concatenate(problem.conflicts)
        shape = (len(problem.conflicts), problem.sets)
        constraints.append(csr_array((np.ones(len(owner)), (owner, members)), shape=shape) @ x <= 1)
    return constraints
