"""Greedy multi-cover with removal of what turned out redundant."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.arrays import Floats, read_only
from solvers.cover.bounds import quick_bound
from solvers.cover.problem import Chosen, CoverProblem
from solvers.cover.rows import rivals_of
from solvers.result import Status
from solvers.run import Run


@dataclass(frozen=True, slots=True)
class Greedy:
    """Take the set that fills the most open demand for its price, again and again.

    Chvatal's heuristic (1979, doi:10.1287/moor.4.3.233) for multi-cover: without conflicts
    within ``1 + ln(largest set)`` of the optimum. Open demand counts missing hits and missing
    sectors alike. Ties go to the lowest index; the only iteration is the whole selection.
    A lower bound comes with it (:func:`solvers.cover.bounds.quick_bound`).

    Parameters
    ----------
    pruned
        Whether to drop, dearest and latest first, the sets that later ones made redundant.

    """

    pruned: bool = True
    name: ClassVar[str] = "greedy"
    requires: ClassVar[tuple[str, ...]] = ("numba", "scipy")

    def run(self, problem: CoverProblem, run: Run[Chosen]) -> Status:
        """Offer the greedy selection; ``UNKNOWN`` if conflicts led into a dead end."""
        if run.proceed():
            run.offer(select(problem, pruned=self.pruned))
            run.bound = quick_bound(problem)
        return Status.FEASIBLE if run.best is not None else Status.UNKNOWN


def select(problem: CoverProblem, prices: Floats | None = None, *, pruned: bool = True) -> Chosen:
    """Greedy selection, for other solvers to start from; no cover if conflicts prevent it.

    It may go by other ``prices`` than those of the problem, shape (sets,), but prunes by
    the problem's own.
    """
    from solvers.cover import kernels

    none = read_only(np.zeros(1, dtype=np.int16))  # read-only as the real ones: one compilation
    sectors = none if problem.sectors is None else problem.sectors
    hit_arrays = (problem.indptr, problem.indices, sectors)
    wants = (problem.demand, problem.sector_demand)
    asked = problem.prices if prices is None else read_only(prices)
    order, hits, seen = kernels.choose(
        *hit_arrays, asked, *wants, problem.sector_count, *rivals_of(problem)
    )
    if pruned:
        last_first = order[::-1]
        dearest_first = last_first[np.argsort(-problem.prices[last_first], kind="stable")]
        kept = kernels.prune(dearest_first, *hit_arrays, *wants, hits, seen)
        order = dearest_first[kept]
    return np.sort(order)
