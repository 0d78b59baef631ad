"""Greedy choice by exact gains, with removal of what turned out needless."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from solvers.arrays import chosen_indices
from solvers.pairs.bounds import lower_bound
from solvers.pairs.problem import Chosen, PairCoverProblem
from solvers.result import Status
from solvers.run import Run

if TYPE_CHECKING:
    from solvers.pairs.state import State


@dataclass(frozen=True, slots=True)
class Greedy:
    """Add the candidate of most worth for its price, again and again, then drop the needless.

    Gains grow as candidates are added, since every new one pairs with all the chosen ones: they
    are kept up to date exactly, never bounded by old ones. Single hits earn nothing, and count
    by their nearness and facing to get the first pairs started. Starts from the warm start
    if there is one. Ties go to the lowest index; the only iteration is the whole choice.

    Parameters
    ----------
    start
        Candidates to start from where there is no warm start, such as the answer to a simpler
        question; it need not be a solution of this one.
    pruned
        Whether to drop, least loss first, what is not needed.
    bound_steps
        Steps of the search for a lower bound; 0 leaves it out.

    """

    start: tuple[int, ...] = ()
    pruned: bool = True
    bound_steps: int = 100
    name: ClassVar[str] = "greedy"
    requires: ClassVar[tuple[str, ...]] = ("numba", "scipy")

    def run(self, problem: PairCoverProblem, run: Run[Chosen]) -> Status:
        """Offer the greedy choice; ``UNKNOWN`` if conflicts led into a dead end."""
        if run.proceed():
            begin(problem, run, start=self.start, pruned=self.pruned)
            run.bound = lower_bound(problem, steps=self.bound_steps, upper=run.best_cost)
        return Status.FEASIBLE if run.best is not None else Status.UNKNOWN


def begin(
    problem: PairCoverProblem,
    run: Run[Chosen],
    *,
    start: tuple[int, ...] = (),
    pruned: bool = True,
) -> "State":
    """Make the greedy choice, offer it, and return its state for a search to go on from."""
    from solvers.pairs import search_kernels, state_kernels
    from solvers.pairs.state import empty_state

    state = empty_state(problem)
    given = np.array(start, dtype=np.int64) if run.initial is None else run.initial
    limit = np.inf if problem.budget is None else problem.budget
    state_kernels.adopt(state, np.array(chosen_indices(given, problem.candidates)), limit)
    wanted = problem.wanted if problem.budget is None else int(problem.reachable.sum())
    log = np.empty(problem.candidates + 1, dtype=np.int64)
    search_kernels.fill(state, wanted, limit, -1, log, 0)
    if pruned and problem.budget is None:
        search_kernels.prune(state, wanted)
    run.offer(np.flatnonzero(state.taken))
    return state
