"""Compiled inner loops of the cover solvers; import only where a solver runs."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]


@compiled
def _before(key: Array, heap: Array, a: int, b: int) -> bool:
    """Whether heap slot ``a`` goes before ``b``: larger key, then lower index."""
    i, j = heap[a], heap[b]
    return bool(key[i] > key[j] or (key[i] == key[j] and i < j))


@compiled
def _sink(key: Array, heap: Array, size: int, slot: int) -> None:
    while True:
        child = 2 * slot + 1
        if child >= size:
            return
        if child + 1 < size and _before(key, heap, child + 1, child):
            child += 1
        if not _before(key, heap, child, slot):
            return
        heap[slot], heap[child] = heap[child], heap[slot]
        slot = child


@compiled
def gain(
    j: int,
    indptr: Array,
    indices: Array,
    sectors: Array,
    need: Array,
    sector_need: Array,
    seen: Array,
) -> int:
    """How many units of open demand set ``j`` would fill."""
    total = 0
    for at in range(indptr[j], indptr[j + 1]):
        e = indices[at]
        if need[e] > 0:
            total += 1
        if sector_need[e] > 0 and seen[e, sectors[at]] == 0:
            total += 1
    return total


@compiled
def choose(
    indptr: Array,
    indices: Array,
    sectors: Array,
    prices: Array,
    demand: Array,
    sector_demand: Array,
    sector_count: int,
    group_ptr: Array,
    group: Array,
    rival_ptr: Array,
    rival: Array,
) -> tuple[Array, Array, Array]:
    """Lazy greedy: take the most demand for the price until all is met or nothing helps.

    The open demand is submodular, so that a set's old gain is an upper bound on its new
    one, and only the top of the heap needs to be looked at again (Minoux, 1978). Returns
    the sets in order of choice, the hits of each element, and its hits in each sector.
    """
    n, m = len(prices), len(demand)
    need, sector_need = demand.copy(), sector_demand.copy()
    hits = np.zeros(m, dtype=np.int32)
    seen = np.zeros((m, max(1, sector_count)), dtype=np.int32)
    open_demand = need.sum() + sector_need.sum()
    blocked = np.zeros(n, dtype=np.bool_)
    key = np.empty(n)
    heap = np.arange(n)
    for j in range(n):
        fill = gain(j, indptr, indices, sectors, need, sector_need, seen)
        key[j] = _worth(fill, prices[j])
    for slot in range(n // 2 - 1, -1, -1):
        _sink(key, heap, n, slot)

    order = np.empty(n, dtype=np.int64)
    taken, size = 0, n
    while open_demand > 0 and size > 0:
        j = heap[0]
        if not blocked[j]:
            old = key[j]
            fill = gain(j, indptr, indices, sectors, need, sector_need, seen)
            key[j] = _worth(fill, prices[j])
            if fill > 0 and key[j] < old:
                _sink(key, heap, size, 0)
                if heap[0] != j:
                    continue
            if fill > 0:
                order[taken] = j
                taken += 1
                for at in range(indptr[j], indptr[j + 1]):
                    e = indices[at]
                    hits[e] += 1
                    if need[e] > 0:
                        need[e] -= 1
                        open_demand -= 1
                    if sector_count > 0:
                        s = sectors[at]
                        if sector_need[e] > 0 and seen[e, s] == 0:
                            sector_need[e] -= 1
                            open_demand -= 1
                        seen[e, s] += 1
                for g in range(group_ptr[j], group_ptr[j + 1]):
                    for r in range(rival_ptr[group[g]], rival_ptr[group[g] + 1]):
                        blocked[rival[r]] = True
        size -= 1
        heap[0] = heap[size]
        _sink(key, heap, size, 0)
    return order[:taken], hits, seen


@compiled
def _worth(fill: int, price: float) -> float:
    if fill == 0:
        return -1.0
    return fill / price if price > 0.0 else np.inf


@compiled
def prune(
    order: Array,
    indptr: Array,
    indices: Array,
    sectors: Array,
    demand: Array,
    sector_demand: Array,
    hits: Array,
    seen: Array,
) -> Array:
    """Go through the chosen sets in this order and drop each one that is not needed.

    ``hits`` and ``seen`` are brought up to date. Returns which were kept, boolean.
    """
    kept = np.ones(len(order), dtype=np.bool_)
    directed = sector_demand.max() > 0 if len(sector_demand) else False
    distinct = np.zeros(len(demand), dtype=np.int32)
    if directed:
        for e in range(len(demand)):
            for s in range(seen.shape[1]):
                if seen[e, s] > 0:
                    distinct[e] += 1
    for k in range(len(order)):
        j = order[k]
        needed = False
        for at in range(indptr[j], indptr[j + 1]):
            e = indices[at]
            if hits[e] <= demand[e] and demand[e] > 0:
                needed = True
                break
            if directed and seen[e, sectors[at]] == 1 and distinct[e] <= sector_demand[e]:
                needed = sector_demand[e] > 0
                if needed:
                    break
        if needed:
            continue
        kept[k] = False
        for at in range(indptr[j], indptr[j + 1]):
            e = indices[at]
            hits[e] -= 1
            if directed:
                seen[e, sectors[at]] -= 1
                if seen[e, sectors[at]] == 0:
                    distinct[e] -= 1
    return kept
