"""Compiled loops of the local search; import only where a solver runs."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.cover.rows import Columns, Rivals, Rows
from solvers.cover.state_kernels import State, add, drop, weigh

Array = NDArray[Any]


@compiled
def _least_missed(state: State, per_price: Array, before: int) -> int:
    """Set of least score for its price, moved before that step; the oldest of them."""
    least, low = -1, np.inf
    for k in range(state.size[0]):
        j = state.picks[k]
        if state.stamp[j] >= before:
            continue
        worth = state.score[j] * per_price[j]
        if worth < low or (worth == low and state.stamp[j] < state.stamp[least]):
            least, low = j, worth
    return least


@compiled
def _rivals_of(rivals: Rivals, state: State, j: int, found: Array) -> int:
    """Chosen sets that conflict with set ``j``, into ``found``; how many, or -1 if one stays."""
    count = 0
    for g in range(rivals.starts[j], rivals.starts[j + 1]):
        clique = rivals.groups[g]
        for at in range(rivals.group_starts[clique], rivals.group_starts[clique + 1]):
            i = rivals.members[at]
            if i != j and state.chosen[i]:
                if state.slot[i] < 0:
                    return -1
                if not (found[:count] == i).any():
                    found[count] = i
                    count += 1
    return count


@compiled
def _best_in(
    state: State,
    rivals: Rivals,
    per_price: Array,
    start: int,
    end: int,
    best: int,
    high: float,
    found: Array,
) -> tuple[int, float]:
    """Fresh set in these places that fills the most weight for its price, or ``best``."""
    for at in range(start, end):
        j = state.sets[at]
        if not state.fresh[j]:
            continue
        worth = state.score[j] * per_price[j]
        if rivals.starts[j + 1] > rivals.starts[j]:
            ousted = _rivals_of(rivals, state, j, found)
            if ousted < 0:
                continue
            for k in range(ousted):
                worth -= state.score[found[k]] * per_price[j]
        if best < 0 or worth > high or (worth == high and state.stamp[j] < state.stamp[best]):
            best, high = j, worth
    return best, high


@compiled
def _best_for(
    rows: Rows,
    columns: Columns,
    state: State,
    rivals: Rivals,
    per_price: Array,
    need: int,
    found: Array,
) -> int:
    """Fresh set that fills a need and the most weight for its price, or -1."""
    plain = rows.group_starts[0]
    if need < plain:
        start, end = columns.starts[need] + state.hits[need], columns.starts[need + 1]
        return _best_in(state, rivals, per_price, start, end, -1, 0.0, found)[0]
    g, best, high = need - plain, -1, 0.0
    for r in range(rows.group_starts[g], rows.group_starts[g + 1]):
        if state.hits[r] == 0:
            start, end = columns.starts[r], columns.starts[r + 1]
            best, high = _best_in(state, rivals, per_price, start, end, best, high, found)
    return best


@compiled
def search(
    rows: Rows,
    columns: Columns,
    rivals: Rivals,
    state: State,
    steps: int,
    limit: float,
    tenure: int,
    rng: np.random.Generator,
    best: Array,
) -> int:
    """Row-weighting local search for choices cheaper than ``limit``; how many sets in the best.

    Only ``state.picks`` and what comes in may be dropped; ``limit`` is for their price. The
    cheapest choice stands in the front of ``best``; 0 sets if there is none.
    """
    per_price = 1.0 / np.maximum(rows.prices, 1e-9 * max(rows.prices.max(), 1e-300))
    found = np.empty(len(rows.prices), np.int64)
    total, count = 0.0, 0
    for k in range(state.size[0]):
        total += rows.prices[state.picks[k]]
    for _ in range(steps):
        state.size[2] += 1
        now = state.size[2]
        while state.size[1] == 0:
            if total < limit * (1.0 - 1e-9):
                count = state.size[0]
                best[:count] = state.picks[:count]
                limit = 0.0
                for k in range(count):
                    limit += rows.prices[best[k]]
                total = limit
            j = _least_missed(state, per_price, now + 1)
            if j < 0:
                return count
            drop(rows, columns, state, j)
            total -= rows.prices[j]
        j = _least_missed(state, per_price, now - tenure)
        if j >= 0:
            drop(rows, columns, state, j)
            total -= rows.prices[j]
        for _ in range(len(rows.prices)):  # rivals may oust each other for ever
            if state.size[1] == 0:
                break
            need = state.open[int(rng.random() * state.size[1])]
            j = _best_for(rows, columns, state, rivals, per_price, need, found)
            if j < 0:
                break
            price, ousted = rows.prices[j], 0
            if rivals.starts[j + 1] > rivals.starts[j]:
                ousted = _rivals_of(rivals, state, j, found)
                for k in range(ousted):
                    price -= rows.prices[found[k]]
            if total + price >= limit * (1.0 - 1e-9):
                break
            for k in range(ousted):
                drop(rows, columns, state, found[k])
            add(rows, columns, state, j)
            total += price
            if state.size[1] > 0:
                weigh(rows, columns, state, state.open[int(rng.random() * state.size[1])], 1)
    return count


@compiled
def _neighbours(
    rows: Rows, columns: Columns, state: State, size: int, rng: np.random.Generator, near: Array
) -> int:
    """Chosen sets around a random row, breadth first, into ``near``; returns how many."""
    seen = np.zeros(len(rows.wanted), np.bool_)
    queue = np.empty(len(rows.wanted), np.int32)
    queue[0] = int(rng.random() * len(queue))
    seen[queue[0]] = True
    head, tail, count = 0, 1, 0
    while head < tail and count < size:
        start = columns.starts[queue[head]]
        for at in range(start, start + state.hits[queue[head]]):
            j = state.sets[at]
            if count < size and not (near[:count] == j).any():
                near[count] = j
                count += 1
                for entry in range(rows.starts[j], rows.starts[j + 1]):
                    r = rows.rows[entry]
                    if not seen[r]:
                        seen[r] = True
                        queue[tail] = r
                        tail += 1
        head += 1
    return count


@compiled
def renew(
    rows: Rows,
    columns: Columns,
    rivals: Rivals,
    state: State,
    size: int,
    share: float,
    steps: int,
    tenure: int,
    rng: np.random.Generator,
) -> float:
    """Ruin and recreate a cover around a random place; by how much its price fell.

    Frees ``size`` neighbouring sets of the cover in ``state``, drops a ``share`` of them at
    random and searches for ``steps``. A cover as cheap or cheaper replaces the old one,
    so that it drifts; weights start from 1 and are 1 again in the end.
    """
    total = state.size[0]
    everything, best = state.picks[:total].copy(), np.empty(len(rows.prices), np.int64)
    near = np.empty(size, np.int32)
    freed = _neighbours(rows, columns, state, size, rng, near)
    state.slot[everything] = -1
    old, new = 0.0, 0.0
    for k in range(freed):
        state.picks[k] = near[k]
        state.slot[near[k]] = k
        old += rows.prices[near[k]]
    state.size[0] = freed
    for k in range(freed):
        if rng.random() < share:
            drop(rows, columns, state, near[k])
    limit = old + 2e-9 * abs(old)  # as cheap will do
    count = search(rows, columns, rivals, state, steps, limit, tenure, rng, best)
    if count == 0:
        count = freed
        best[:count] = near[:count]
    _restore(rows, columns, state, best[:count])
    for need in range(len(state.weight)):
        if state.weight[need] > 1:
            weigh(rows, columns, state, need, 1 - state.weight[need])
    for k in range(count):
        new += rows.prices[best[k]]
    for j in everything:
        if state.chosen[j] and state.slot[j] < 0:
            state.picks[state.size[0]] = j
            state.slot[j] = state.size[0]
            state.size[0] += 1
    return old - new


@compiled
def _restore(rows: Rows, columns: Columns, state: State, wanted: Array) -> None:
    """Make these sets the ones in ``picks``."""
    keep = np.zeros(len(rows.prices), np.bool_)
    for j in wanted:
        keep[j] = True
    k = 0
    while k < state.size[0]:
        if keep[state.picks[k]]:
            k += 1
        else:
            drop(rows, columns, state, state.picks[k])
    for j in wanted:
        if not state.chosen[j]:
            add(rows, columns, state, j)
