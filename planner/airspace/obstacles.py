"""Raw points of the scene as obstacles: masts, tree tops and whatever no surface holds."""

import numpy as np

from planner.geometry.arrays import Floats, Ints

_MOST_CELLS = 8_000_000


class Points:
    """Points sorted by cell: a grid for sweeps, and boxes around bundles for distances.

    Parameters
    ----------
    points
        Shape (N, 3), metres, local frame; N may be 0.
    cell
        Wanted cell width, metres; wider if that would take too many cells.

    """

    def __init__(self, points: Floats, *, cell: float) -> None:
        self._points = np.zeros((0, 3))
        if not len(points):
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
        self._boxes = _boxes(self._points)

    def distance(self, points: Floats) -> Floats:
        """Distance from each point, shape (M, 3), to the nearest obstacle, metres; exact."""
        if not len(self._points):
            return np.full(len(points), np.inf)
        from planner.airspace.point_kernels import nearest_distances

        out = np.empty(len(points))
        at = np.ascontiguousarray(points, dtype=np.float64)
        nearest_distances(at, self._points, *self._boxes, out)
        return out

    def capsule_is_clear(self, a: Floats, b: Floats, radius: float) -> bool:
        """Tell whether all obstacles are at least ``radius`` away from the segment ``ab``."""
        if not len(self._points):
            return True
        from planner.airspace.point_kernels import capsule_meets_point

        return not capsule_meets_point(
            a, b, radius, self._points, self._start, self._low, self._cell
        )


def _boxes(points: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest corners of a binary tree of boxes over consecutive points."""
    from planner.airspace.point_kernels import BUNDLE

    first = np.arange(0, len(points), BUNDLE)
    width = 1 << (len(first) - 1).bit_length()
    low, high = np.full((2 * width, 3), np.inf), np.full((2 * width, 3), -np.inf)
    low[width : width + len(first)] = np.minimum.reduceat(points, first)
    high[width : width + len(first)] = np.maximum.reduceat(points, first)
    while width > 1:
        pairs, width = slice(width, 2 * width), width // 2
        low[width : 2 * width] = np.minimum(low[pairs][0::2], low[pairs][1::2])
        high[width : 2 * width] = np.maximum(high[pairs][0::2], high[pairs][1::2])
    return low, high


def _starts(flat: Ints, shape: Ints) -> Ints:
    """Where the points of each cell begin, shape (nx, ny, nz + 1), of sorted cell numbers."""
    ends = np.cumsum(np.bincount(flat, minlength=int(shape.prod()))).reshape(shape)
    start = np.empty((shape[0], shape[1], shape[2] + 1), dtype=np.int64)
    start[:, :, 1:] = ends
    start[:, :, 0] = np.r_[0, ends[:, :, -1].ravel()[:-1]].reshape(shape[:2])
    return start
