"""Compiled sums over pairs; import only where they are needed."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.pairs.state import GRAIN

Array = NDArray[Any]

_ROUNDER = 1.5 * 2.0**52 / GRAIN  # whose last bit is one grain


@compiled
def grain(value: float) -> float:
    """Nearest multiple of 1 / ``GRAIN``, of a value below 2**19."""
    return (value + _ROUNDER) - _ROUNDER


@compiled
def pair_value(first: Array, a: int, second: Array, b: int, weights: Array) -> float:
    """Value of the pair of the hits in rows ``a`` and ``b``, rounded to the grain.

    Each row holds a ray, nearness and facing.
    """
    near = min(first[a, 3], second[b, 3])
    face = min(first[a, 4], second[b, 4])
    if near <= 0.0 or face <= 0.0:
        return 0.0
    x = first[a, 0] - second[b, 0]
    y = first[a, 1] - second[b, 1]
    z = first[a, 2] - second[b, 2]
    place = math.sqrt(x * x + y * y + z * z) * (0.5 * (len(weights) - 1))
    low = min(int(place), len(weights) - 2)
    share = min(place - low, 1.0)
    weight = weights[low] + share * (weights[low + 1] - weights[low])
    return grain(weight * near * face)


@compiled
def values(starts: Array, taken: Array, owner: Array, sight: Array, weights: Array) -> Array:
    """Sum of the pair values at each element over the hits of taken candidates.

    Hits ``starts[e]`` to ``starts[e + 1]`` are those of element ``e``; ``owner`` their
    candidates.
    """
    total = np.zeros(len(starts) - 1)
    chosen = np.empty(len(owner), dtype=np.int64)
    for e in range(len(total)):
        count = 0
        for k in range(starts[e], starts[e + 1]):
            if taken[owner[k]]:
                for i in range(count):
                    total[e] += pair_value(sight, chosen[i], sight, k, weights)
                chosen[count] = k
                count += 1
    return total


@compiled
def reaches(starts: Array, sight: Array, weights: Array, target: float) -> Array:
    """Whether each element's value reaches the target when all its hits are taken."""
    reached = np.zeros(len(starts) - 1, dtype=np.bool_)
    for e in range(len(reached)):
        total = 0.0
        for i in range(starts[e], starts[e + 1]):
            for j in range(starts[e], i):
                total += pair_value(sight, i, sight, j, weights)
            if total >= target:
                reached[e] = True
                break
    return reached
