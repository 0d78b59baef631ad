"""Large-neighbourhood search: take out a few neighbours, add again by exact gain."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.pairs.bounds import lower_bound
from solvers.pairs.greedy import begin
from solvers.pairs.problem import Chosen, PairCoverProblem
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop

_BATCH = 16  # iterations between two looks at the clock


@dataclass(frozen=True, slots=True)
class LargeNeighbourhood:
    """Ruin and recreate (Shaw, 1998, doi:10.1007/3-540-49481-2_30) below the best price.

    Whenever the target holds, the choice is offered and the candidate whose loss is least is
    dropped. From then on each iteration takes out one to ``most`` chosen neighbours, adds
    others by exact gain as far as the lower price allows, and is undone if the choice is
    worth less than before. With a budget nothing is dropped, and the worth rises until
    everything in reach is satisfied.

    Parameters
    ----------
    start
        As in :class:`~solvers.pairs.greedy.Greedy`.
    most
        Most candidates taken out in one iteration, at least 1.
    bound_steps
        Steps of the search for a lower bound; 0 leaves it out.

    """

    start: tuple[int, ...] = ()
    most: int = 5
    bound_steps: int = 100
    name: ClassVar[str] = "lns"
    requires: ClassVar[tuple[str, ...]] = ("numba", "scipy")
    default_stop: ClassVar[Stop] = Stop(iterations=1000)

    def run(self, problem: PairCoverProblem, run: Run[Chosen]) -> Status:
        """Offer every choice that is better than all before."""
        from solvers.pairs import search_kernels

        state = begin(problem, run, start=self.start)
        run.bound = lower_bound(problem, steps=self.bound_steps, upper=run.best_cost)
        if run.best is None:
            return Status.UNKNOWN
        lean = problem.budget is None
        wanted = problem.wanted if lean else int(problem.reachable.sum())
        best = state.taken.copy()
        limit = search_kernels.drop(state, wanted, best) if lean else float(problem.budget or 0.0)
        while run.best_cost > run.bound:
            allowed = sum(run.proceed() for _ in range(_BATCH) if run.limit() is None)
            if not allowed:
                run.proceed()  # says why it ends
                break
            dice = run.rng.random((allowed, 4))
            before = limit
            limit = search_kernels.improve(state, dice, self.most, wanted, limit, lean, best)
            if limit < before or not lean:
                run.offer(np.flatnonzero(best if lean else state.taken))
        return Status.FEASIBLE
