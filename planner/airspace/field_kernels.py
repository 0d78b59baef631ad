"""Compiled exact distances to triangles through a tree of boxes; import only where one is made."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]

LEAF = 4  # triangles a leaf
_FLAT = 1e-8  # width over length under which a triangle is as good as its edges


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
def _square_to_box(x: float, y: float, z: float, low: Array, high: Array) -> float:
    """Squared distance from a point to a box, 0 inside; infinite for an empty one."""
    dx = max(low[0] - x, x - high[0], 0.0)
    dy = max(low[1] - y, y - high[1], 0.0)
    dz = max(low[2] - z, z - high[2], 0.0)
    return float(dx * dx + dy * dy + dz * dz)


@compiled
def distances(points: Array, corners: Array, low: Array, high: Array, out: Array) -> None:
    """Distance from each point to the nearest triangle, by branch and bound.

    ``corners`` (T, 3, 3) lie in the leaves of a complete binary tree in order, ``LEAF`` in each;
    ``low`` and ``high`` are the boxes of its nodes, the root at 1, the children of n at 2 n and
    2 n + 1. The search for each point starts from the triangle that was nearest to the last.
    """
    leaves = len(low) // 2
    nodes, squares = np.empty(128, np.int64), np.empty(128)
    nearest = 0
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        best = _square_to_triangle(x, y, z, corners[nearest])
        nodes[0], squares[0], waiting = 1, 0.0, 1
        while waiting:
            waiting -= 1
            node = nodes[waiting]
            if squares[waiting] >= best:
                continue
            if node >= leaves:
                first = (node - leaves) * LEAF
                for t in range(first, min(first + LEAF, len(corners))):
                    square = _square_to_triangle(x, y, z, corners[t])
                    if square < best:
                        best, nearest = square, t
                continue
            left = _square_to_box(x, y, z, low[2 * node], high[2 * node])
            right = _square_to_box(x, y, z, low[2 * node + 1], high[2 * node + 1])
            near = 0 if left <= right else 1  # looked at first, so put on top
            nodes[waiting], squares[waiting] = 2 * node + 1 - near, max(left, right)
            nodes[waiting + 1], squares[waiting + 1] = 2 * node + near, min(left, right)
            waiting += 2
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
