"""Compiled sums over pairs; import only where they are needed."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]


@compiled
def pair_value(
    a: int, b: int, rays: Array, nearness: Array, facing: Array, weights: Array
) -> float:
    """Value of the pair of hits ``a`` and ``b`` at one element."""
    near = min(nearness[a], nearness[b])
    face = min(facing[a], facing[b])
    if near <= 0.0 or face <= 0.0:
        return 0.0
    cosine = rays[a, 0] * rays[b, 0] + rays[a, 1] * rays[b, 1] + rays[a, 2] * rays[b, 2]
    place = np.arccos(min(1.0, max(-1.0, cosine))) / np.pi * (len(weights) - 1)
    low = min(int(place), len(weights) - 2)
    share = place - low
    weight = (1.0 - share) * weights[low] + share * weights[low + 1]
    return float(weight * near * face)


@compiled
def values(
    starts: Array,
    at: Array,
    taken: Array,
    owner: Array,
    rays: Array,
    nearness: Array,
    facing: Array,
    weights: Array,
) -> Array:
    """Sum of the pair values at each element over the hits of taken candidates.

    ``at[starts[e]:starts[e + 1]]`` are the hits of element ``e``; ``owner`` their candidates.
    """
    total = np.zeros(len(starts) - 1)
    for e in range(len(total)):
        for i in range(starts[e], starts[e + 1]):
            if not taken[owner[at[i]]]:
                continue
            for j in range(starts[e], i):
                if taken[owner[at[j]]]:
                    total[e] += pair_value(at[i], at[j], rays, nearness, facing, weights)
    return total
