"""Compiled counts of how many hits an element needs; import only where a bound is wanted."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.pairs.kernels import pair_value

Array = NDArray[Any]

_EXACT = 96  # hits up to which all pairs of an element are looked at


@compiled
def fewest(starts: Array, sight: Array, weights: Array, target: float) -> tuple[Array, Array]:
    """Lower bound on the hits with which each element can reach the target; 0 if none can.

    Also half of the sum of each hit's pairs where an element has few hits, else 0, by
    element (nnz,).
    """
    needed = np.zeros(len(starts) - 1, dtype=np.int64)
    halves = np.zeros(sight.shape[1])
    best = weights.max()
    for e in range(len(needed)):
        first, size = starts[e], starts[e + 1] - starts[e]
        if size <= _EXACT:
            pairs = _pairs(first, size, sight, weights)
            needed[e] = _by_partners(pairs, target)
            for i in range(size):
                halves[first + i] = 0.5 * pairs[i].sum()
            continue
        worth = np.empty(size)
        for k in range(size):
            worth[k] = best * max(0.0, sight[3, first + k]) * max(0.0, sight[4, first + k])
        worth = np.sort(worth)[::-1]
        value = 0.0
        for k in range(size):
            value += k * worth[k]
            if value * (1.0 + 1e-9) + 1e-6 >= target:  # pairs may have been rounded up
                needed[e] = k + 1
                break
    return needed, halves


@compiled
def _pairs(first: int, size: int, sight: Array, weights: Array) -> Array:
    """Value of each pair of ``size`` hits from ``first``, each row in descending order."""
    pairs = np.zeros((size, size))
    for i in range(size):
        for j in range(i):
            pairs[i, j] = pair_value(sight, first + i, sight, first + j, weights)
            pairs[j, i] = pairs[i, j]
    for i in range(size):
        pairs[i] = np.sort(pairs[i])[::-1]
    return pairs


@compiled
def _by_partners(pairs: Array, target: float) -> int:
    """Fewest hits whose best partners, as many as there are other hits, reach the target."""
    size = len(pairs)
    sums = np.zeros(size)
    for n in range(2, size + 1):
        sums += pairs[:, n - 2]
        if 0.5 * np.sort(sums)[size - n :].sum() >= target - 1e-9:
            return n
    return 0
