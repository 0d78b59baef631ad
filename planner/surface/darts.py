"""Compiled dart throwing; loaded only when samples are drawn."""

import numpy as np

from planner.geometry.arrays import Bools, Floats
from planner.geometry.compiled import compiled


@compiled
def throw_darts(points: Floats, radius: float) -> Bools:
    """Accept points in order, each unless an accepted one is closer than ``radius``.

    A hash of cells of width ``radius`` keeps the accepted points. Cells that share a bucket only
    cost a comparison, since every distance is checked.

    Parameters
    ----------
    points
        Candidates in the order in which they are tried, shape (N, 3), metres.
    radius
        Smallest distance between accepted points, metres, positive.

    Returns
    -------
    accepted
        Shape (N,). Every refused point lies closer than ``radius`` to an accepted one.

    """
    count = len(points)
    size = 1024
    while size < count:
        size *= 2
    mask = size - 1
    head = np.full(size, -1, np.int64)
    after = np.full(count, -1, np.int64)
    accepted = np.zeros(count, np.bool_)
    squared = radius * radius
    for row in range(count):
        x, y, z = points[row]
        i, j, k = int(np.floor(x / radius)), int(np.floor(y / radius)), int(np.floor(z / radius))
        free = True
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                for c in range(k - 1, k + 2):
                    other = head[(a * 73856093 ^ b * 19349663 ^ c * 83492791) & mask]
                    while free and other >= 0:
                        dx, dy = points[other, 0] - x, points[other, 1] - y
                        dz = points[other, 2] - z
                        free = dx * dx + dy * dy + dz * dz >= squared
                        other = after[other]
        if free:
            accepted[row] = True
            bucket = (i * 73856093 ^ j * 19349663 ^ k * 83492791) & mask
            after[row] = head[bucket]
            head[bucket] = row
    return accepted
