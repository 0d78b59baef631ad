"""Compiled loops over the occupancy grid; import only where a grid is made.

Each cell of the grid is one byte of flags. Triangles are given in cells: position less the
grid's origin, divided by the cell width.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]

SHELL = np.uint8(1)  # a surface or a point touches the cell
FILL = np.uint8(2)  # no shell, under a surface that faces up, with no underside between
EARTH = np.uint8(4)  # centre under the terrain
CLOSED = np.uint8(8)  # too near to any of these for the flood
SKY = np.uint8(16)  # reached from the open sky
UP = np.uint8(32)  # the column's centre line passes a surface that faces up
DOWN = np.uint8(64)  # ... or down
_EPS = 1e-6  # in cells: what touches a border touches both sides


@compiled
def _clip(  # noqa: PLR0917 - compiled
    polygon: Array, count: int, axis: int, bound: float, side: float, out: Array
) -> int:
    """Keep the part of a convex polygon with ``side * (x[axis] - bound) >= 0``; new count."""
    kept = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        here = side * (polygon[i, axis] - bound)
        there = side * (polygon[j, axis] - bound)
        if here >= 0.0:
            for c in range(3):
                out[kept, c] = polygon[i, c]
            kept += 1
        if (here > 0.0 and there < 0.0) or (here < 0.0 and there > 0.0):
            share = here / (here - there)
            for c in range(3):
                out[kept, c] = polygon[i, c] + share * (polygon[j, c] - polygon[i, c])
            out[kept, axis] = bound
            kept += 1
    return kept


@compiled
def _slab(  # noqa: PLR0917 - compiled
    polygon: Array, count: int, axis: int, low: float, spare: Array, out: Array
) -> int:
    """Keep the part of a polygon in the slab of one cell from ``low``, both borders in."""
    count = _clip(polygon, count, axis, low - _EPS, 1.0, spare)
    return _clip(spare, count, axis, low + 1.0 + _EPS, -1.0, out)


@compiled
def _span(polygon: Array, count: int, axis: int, size: int) -> tuple[int, int]:
    """First and last cell along an axis that a polygon touches; empty if last < first."""
    low, high = polygon[0, axis], polygon[0, axis]
    for i in range(1, count):
        low, high = min(low, polygon[i, axis]), max(high, polygon[i, axis])
    first = math.floor(max(low - _EPS, -1.0))
    last = math.floor(min(high + _EPS, float(size)))
    return max(first, 0), min(last, size - 1)


@compiled
def mark_triangles(flags: Array, corners: Array) -> None:
    """Set SHELL in every cell that a triangle touches, UP or DOWN where columns cross it.

    ``corners`` (T, 3, 3) are in cells. Each triangle is cut exactly to rows, then to columns,
    and marks the range of heights that is left; nothing that it touches is missed.
    """
    nx, ny, nz = flags.shape
    row, column, spare = np.empty((12, 3)), np.empty((12, 3)), np.empty((12, 3))
    for t in range(len(corners)):
        triangle = corners[t]
        first_j, last_j = _span(triangle, 3, 1, ny)
        for j in range(first_j, last_j + 1):
            in_row = _slab(triangle, 3, 1, float(j), spare, row)
            if in_row == 0:
                continue
            first_i, last_i = _span(row, in_row, 0, nx)
            for i in range(first_i, last_i + 1):
                count = _slab(row, in_row, 0, float(i), spare, column)
                if count == 0:
                    continue
                first_k, last_k = _span(column, count, 2, nz)
                for k in range(first_k, last_k + 1):
                    flags[i, j, k] |= SHELL
                _mark_crossing(flags, triangle, i, j)


@compiled
def _mark_crossing(flags: Array, triangle: Array, i: int, j: int) -> None:
    """Set UP or DOWN where the centre line of column (i, j) passes the triangle."""
    x, y = i + 0.5, j + 0.5
    ax, ay = triangle[0, 0] - x, triangle[0, 1] - y
    bx, by = triangle[1, 0] - x, triangle[1, 1] - y
    cx, cy = triangle[2, 0] - x, triangle[2, 1] - y
    wa, wb, wc = bx * cy - cx * by, cx * ay - ax * cy, ax * by - bx * ay
    area = wa + wb + wc
    side = 1.0 if area > 0.0 else -1.0
    if abs(area) < 1e-9 or side * wa < 0.0 or side * wb < 0.0 or side * wc < 0.0:
        return
    k = math.floor((wa * triangle[0, 2] + wb * triangle[1, 2] + wc * triangle[2, 2]) / area)
    if 0 <= k < flags.shape[2]:
        flags[i, j, k] |= UP if area > 0.0 else DOWN


@compiled
def mark_points(flags: Array, points: Array) -> None:
    """Set SHELL in the cell of every point, (N, 3) in cells."""
    nx, ny, nz = flags.shape
    for p in range(len(points)):
        i, j, k = math.floor(points[p, 0]), math.floor(points[p, 1]), math.floor(points[p, 2])
        if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz:
            flags[i, j, k] |= SHELL


@compiled
def fill_columns(flags: Array, ground: Array, under_roofs: bool) -> None:
    """Set EARTH under the terrain and, if wanted, FILL between a top and what is below it.

    ``ground`` (nx, ny) is the terrain's height at the columns' centres, in cells.
    """
    nx, ny, nz = flags.shape
    for i in range(nx):
        for j in range(ny):
            inside = False
            for k in range(nz - 1, -1, -1):
                if k + 0.5 < ground[i, j]:
                    flags[i, j, k] |= EARTH
                    continue
                crossed = flags[i, j, k] & (UP | DOWN)
                if crossed == UP:
                    inside = True
                elif crossed == DOWN:
                    inside = False
                elif inside and under_roofs and flags[i, j, k] & SHELL == 0:
                    flags[i, j, k] |= FILL


@compiled
def close_near(flags: Array, reach: int) -> None:
    """Set CLOSED in every cell within ``reach`` cells, along each axis, of what is not air.

    UP and DOWN carry the results of the first two axes; they must be clear, and are left dirty.
    """
    nx, ny, nz = flags.shape
    solid = SHELL | FILL | EARTH
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if flags[i, j, k] & solid:
                    for m in range(max(k - reach, 0), min(k + reach + 1, nz)):
                        flags[i, j, m] |= UP
    for i in range(nx):
        for j in range(ny):
            for m in range(max(j - reach, 0), min(j + reach + 1, ny)):
                for k in range(nz):
                    if flags[i, m, k] & UP:
                        flags[i, j, k] |= DOWN
    for i in range(nx):
        for m in range(max(i - reach, 0), min(i + reach + 1, nx)):
            for j in range(ny):
                for k in range(nz):
                    if flags[m, j, k] & DOWN:
                        flags[i, j, k] |= CLOSED


@compiled
def flood(flags: Array) -> int:
    """Set SKY in all cells that air reaches from the top and the sides; return the sweeps made.

    Air passes the six faces of cells that are not CLOSED. Sweeps forth and back carry it along
    all axes at once until nothing changes.
    """
    nx, ny, nz = flags.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                rim = i == 0 or j == 0 or i == nx - 1 or j == ny - 1 or k == nz - 1
                if rim and not flags[i, j, k] & CLOSED:
                    flags[i, j, k] |= SKY
    sweeps, changed = 0, True
    while changed:
        changed = False
        sweeps += 1
        for i in range(nx):
            for j in range(ny):
                for k in range(nz):
                    if not flags[i, j, k] & (CLOSED | SKY) and (
                        (i > 0 and flags[i - 1, j, k] & SKY)
                        or (j > 0 and flags[i, j - 1, k] & SKY)
                        or (k > 0 and flags[i, j, k - 1] & SKY)
                    ):
                        flags[i, j, k] |= SKY
                        changed = True
        for i in range(nx - 1, -1, -1):
            for j in range(ny - 1, -1, -1):
                for k in range(nz - 1, -1, -1):
                    if not flags[i, j, k] & (CLOSED | SKY) and (
                        (i < nx - 1 and flags[i + 1, j, k] & SKY)
                        or (j < ny - 1 and flags[i, j + 1, k] & SKY)
                        or (k < nz - 1 and flags[i, j, k + 1] & SKY)
                    ):
                        flags[i, j, k] |= SKY
                        changed = True
    return sweeps


@compiled
def curtain_runs(flags: Array, axis: int, runs: Array) -> int:
    """Vertical runs of faces between filled cells and air across an axis (0: x, 1: y).

    Writes rows (i, j, first k, end k) to ``runs`` while there is room, and returns how many
    there are. The face lies on the lower side of cell (i, j) along the axis.
    """
    nx, ny, nz = flags.shape
    di, dj = (1, 0) if axis == 0 else (0, 1)
    solid = SHELL | FILL | EARTH
    count = 0
    for i in range(di, nx):
        for j in range(dj, ny):
            start = -1
            for k in range(nz + 1):
                face = False
                if k < nz:
                    a, b = flags[i - di, j - dj, k], flags[i, j, k]
                    face = (a & FILL != 0 and b & solid == 0) or (b & FILL != 0 and a & solid == 0)
                if face and start < 0:
                    start = k
                elif not face and start >= 0:
                    if count < len(runs):
                        runs[count, 0], runs[count, 1] = i, j
                        runs[count, 2], runs[count, 3] = start, k
                    count += 1
                    start = -1
    return count
