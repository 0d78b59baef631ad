"""Exact multi-cover as an integer programme, through cvxpy."""

import warnings
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from solvers.cover.greedy import select
from solvers.cover.problem import Chosen, CoverProblem
from solvers.cover.sector_rows import sector_rows
from solvers.result import Status, StopReason
from solvers.run import Run
from solvers.stop import Stop


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
        Name of a mixed-integer solver that cvxpy knows. Limits other than seconds, and
        the dual bound of an unfinished run, are known for HiGHS alone.
    gap
        Relative gap at which the solution counts as optimal, at least 0.

    """

    backend: str = "HIGHS"
    gap: float = 1e-6
    name: ClassVar[str] = "cvxpy"
    requires: ClassVar[tuple[str, ...]] = ("cvxpy", "highspy", "numba", "scipy")
    exact: ClassVar[bool] = True
    default_stop: ClassVar[Stop] = Stop()

    def run(self, problem: CoverProblem, run: Run[Chosen]) -> Status:
        """Offer the optimum, or the incumbent at the limit."""
        import cvxpy as cp  # heavy; only when this solver runs

        run.offer(select(problem))
        if (reached := run.limit()) is not None:
            run.stop_reason = reached
            return Status.UNKNOWN
        x = cp.Variable(problem.sets, boolean=True)
        scale = float(problem.prices.max()) or 1.0  # back ends have absolute tolerances
        cheapest = cp.Minimize(problem.prices / scale @ x)
        programme = cp.Problem(cheapest, _constraints(problem, x))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # cvxpy warns at every limit; the status says it
            programme.solve(solver=self.backend, **self._options(run, scale))

        status = programme.status
        info = getattr(programme.solver_stats, "extra_stats", None)
        run.iteration = max(run.iteration, int(getattr(info, "mip_node_count", 0)))
        if status in (cp.INFEASIBLE, cp.settings.INFEASIBLE_OR_UNBOUNDED):
            return Status.INFEASIBLE
        if x.value is not None:  # at a limit it may be all zero, which `offer` refuses
            run.offer(np.flatnonzero(x.value > 0.5))
        bound = getattr(info, "mip_dual_bound", None)
        if bound is not None and np.isfinite(bound):
            run.bound = min(scale * float(bound), run.best_cost)
        if status == cp.OPTIMAL:
            return Status.OPTIMAL
        run.stop_reason = run.limit() or StopReason.STALL
        return Status.FEASIBLE

    def _options(self, run: Run[Chosen], scale: float) -> dict[str, Any]:
        """Limits in the words of the back end."""
        limits: dict[str, Any] = {}
        if self.backend == "HIGHS":
            limits = {"mip_rel_gap": self.gap, "random_seed": run.seed % 2**31}
            if np.isfinite(run.remaining):
                limits["time_limit"] = run.remaining
            if run.stop.iterations is not None:
                limits["mip_max_nodes"] = run.stop.iterations
            if run.stop.stall is not None:
                limits["mip_max_stall_nodes"] = run.stop.stall
            if run.stop.target is not None:
                limits["objective_target"] = run.stop.target / scale
        return limits


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
