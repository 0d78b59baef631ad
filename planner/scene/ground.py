"""Terrain under a scene, with buildings, trees and bridges taken away."""

import numpy as np

from planner.geometry.arrays import Bools, Bytes, Floats, Ints
from planner.scene.scene import Ground

_TERRAIN_CLASSES = (2, 9)  # LAS: ground, water
_PERCENTILE = 5.0  # of a cell's heights: below it lie the echoes from under the street
_SLOPE = 0.3  # steepest hill top that is still terrain
_STEP = 0.3  # lowest kerb, in cells, that makes an object
_WIDEST = 0.25  # half-width of the widest building, as a share of the scene


def estimate_ground(xyz: Floats, *, cell: float, classes: Bytes | None = None) -> Ground:
    """Height of the terrain on a grid that covers the points.

    Where points are classified, the ground and water points decide. Otherwise each cell takes the
    low end of its heights, and a morphological opening with a growing window takes away whatever
    drops at once by more than terrain can (progressive filter after Zhang et al. 2003,
    doi:10.1109/TGRS.2003.810682). Gaps are filled linearly from their rims.

    Parameters
    ----------
    xyz
        Points, shape (N, 3), N >= 1, metres, local frame.
    cell
        Cell width, metres.
    classes
        LAS classes, shape (N,), if there are any.

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
    low = xyz[:, :2].min(axis=0)
    shape = np.floor((xyz[:, :2].max(axis=0) - low) / cell).astype(np.int64) + 1
    terrain = _classified(classes)
    if terrain is not None:
        heights, seen = _low_heights(xyz[terrain], low, cell, shape, percentile=50.0)
        return Ground(_fill(heights, seen), low, cell)
    heights, seen = _low_heights(xyz, low, cell, shape, percentile=_PERCENTILE)
    bare = seen & ~_objects(_fill_nearest(heights, seen), cell)
    return Ground(_fill(heights, bare), low, cell)


def _classified(classes: Bytes | None) -> Bools | None:
    """Which points are terrain by class, or ``None`` if the classes do not say."""
    if classes is None:
        return None
    terrain = np.isin(classes, _TERRAIN_CLASSES)
    return terrain if terrain.sum() >= max(10, 0.02 * len(classes)) else None


def _low_heights(
    xyz: Floats, low: Floats, cell: float, shape: Ints, *, percentile: float
) -> tuple[Floats, Bools]:
    """A low percentile of the heights in each cell, and which cells hold a point."""
    index = np.floor((xyz[:, :2] - low) / cell).astype(np.int64).clip(0, shape - 1)
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


def _objects(heights: Floats, cell: float) -> Bools:
    """Which cells something stands on that the opening removes at one step."""
    from scipy.ndimage import grey_opening

    found = np.zeros(heights.shape, dtype=bool)
    last = heights
    for half in range(1, max(2, round(_WIDEST * max(heights.shape)))):
        opened = grey_opening(last, size=(2 * half + 1, 2 * half + 1), mode="nearest")
        found |= last - opened > (_SLOPE + _STEP) * cell
        last = opened
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
