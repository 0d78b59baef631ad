"""Local search with weights on unmet demand: a solver, and a polish for any other."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.arrays import Ints
from solvers.cover.bounds import quick_bound
from solvers.cover.greedy import select
from solvers.cover.problem import Chosen, CoverProblem
from solvers.cover.rows import Rivals, Rows, columns_of, rivals_of, rows_of
from solvers.parameters import check_whole
from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop

_LONG_AGO = -(2**40)  # step before any tenure
_TENURE = 3  # swaps for which a set that came in stays
_NEIGHBOURS, _RUINED = 25, 0.4  # sets freed at a time to recreate, share of them dropped first


@dataclass(frozen=True, slots=True)
class LocalSearch:
    """Row-weighting local search, then ruin and recreate, in turns.

    Begins with the greedy selection or a warm start. Drops sets until demand is unmet, then
    swaps: out goes the set whose loss weighs least for its price, in come sets that fill a
    randomly drawn need, as long as the choice stays cheaper than the best cover; what stays
    unmet gains weight (after Gao, Weise and Li, 2015, doi:10.1016/j.ejor.2015.05.038; here
    with demand, sectors, prices and conflicts, and weight for one need at a time). When
    that stalls, it searches again in one neighbourhood of the best cover after the other,
    which is what goes on improving large ones. An iteration is ``steps`` swaps.

    Parameters
    ----------
    steps
        Swaps in an iteration, at least 1.
    patience
        Iterations without a better cover after which the other way gets its turn, at least 1;
        ten more for each hundred sets chosen.

    """

    steps: int = 1000
    patience: int = 20
    name: ClassVar[str] = "local-search"
    requires: ClassVar[tuple[str, ...]] = ("numba", "scipy")
    default_stop: ClassVar[Stop] = Stop(iterations=1000, stall=200)

    def __post_init__(self) -> None:
        check_whole(self, steps=1, patience=1)

    def run(self, problem: CoverProblem, run: Run[Chosen]) -> Status:
        """Offer ever cheaper covers until a limit ends it; bounded as ``greedy`` is."""
        start = select(problem) if run.best is None else run.best
        run.offer(start)
        run.bound = quick_bound(problem)
        search = Search(rows_of(problem), rivals_of(problem), steps=self.steps)
        while not proven(run):
            patience = self.patience + len(start) // 10
            search.begin(start if run.best is None else run.best)
            if not search.descend(run, patience) or not search.renew(run, patience):
                break
        return Status.OPTIMAL if proven(run) else Status.FEASIBLE


def proven(run: Run[Chosen]) -> bool:
    """Whether the bound has reached the best cover, or shows that there is none."""
    return run.best_cost <= run.bound + 1e-9 * abs(run.bound)


class Search:
    """A local search under way on some of the sets; see :class:`LocalSearch` for the method.

    Parameters
    ----------
    rows, rivals
        The problem, or its part with the sets ``sets``.
    sets
        What they are called in the problem; all of them if left out.
    steps
        Swaps in an iteration.

    """

    def __init__(
        self, rows: Rows, rivals: Rivals, *, sets: Ints | None = None, steps: int = 1000
    ) -> None:
        self._rows, self._rivals, self._steps = rows, rivals, steps
        self._columns = columns_of(rows)
        self._sets = np.arange(len(rows.prices)) if sets is None else sets
        self._best = np.empty(len(rows.prices), dtype=np.int64)

    def begin(self, chosen: Ints) -> None:
        """Forget all weights and start from these of ``sets``; demand may be unmet."""
        from solvers.cover import state_kernels

        rows, columns = self._rows, self._columns
        sets, plain = len(rows.prices), int(rows.group_starts[0])
        groups = len(rows.group_wanted)
        place = np.empty(len(columns.entries), dtype=np.int32)
        place[columns.entries] = np.arange(len(place))
        group = np.full(len(rows.wanted), -1, dtype=np.int32)
        group[plain:] = np.repeat(np.arange(groups), np.diff(rows.group_starts))
        needs = np.arange(plain + groups, dtype=np.int32)
        self._state = state_kernels.State(
            chosen=np.zeros(sets, dtype=np.bool_),
            picks=np.zeros(sets, dtype=np.int32),
            slot=np.zeros(sets, dtype=np.int32),
            score=np.diff(rows.starts).astype(np.int64),
            stamp=np.full(sets, _LONG_AGO, dtype=np.int64),
            fresh=np.ones(sets, dtype=np.bool_),
            sets=columns.sets.copy(),
            entries=columns.entries.copy(),
            place=place,
            hits=np.zeros(len(rows.wanted), dtype=np.int32),
            distinct=np.zeros(groups, dtype=np.int32),
            group=group,
            weight=np.ones(len(needs), dtype=np.int64),
            open=needs,
            spot=needs.copy(),
            size=np.array([0, len(needs), 0], dtype=np.int64),
        )
        for j in np.searchsorted(self._sets, chosen):  # few: the chosen sets
            state_kernels.add(rows, columns, self._state, j)

    def descend(self, run: Run[Chosen], patience: int) -> bool:
        """Swap until nothing better is found for so long; whether the run may go on."""
        waited = 0
        while waited < patience and not proven(run):
            if not run.proceed():
                return False
            better = self.improve(self._steps, below=run.best_cost, rng=run.rng)
            waited = 0 if better is not None and run.offer(better) else waited + 1
        return True

    def renew(self, run: Run[Chosen], patience: int) -> bool:
        """Ruin and recreate the best cover for so long; whether the run may go on."""
        from solvers.cover import search_kernels

        waited = 0
        if run.best is None:
            return True
        self.begin(run.best)
        while waited < patience and not proven(run):
            if not run.proceed():
                return False
            saved = search_kernels.renew(
                self._rows,
                self._columns,
                self._rivals,
                self._state,
                _NEIGHBOURS,
                _RUINED,
                self._steps,
                _TENURE,
                run.rng,
            )
            chosen = self._sets[self._state.chosen]
            waited = 0 if saved > 0.0 and run.offer(chosen) else waited + 1
        return True

    def improve(self, steps: int, *, below: float, rng: np.random.Generator) -> Ints | None:
        """Go on for that many swaps; cheapest cover found below that price, if any."""
        from solvers.cover import search_kernels

        count = search_kernels.search(
            self._rows,
            self._columns,
            self._rivals,
            self._state,
            steps,
            below,
            _TENURE,
            rng,
            self._best,
        )
        return np.sort(self._sets[self._best[:count]]) if count else None


def polish(
    problem: CoverProblem, chosen: Chosen, *, steps: int, rng: np.random.Generator
) -> Chosen:
    """Cheaper cover by local search from a selection, or the selection if none is found.

    Parameters
    ----------
    problem
        Any cover problem.
    chosen
        Indices of distinct sets without conflicts; demand may be unmet, and is met then if
        the search can.
    steps
        Swaps, at least 1.
    rng
        Source of chance.

    """
    search = Search(rows_of(problem), rivals_of(problem))
    search.begin(chosen)
    met = (problem.coverage(chosen) >= problem.demand).all() and (
        problem.sector_coverage(chosen) >= problem.sector_demand
    ).all()
    below = float(problem.prices[chosen].sum()) if met else np.inf
    better = search.improve(steps, below=below, rng=rng)
    return chosen if better is None else better
