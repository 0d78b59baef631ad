"""Terrain under a scene, with buildings, trees and bridges taken away."""

import numpy as np

from planner.geometry.arrays import Bools, Bytes, Floats, Ints
from planner.scene.scene import Ground

_TERRAIN_CLASSES = (2, 9)  # LAS: ground, water
_SLOPE = 0.3  # steepest hill top that is still terrain
_STEP = 0.3  # lowest kerb, in cells, that makes an object
_WIDEST = 0.25  # half-width of the widest building, as a share of the scene's length
_OPEN = 0.08  # share of cells with bare ground below which a scene has no terrain of its own


def estimate_ground(
    xyz: Floats, *, cell: float, classes: Bytes | None = None, low: float = 5.0
) -> Ground:
    """Height of the terrain on a grid that covers the points.

    Where points are classified, the ground and water points decide. Otherwise each cell takes the
    low end of its heights, and a morphological opening with a growing window takes away whatever
    drops at once by more than terrain can (progressive filter after Zhang et al. 2003,
    doi:10.1109/TGRS.2003.810682). Gaps are filled linearly from their rims. Where hardly a cell is
    bare, as for a lone tower or buildings without terrain, the feet of the walls decide alone.

    Parameters
    ----------
    xyz
        Points, shape (N, 3), N >= 1, metres, local frame.
    cell
        Cell width, metres.
    classes
        LAS classes, shape (N,), if there are any.
    low
        Percentile of a cell's heights that is its low end; below it lie the echoes that seem to
        come from under the street.

    Returns
    -------
    ground
        Terrain, clamped at the rim.

    Raises
    ------
    ValueError
        If there is no point or the cell is not positive.

    """
    if len(xyz) == 0 or not cell > 0.0:
        raise ValueError(f"need points and a positive cell, got {len(xyz)} and {cell}.")
    from scipy.ndimage import maximum_filter, median_filter

    corner = xyz[:, :2].min(axis=0)
    shape = np.floor((xyz[:, :2].max(axis=0) - corner) / cell).astype(np.int64) + 1
    terrain = _classified(classes)
    if terrain is not None:
        heights, seen = _cell_heights(xyz[terrain], corner, cell, shape, 50.0)
        return Ground(_fill(heights, seen), corner, cell)
    heights, seen = _cell_heights(xyz, corner, cell, shape, low)
    upper, _ = _cell_heights(xyz, corner, cell, shape, 80.0)
    start = _fill_nearest(heights, seen)
    bare = seen & ~_objects(start, cell, _WIDEST)
    around = maximum_filter(np.where(seen, upper, -np.inf), size=3, mode="nearest")
    if (bare & (around - heights < cell)).sum() < _OPEN * seen.sum():
        bare = seen & ~_objects(start, cell, 1.0)
    return Ground(median_filter(_fill(heights, bare), size=3, mode="nearest"), corner, cell)


def _classified(classes: Bytes | None) -> Bools | None:
    """Which points are terrain by class, or ``None`` if the classes do not say."""
    if classes is None:
        return None
    terrain = np.isin(classes, _TERRAIN_CLASSES)
    return terrain if terrain.sum() >= max(10, 0.02 * len(classes)) else None


def _cell_heights(
    xyz: Floats, corner: Floats, cell: float, shape: Ints, percentile: float
) -> tuple[Floats, Bools]:
    """A percentile of the heights in each cell, and which cells hold a point."""
    index = np.floor((xyz[:, :2] - corner) / cell).astype(np.int64).clip(0, shape - 1)
    flat = index[:, 0] * shape[1] + index[:, 1]
    order = np.lexsort((xyz[:, 2], flat))
    first = np.flatnonzero(np.r_[True, np.diff(flat[order]) != 0])
    count = np.diff(np.r_[first, len(order)])
    pick = first + np.floor((count - 1) * percentile / 100.0).astype(np.int64)
    heights = np.zeros(int(shape.prod()))
    seen = np.zeros(int(shape.prod()), dtype=bool)
    cells = flat[order[first]]
    heights[cells] = xyz[order[pick], 2]
    seen[cells] = True
    return heights.reshape(shape), seen.reshape(shape)


def _objects(heights: Floats, cell: float, widest: float) -> Bools:
    """Which cells something stands on that the opening removes at one step."""
    from scipy.ndimage import grey_opening

    found = np.zeros(heights.shape, dtype=bool)
    last, before, half = heights, 0, 1
    while half <= max(1.0, widest * max(heights.shape)):
        opened = grey_opening(last, size=(2 * half + 1, 2 * half + 1), mode="nearest")
        found |= last - opened > (_SLOPE * (half - before) + _STEP) * cell
        last, before, half = opened, half, half + 1 + half // 8
    return found


def _fill_nearest(heights: Floats, seen: Bools) -> Floats:
    """Heights with unseen cells taken from the nearest seen one."""
    from scipy.ndimage import distance_transform_edt

    if seen.all():
        return heights
    near = distance_transform_edt(~seen, return_distances=False, return_indices=True)
    return np.asarray(heights[tuple(near)])


def _fill(heights: Floats, seen: Bools) -> Floats:
    """Heights with unseen cells interpolated from the seen ones around them."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.ndimage import binary_dilation
    from scipy.spatial import QhullError

    filled = _fill_nearest(heights, seen)
    rim = seen & binary_dilation(~seen)
    if seen.all() or rim.sum() < 3:
        return filled
    try:
        between = LinearNDInterpolator(np.argwhere(rim), heights[rim])
    except QhullError:  # all seen cells on a line
        return filled
    inside = between(np.argwhere(~seen))
    filled[~seen] = np.where(np.isfinite(inside), inside, filled[~seen])
    return filled
