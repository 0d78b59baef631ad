"""Lagrangian heuristic: multipliers give a bound, good starts and a small core to search."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.arrays import Floats, Ints
from solvers.cover.ascent import Ascent
from solvers.cover.bounds import price_unit, provable
from solvers.cover.greedy import select
from solvers.cover.local_search import Search, proven
from solvers.cover.problem import Chosen, CoverProblem
from solvers.cover.rows import restricted, restricted_rivals, rivals_of, rows_of
from solvers.parameters import check_number, check_whole
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop

_BATCH = 5e7  # entries that the ascent looks at between two glances at the clock
_FREE = 1e-3  # share of its price that a set of reduced cost 0 still costs the greedy
_ROUNDING = 1e-6  # relative
_SPARE = 5  # sets that a row of the core has to choose from, over its demand


@dataclass(frozen=True, slots=True)
class Lagrangian:
    """Bound by multipliers, then search what they leave, from one perturbed start after another.

    In the line of Caprara, Fischetti and Toth (1999, doi:10.1287/opre.47.5.730). The
    multipliers of :class:`solvers.cover.ascent.Ascent` prove a lower bound and give reduced
    costs. Sets whose reduced cost is above the gap are in no better cover, and go. In each
    round the multipliers are perturbed; a greedy by their reduced costs, pruned, is the start of a
    local search on the core of sets that they make cheap, followed by ruin and recreate of
    the best cover (:class:`solvers.cover.local_search.LocalSearch`). It ends when the bound
    is reached. An iteration is ``steps`` swaps.

    Parameters
    ----------
    steps
        Swaps in an iteration, at least 1.
    patience
        Iterations without a better cover after which a search gives up, at least 1; ten more
        for each hundred sets chosen.
    noise
        Largest share by which a multiplier is perturbed, in [0, 1].
    ascent
        Most steps of the ascent, at least 1.

    """

    steps: int = 1000
    patience: int = 20
    noise: float = 0.1
    ascent: int = 2000
    name: ClassVar[str] = "lagrangian"
    requires: ClassVar[tuple[str, ...]] = ("numba", "scipy")
    default_stop: ClassVar[Stop] = Stop(iterations=1000, stall=200)

    def __post_init__(self) -> None:
        check_whole(self, steps=1, patience=1, ascent=1)
        check_number(self, "noise", most=1.0)

    def run(self, problem: CoverProblem, run: Run[Chosen]) -> Status:
        """Offer ever cheaper covers until one is proven best or a limit ends it."""
        run.offer(select(problem))
        rows, rivals = rows_of(problem), rivals_of(problem)
        ascent = Ascent(rows)
        while not ascent.done and ascent.taken < self.ascent and run.limit() is None:
            ascent.climb(work=_BATCH, steps=self.ascent - ascent.taken)
            run.bound = provable(problem.prices, ascent.bound)
        multipliers, proof = ascent.multipliers, ascent.reduced_at(ascent.multipliers)
        while not proven(run):
            reduced = ascent.reduced_at(multipliers)
            start = _greedy_by(reduced, problem)
            run.offer(start)
            sets = self._core(problem, run, ascent, reduced, proof)
            sets = np.union1d(sets, start)
            search = Search(
                restricted(rows, sets),
                restricted_rivals(rivals, sets),
                sets=sets,
                steps=self.steps,
            )
            search.begin(start)
            patience = self.patience + len(start) // 10
            if not search.descend(run, patience) or not search.renew(run, patience):
                break
            shake = run.rng.uniform(-self.noise, self.noise, len(multipliers))
            multipliers = ascent.multipliers * (1.0 + shake)
        return Status.OPTIMAL if proven(run) else Status.FEASIBLE

    def _core(
        self,
        problem: CoverProblem,
        run: Run[Chosen],
        ascent: Ascent,
        reduced: Floats,
        proof: Floats,
    ) -> Ints:
        """Sets to search in: the best cover, and cheap ones that may be in a better cover."""
        if run.best is None:
            return np.arange(problem.sets)  # with conflicts, a core may have no cover
        better = run.best_cost - (price_unit(problem.prices) or 0.0)
        useful = proof <= better - ascent.bound + _ROUNDING * abs(ascent.bound)
        return np.union1d(np.flatnonzero(ascent.core(reduced, _SPARE) & useful), run.best)


def _greedy_by(reduced: Floats, problem: CoverProblem) -> Chosen:
    """Greedy selection by reduced costs, with little to tell apart what costs nothing."""
    prices = problem.prices
    return select(
        problem, np.maximum(reduced, _FREE * np.maximum(prices, _ROUNDING * prices.max()))
    )
