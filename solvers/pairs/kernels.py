"""Compiled sums over pairs; import only where they are needed."""

# ruff: noqa: PLR0917 - positional arguments, as compiled code takes them

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
    """Value of the pair of the hits in columns ``a`` and ``b``, rounded to the grain.

    Each column holds a ray, nearness and facing.
    """
    near = max(0.0, min(first[3, a], second[3, b]))
    face = max(0.0, min(first[4, a], second[4, b]))
    x = first[0, a] - second[0, b]
    y = first[1, a] - second[1, b]
    z = first[2, a] - second[2, b]
    place = math.sqrt(x * x + y * y + z * z) * (0.5 * (len(weights) - 1))
    low = min(int(place), len(weights) - 2)
    share = min(place - low, 1.0)
    weight = weights[low] + share * (weights[low + 1] - weights[low])
    return grain(weight * near * face)


@compiled
def pair_values(
    first: Array, a: int, second: Array, begin: int, end: int, weights: Array, out: Array
) -> None:
    """Write the values of the pairs of hit ``a`` with ``begin`` to ``end`` to ``out`` from 0 on.

    The same as :func:`pair_value`, in two loops over contiguous rows, since processors take
    several steps of the first one at once.
    """
    ax, ay, az, near_a, face_a = first[0, a], first[1, a], first[2, a], first[3, a], first[4, a]
    xs, ys, zs = second[0, begin:end], second[1, begin:end], second[2, begin:end]
    nears, faces = second[3, begin:end], second[4, begin:end]
    scale, top = 0.5 * (len(weights) - 1), len(weights) - 2
    for k in range(end - begin):
        x, y, z = ax - xs[k], ay - ys[k], az - zs[k]
        out[k] = math.sqrt(x * x + y * y + z * z) * scale
    for k in range(end - begin):
        place = out[k]
        low = min(int(place), top)
        share = min(place - low, 1.0)
        weight = weights[low] + share * (weights[low + 1] - weights[low])
        near, face = max(0.0, min(near_a, nears[k])), max(0.0, min(face_a, faces[k]))
        out[k] = grain(weight * near * face)


@compiled
def transposed(indptr: Array, element: Array, starts: Array, at: Array, owner: Array) -> None:
    """Order the hits of candidates element by element, candidates ascending.

    Fills the row starts (elements + 1,), and which hit of which candidate each is, (nnz,).
    """
    starts[:] = 0
    for e in element:
        starts[e + 1] += 1
    for e in range(len(starts) - 1):
        starts[e + 1] += starts[e]
    end = starts[:-1].copy()
    for c in range(len(indptr) - 1):
        for hit in range(indptr[c], indptr[c + 1]):
            k = end[element[hit]]
            end[element[hit]] += 1
            at[k], owner[k] = hit, c


@compiled
def gathered(at: Array, rays: Array, nearness: Array, facing: Array, sight: Array) -> None:
    """Fill ``sight`` (5, nnz) with ray, nearness and facing of the hits in this order."""
    for k in range(len(at)):
        hit = at[k]
        sight[0, k], sight[1, k], sight[2, k] = rays[hit, 0], rays[hit, 1], rays[hit, 2]
        sight[3, k], sight[4, k] = nearness[hit], facing[hit]


@compiled
def values(
    chosen: Array,
    indptr: Array,
    element: Array,
    rays: Array,
    nearness: Array,
    facing: Array,
    weights: Array,
    size: int,
) -> Array:
    """Sum of the pair values at each of ``size`` elements over the hits of chosen candidates."""
    starts = np.zeros(size + 1, dtype=np.int64)
    for c in chosen:
        for hit in range(indptr[c], indptr[c + 1]):
            starts[element[hit] + 1] += 1
    most = starts.max()
    for e in range(size):
        starts[e + 1] += starts[e]
    end, crews = starts[:-1].copy(), np.empty((starts[size], 5), dtype=np.float32)
    for c in chosen:
        for hit in range(indptr[c], indptr[c + 1]):
            hole = crews[end[element[hit]]]
            hole[0], hole[1], hole[2] = rays[hit, 0], rays[hit, 1], rays[hit, 2]
            hole[3], hole[4] = nearness[hit], facing[hit]
            end[element[hit]] += 1
    total, row, crew = np.zeros(size), np.empty(most), np.empty((5, most), dtype=np.float32)
    for e in range(size):
        for n in range(starts[e + 1] - starts[e]):
            for column in range(5):
                crew[column, n] = crews[starts[e] + n, column]
            pair_values(crew, n, crew, 0, n, weights, row)
            total[e] += row[:n].sum()
    return total


@compiled
def reaches(starts: Array, sight: Array, weights: Array, target: Array) -> Array:
    """Whether each element's value reaches the target when all its hits are taken.

    Looks at the hits in an order that begins with far ones, since neighbours among them are
    alike and make few good pairs.
    """
    size = 0
    for e in range(len(starts) - 1):
        size = max(size, starts[e + 1] - starts[e])
    crew, row = np.empty((5, size), dtype=np.float32), np.empty(size)
    reached = np.zeros(len(starts) - 1, dtype=np.bool_)
    for e in range(len(reached)):
        count, total = starts[e + 1] - starts[e], 0.0
        step = coprime(count)
        for n in range(count):
            crew[:, n] = sight[:, starts[e] + (n * step) % count]
            pair_values(crew, n, crew, 0, n, weights, row)
            total += row[:n].sum()
            if total >= target[e]:
                reached[e] = True
                break
    return reached


@compiled
def coprime(count: int) -> int:
    """Whole number near the golden section of ``count`` that shares no factor with it."""
    step = max(1, int(0.618 * count))
    while True:
        a, b = count, step
        while b:
            a, b = b, a % b
        if a <= 1:
            return step
        step += 1
