"""Compiled questions to points sorted by cell; import only where they are asked."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]

BUNDLE = 16  # consecutive points in one box


@compiled
def capsule_meets_point(  # noqa: PLR0917 - compiled
    a: Array, b: Array, radius: float, points: Array, start: Array, origin: Array, cell: float
) -> bool:
    """Tell whether a point lies closer than ``radius`` to the segment ``ab``; exact.

    ``points`` (N, 3) are sorted by cell, with z fastest, so that those of a stretch of a column
    are contiguous; ``start`` (nx, ny, nz + 1) is where those of each cell begin.
    """
    nx, ny, nz = start.shape[0], start.shape[1], start.shape[2] - 1
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length2 = dx * dx + dy * dy + dz * dz
    level2 = dx * dx + dy * dy
    near = radius + 0.7072 * cell  # from the centre of a column to what it may hold
    reach = radius * (1.0 + 1e-9) + 1e-9
    first_i = max(math.floor((min(a[0], b[0]) - reach - origin[0]) / cell), 0)
    last_i = min(math.floor((max(a[0], b[0]) + reach - origin[0]) / cell), nx - 1)
    first_j = max(math.floor((min(a[1], b[1]) - reach - origin[1]) / cell), 0)
    last_j = min(math.floor((max(a[1], b[1]) + reach - origin[1]) / cell), ny - 1)
    for i in range(first_i, last_i + 1):
        for j in range(first_j, last_j + 1):
            cx = origin[0] + (i + 0.5) * cell - a[0]
            cy = origin[1] + (j + 0.5) * cell - a[1]
            t0, t1 = 0.0, 1.0
            if level2 > 1e-12 * length2:  # the stretch of the segment over the column
                t = (cx * dx + cy * dy) / level2
                off2 = cx * cx + cy * cy - t * t * level2
                if off2 > near * near * (1.0 + 1e-9):
                    continue
                half = math.sqrt(max(near * near - off2, 0.0) / level2) + 1e-6
                t0, t1 = max(t - half, 0.0), min(t + half, 1.0)
                if t0 > t1:
                    continue
            low = min(a[2] + t0 * dz, a[2] + t1 * dz) - reach - origin[2]
            high = max(a[2] + t0 * dz, a[2] + t1 * dz) + reach - origin[2]
            first_k = max(math.floor(low / cell), 0)
            last_k = min(math.floor(high / cell), nz - 1)
            if first_k > last_k:
                continue
            for p in range(start[i, j, first_k], start[i, j, last_k + 1]):
                px, py, pz = points[p, 0] - a[0], points[p, 1] - a[1], points[p, 2] - a[2]
                t = 0.0
                if length2 > 0.0:
                    t = min(max((px * dx + py * dy + pz * dz) / length2, 0.0), 1.0)
                px, py, pz = px - t * dx, py - t * dy, pz - t * dz
                if px * px + py * py + pz * pz < radius * radius:
                    return True
    return False


@compiled
def _to_box(x: float, y: float, z: float, low: Array, high: Array) -> float:
    """Squared distance from a point to a box; infinite for an empty one."""
    square = 0.0
    for c, value in enumerate((x, y, z)):
        outside = max(low[c] - value, value - high[c], 0.0)
        square += outside * outside
    return square


@compiled
def nearest_distances(places: Array, points: Array, low: Array, high: Array, out: Array) -> None:
    """Distance from each place to the nearest point; exact.

    ``low`` and ``high`` are the boxes of bundles of points and of pairs of boxes: the children
    of box n are 2 n and 2 n + 1, and the last half are the bundles in order.
    """
    bundles = len(low) // 2
    boxes, squares = np.empty(128, np.int64), np.empty(128)
    for p in range(len(places)):
        x, y, z = places[p, 0], places[p, 1], places[p, 2]
        best = np.inf
        boxes[0], squares[0], waiting = 1, 0.0, 1
        while waiting > 0:
            waiting -= 1
            box = boxes[waiting]
            if squares[waiting] >= best:
                continue
            if box >= bundles:
                first = (box - bundles) * BUNDLE
                for q in range(first, min(first + BUNDLE, len(points))):
                    dx, dy, dz = points[q, 0] - x, points[q, 1] - y, points[q, 2] - z
                    best = min(best, dx * dx + dy * dy + dz * dz)
                continue
            one = _to_box(x, y, z, low[2 * box], high[2 * box])
            two = _to_box(x, y, z, low[2 * box + 1], high[2 * box + 1])
            swap = 1 if one < two else 0  # the nearer comes last, to be looked at first
            boxes[waiting], squares[waiting] = 2 * box + swap, max(one, two)
            boxes[waiting + 1], squares[waiting + 1] = 2 * box + 1 - swap, min(one, two)
            waiting += 2
        out[p] = math.sqrt(best)
