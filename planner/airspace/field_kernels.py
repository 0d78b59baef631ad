"""Compiled exact distances to triangles through a grid of cells; import only where one is made."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]

_FLAT = 1e-8  # width over length under which a triangle is as good as its edges


@compiled
def list_triangles(corners: Array, shape: Array, start: Array, items: Array) -> int:
    """List for each cell the triangles whose boxes touch it; return how many entries.

    ``corners`` (T, 3, 3) are in cells. The first call, with empty ``items``, counts into
    ``start`` (cells + 1); the second, with the sums of those counts, fills ``items`` and leaves
    in ``start`` where each cell ends.
    """
    total = 0
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for t in range(len(corners)):
        for c in range(3):
            low = min(corners[t, 0, c], corners[t, 1, c], corners[t, 2, c]) - 1e-9
            high = max(corners[t, 0, c], corners[t, 1, c], corners[t, 2, c]) + 1e-9
            first[c] = min(max(math.floor(low), 0), shape[c] - 1)
            last[c] = min(max(math.floor(high), 0), shape[c] - 1)
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                for k in range(first[2], last[2] + 1):
                    cell = (i * shape[1] + j) * shape[2] + k
                    if len(items):
                        items[start[cell]] = t
                    start[cell] += 1
                    total += 1
    return total


@compiled
def _square_to_edge(  # noqa: PLR0917 - compiled
    px: float, py: float, pz: float, ex: float, ey: float, ez: float
) -> float:
    """Squared distance from ``p`` to the segment from the origin to ``e``."""
    square = ex * ex + ey * ey + ez * ez
    t = 0.0
    if square > 0.0:
        t = min(max((px * ex + py * ey + pz * ez) / square, 0.0), 1.0)
    dx, dy, dz = px - t * ex, py - t * ey, pz - t * ez
    return dx * dx + dy * dy + dz * dz


@compiled
def _square_to_triangle(x: float, y: float, z: float, corners: Array) -> float:
    """Squared distance from a point to a triangle (3, 3), which may be degenerate."""
    ax, ay, az = x - corners[0, 0], y - corners[0, 1], z - corners[0, 2]
    bx, by, bz = x - corners[1, 0], y - corners[1, 1], z - corners[1, 2]
    cx, cy, cz = x - corners[2, 0], y - corners[2, 1], z - corners[2, 2]
    ux, uy, uz = ax - bx, ay - by, az - bz  # from a to b
    vx, vy, vz = bx - cx, by - cy, bz - cz  # from b to c
    wx, wy, wz = cx - ax, cy - ay, cz - az  # from c to a
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    longest = max(
        ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    )
    if square > _FLAT * _FLAT * longest * longest:
        in_a = (uy * az - uz * ay) * nx + (uz * ax - ux * az) * ny + (ux * ay - uy * ax) * nz
        in_b = (vy * bz - vz * by) * nx + (vz * bx - vx * bz) * ny + (vx * by - vy * bx) * nz
        in_c = (wy * cz - wz * cy) * nx + (wz * cx - wx * cz) * ny + (wx * cy - wy * cx) * nz
        if in_a >= 0.0 and in_b >= 0.0 and in_c >= 0.0:
            height = ax * nx + ay * ny + az * nz
            return float(height * height / square)
    to_ab, to_bc = _square_to_edge(ax, ay, az, ux, uy, uz), _square_to_edge(bx, by, bz, vx, vy, vz)
    return min(to_ab, to_bc, _square_to_edge(cx, cy, cz, wx, wy, wz))


@compiled
def _square_in_cells(  # noqa: PLR0917 - compiled
    x: float, y: float, z: float, corners: Array, items: Array, first: int, last: int, best: float
) -> float:
    """Least squared distance to the listed triangles, or ``best`` if that is less."""
    for entry in range(first, last):
        best = min(best, _square_to_triangle(x, y, z, corners[items[entry]]))
    return best


@compiled
def distances(  # noqa: PLR0917 - compiled
    points: Array,
    corners: Array,
    start: Array,
    items: Array,
    origin: Array,
    cell: float,
    shape: Array,
    out: Array,
) -> None:
    """Distance from each point to the nearest triangle, found shell by shell of cells.

    All but the first cell's list begin where the one before ends; ``start`` (cells + 1).
    """
    nx, ny, nz = shape[0], shape[1], shape[2]
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        fx, fy, fz = (x - origin[0]) / cell, (y - origin[1]) / cell, (z - origin[2]) / cell
        ci, cj, ck = math.floor(fx), math.floor(fy), math.floor(fz)
        border = min(fx - ci, ci + 1 - fx, fy - cj, cj + 1 - fy, fz - ck, ck + 1 - fz)
        border = max(border - 1e-9, 0.0)
        farthest = max(ci, nx - 1 - ci, cj, ny - 1 - cj, ck, nz - 1 - ck)
        shell = max(0, -ci, ci - nx + 1, -cj, cj - ny + 1, -ck, ck - nz + 1)
        best = np.inf
        while shell <= farthest:
            for i in range(max(ci - shell, 0), min(ci + shell, nx - 1) + 1):
                side_i = abs(i - ci) == shell
                for j in range(max(cj - shell, 0), min(cj + shell, ny - 1) + 1):
                    row = (i * ny + j) * nz
                    if side_i or abs(j - cj) == shell:
                        low, high = max(ck - shell, 0), min(ck + shell, nz - 1)
                        if low <= high:
                            first, last = start[row + low], start[row + high + 1]
                            best = _square_in_cells(x, y, z, corners, items, first, last, best)
                        continue
                    for k in (ck - shell, ck + shell):
                        if 0 <= k < nz:
                            first, last = start[row + k], start[row + k + 1]
                            best = _square_in_cells(x, y, z, corners, items, first, last, best)
            within = (shell + border) * cell
            if best <= within * within:
                break
            shell += 1
        out[p] = math.sqrt(best)


@compiled
def fill_blocks(field: Array, blocks: Array, width: int, values: Array, cell: float) -> None:
    """Write to each cell of blocks the block's value less the way from its centre."""
    middle = 0.5 * (width - 1)
    for b in range(len(blocks)):
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    x, y, z = blocks[b, 0] + i, blocks[b, 1] + j, blocks[b, 2] + k
                    if x < field.shape[0] and y < field.shape[1] and z < field.shape[2]:
                        way = math.sqrt((i - middle) ** 2 + (j - middle) ** 2 + (k - middle) ** 2)
                        field[x, y, z] = values[b] - way * cell
