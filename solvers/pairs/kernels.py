"""Compiled sums over pairs; import only where they are needed."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.pairs.state import GRAIN

Array = NDArray[Any]


@compiled
def grain(value: float) -> float:
    """Nearest multiple of 1 / ``GRAIN``."""
    return math.floor(value * GRAIN + 0.5) / GRAIN


@compiled
def pair_value(a: int, b: int, sight: Array, weights: Array) -> float:
    """Value of the pair of hits ``a`` and ``b`` at one element, rounded to the grain."""
    near = min(sight[a, 3], sight[b, 3])
    face = min(sight[a, 4], sight[b, 4])
    if near <= 0.0 or face <= 0.0:
        return 0.0
    x = sight[a, 0] - sight[b, 0]
    y = sight[a, 1] - sight[b, 1]
    z = sight[a, 2] - sight[b, 2]
    squared = x * x + y * y + z * z
    place = math.sqrt(squared) * (0.5 * (len(weights) - 1))
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
                    total[e] += pair_value(chosen[i], k, sight, weights)
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
                total += pair_value(i, j, sight, weights)
            if total >= target:
                reached[e] = True
                break
    return reached
