"""Compiled counts of how many hits elements need; import only where a bound is wanted."""

# ruff: noqa: PLR0917 - positional arguments, as compiled code takes them

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.pairs.kernels import pair_value

Array = NDArray[Any]

_EXACT = 96  # hits up to which all pairs of an element are looked at
_SCANS = 32  # largest numbers of a list that are found one by one


@compiled
def fewest(starts: Array, sight: Array, weights: Array, target: Array) -> tuple[Array, Array]:
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
            needed[e] = _by_partners(pairs, target[e])
            for i in range(size):
                halves[first + i] = 0.5 * pairs[i].sum()
            continue
        worth = np.empty(size)
        for k in range(size):
            worth[k] = best * max(0.0, sight[3, first + k]) * max(0.0, sight[4, first + k])
        needed[e] = _by_worth(worth, target[e])
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


@compiled
def _by_worth(worth: Array, target: float) -> int:
    """Fewest hits whose pairs reach the target if each is worth as much as its worse hit."""
    value = 0.0
    for k in range(len(worth)):
        if k == _SCANS:
            worth = np.sort(worth)[::-1]  # the first ones, 0 by now, are at the end
        at = k - _SCANS if k >= _SCANS else np.argmax(worth)
        value += k * worth[at]
        if value * (1.0 + 1e-9) + 1e-6 >= target:  # pairs may have been rounded up
            return k + 1
        if k < _SCANS:
            worth[at] = 0.0
    return 0


@compiled
def relaxed(
    indptr: Array,
    element: Array,
    sums: Array,
    fine: Array,
    prices: Array,
    worth: Array,
    slope: Array,
) -> float:
    """Price of the candidates that pay for themselves, at most 0, at these prices of rows.

    A hit earns its candidate ``worth[e, 0]``, ``worth[e, 1]`` times its sum, and ``worth[e, 2]``
    if it is fine, of which ``slope`` (E, 3) gets what they give, negative.
    """
    slope[:] = 0.0
    total = 0.0
    for c in range(len(prices)):
        reduced = prices[c]
        for hit in range(indptr[c], indptr[c + 1]):
            e = element[hit]
            reduced -= worth[e, 0] + worth[e, 1] * sums[hit] + worth[e, 2] * fine[hit]
        if reduced >= 0.0:
            continue
        total += reduced
        for hit in range(indptr[c], indptr[c + 1]):
            e = element[hit]
            slope[e, 0] -= 1.0
            slope[e, 1] -= sums[hit]
            slope[e, 2] -= fine[hit]
    return total
