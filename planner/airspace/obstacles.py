"""Raw points of the scene as obstacles: masts, tree tops and whatever no surface holds."""

from typing import Any

import numpy as np

from planner.geometry.arrays import Floats, Ints

_MOST_CELLS = 8_000_000


class Points:
    """Points in a grid of cells for sweeps, and in a k-d tree for distances.

    Parameters
    ----------
    points
        Shape (N, 3), metres, local frame; N may be 0.
    cell
        Wanted cell width, metres; wider if that would take too many cells.

    """

    def __init__(self, points: Floats, *, cell: float) -> None:
        from scipy.spatial import KDTree

        self._tree: Any = KDTree(points) if len(points) else None
        if self._tree is None:
            return
        low, high = points.min(axis=0), points.max(axis=0)
        while np.prod((high - low) // cell + 1.0) > _MOST_CELLS:
            cell *= 1.1
        shape = ((high - low) // cell).astype(np.int64) + 1
        index = np.floor((points - low) / cell).astype(np.int64).clip(0, shape - 1)
        flat = (index[:, 0] * shape[1] + index[:, 1]) * shape[2] + index[:, 2]
        order = np.argsort(flat, kind="stable")
        self._points = np.ascontiguousarray(points[order])
        self._start = _starts(flat[order], shape)
        self._low, self._cell = low, cell

    def distance(self, points: Floats) -> Floats:
        """Distance from each point, shape (M, 3), to the nearest obstacle, metres; exact."""
        if self._tree is None:
            return np.full(len(points), np.inf)
        return np.asarray(self._tree.query(points)[0])

    def capsule_is_clear(self, a: Floats, b: Floats, radius: float) -> bool:
        """Tell whether all obstacles are at least ``radius`` away from the segment ``ab``."""
        if self._tree is None:
            return True
        from planner.airspace.point_kernels import capsule_meets_point

        return not capsule_meets_point(
            a, b, radius, self._points, self._start, self._low, self._cell
        )


def _starts(flat: Ints, shape: Ints) -> Ints:
    """Where the points of each cell begin, shape (nx, ny, nz + 1), of sorted cell numbers."""
    ends = np.cumsum(np.bincount(flat, minlength=int(shape.prod()))).reshape(shape)
    start = np.empty((shape[0], shape[1], shape[2] + 1), dtype=np.int64)
    start[:, :, 1:] = ends
    start[:, :, 0] = np.r_[0, ends[:, :, -1].ravel()[:-1]].reshape(shape[:2])
    return start
