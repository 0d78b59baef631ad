"""Terrain under a scene, with buildings, trees and bridges taken away."""

import numpy as np

from planner.geometry.arrays import Bools, Bytes, Floats, Ints
from planner.scene.scene import Ground

_TERRAIN_CLASSES = (2, 9)  # LAS: ground, water
_SLOPE = 0.3  # steepest hill top that is still terrain
_STEP = 0.3  # lowest kerb, in cells, that makes an object
_ROUNDS = 40  # of averaging on each level of a gap's grid
_LOWEST = 2  # points of a cell that may lie below its low end, however many it holds
_WIDEST = 0.5  # half-width of the widest building, as a share of the scene's length
_WELL = 3  # cells in a square of seven that must lie as low as one for it to be no false echo


def estimate_ground(
    xyz: Floats, *, cell: float, classes: Bytes | None = None, low: float = 5.0
) -> Ground:
    """Height of the terrain on a grid that covers the points.

    Where points are classified, the ground and water points decide. Otherwise each cell takes the
    low end of its heights, and a morphological opening with a growing window takes away whatever
    drops at once by more than terrain can (progressive filter after Zhang et al. 2003,
    doi:10.1109/TGRS.2003.810682). Gaps are filled smoothly from their rims. Buildings without
    terrain stand on the feet of their walls. A plateau with cliffs all around is taken for a
    building too: then the ground is too low, which is safe.

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
    from scipy.ndimage import median_filter

    corner = xyz[:, :2].min(axis=0)
    shape = np.floor((xyz[:, :2].max(axis=0) - corner) / cell).astype(np.int64) + 1
    terrain = _classified(classes)
    if terrain is not None:
        heights, seen = _cell_heights(
            xyz[terrain], corner, cell, shape, percentile=50.0, most=len(xyz)
        )
        return Ground(_fill(heights, seen), corner, cell)
    heights, seen = _cell_heights(xyz, corner, cell, shape, percentile=low, most=_LOWEST)
    seen &= ~_pits(_fill(heights, seen), cell)
    bare = seen & ~_objects(_fill(heights, seen), cell)
    return Ground(median_filter(_fill(heights, bare), size=3, mode="nearest"), corner, cell)


def _classified(classes: Bytes | None) -> Bools | None:
    """Which points are terrain by class, or ``None`` if the classes do not say."""
    if classes is None:
        return None
    terrain = np.isin(classes, _TERRAIN_CLASSES)
    return terrain if terrain.sum() >= max(10, 0.02 * len(classes)) else None


def _cell_heights(
    xyz: Floats, corner: Floats, cell: float, shape: Ints, *, percentile: float, most: int
) -> tuple[Floats, Bools]:
    """A percentile of the heights in each cell (or less), and which cells hold a point."""
    index = np.floor((xyz[:, :2] - corner) / cell).astype(np.int64).clip(0, shape - 1)
    flat = index[:, 0] * shape[1] + index[:, 1]
    order = np.lexsort((xyz[:, 2], flat))
    first = np.flatnonzero(np.r_[True, np.diff(flat[order]) != 0])
    count = np.diff(np.r_[first, len(order)])
    rank = np.floor((count - 1) * percentile / 100.0).astype(np.int64)
    pick = first + np.minimum(rank, most)
    heights = np.zeros(int(shape.prod()))
    seen = np.zeros(int(shape.prod()), dtype=bool)
    cells = flat[order[first]]
    heights[cells] = xyz[order[pick], 2]
    seen[cells] = True
    return heights.reshape(shape), seen.reshape(shape)


def _pits(heights: Floats, cell: float) -> Bools:
    """Which cells hold false echoes from below: hardly another cell around lies as low."""
    from scipy.ndimage import rank_filter

    around = rank_filter(heights, rank=_WELL, size=7, mode="constant", cval=np.inf)
    return np.asarray(heights < around - cell)


def _objects(heights: Floats, cell: float) -> Bools:
    """Which cells something stands on that the opening removes at one step."""
    from scipy.ndimage import grey_opening

    found = np.zeros(heights.shape, dtype=bool)
    last, before, half = heights, 0, 1
    while half <= max(1.0, _WIDEST * max(heights.shape)):
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
    """Heights with unseen cells as a membrane would hang that is held by the seen ones.

    Coarse grids first, so that a few rounds of averaging a level settle gaps of any size; a sloping
    plane is filled exactly.
    """
    if seen.all() or not seen.any():
        return heights
    start = _fill_nearest(heights, seen) if min(heights.shape) < 4 else _from_coarse(heights, seen)
    filled = np.where(seen, heights, start)
    for _ in range(_ROUNDS):
        around = np.pad(filled, 1, mode="edge")
        mean = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
        filled = np.where(seen, heights, 0.25 * mean)
    return filled


def _from_coarse(heights: Floats, seen: Bools) -> Floats:
    """Fill a grid of half the resolution, and spread its cells."""
    nx, ny = heights.shape
    pad = ((0, nx % 2), (0, ny % 2))
    weight = np.pad(seen.astype(np.float64), pad)
    total = np.pad(np.where(seen, heights, 0.0), pad)
    weight, total = (
        part.reshape(part.shape[0] // 2, 2, part.shape[1] // 2, 2).sum(axis=(1, 3))
        for part in (weight, total)
    )
    coarse = _fill(total / np.maximum(weight, 1.0), weight > 0.0)
    return np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:nx, :ny]
