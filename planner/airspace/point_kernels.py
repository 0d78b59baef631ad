"""Compiled sweep against points in a grid of cells; import only where one is made."""

import math
from typing import Any

from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]


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
