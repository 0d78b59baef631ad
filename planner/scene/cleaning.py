"""Thinning a cloud to an even density, and dropping stray points."""

import itertools

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import PointCloud
from planner.scene.neighbours import Neighbours

_MOST_CELLS = 2**21  # along an axis: three of them fit one 64-bit key
_RIM = 4  # free cells around, so that the key of a neighbour never wraps
_STRAY = 3.0  # how much lonelier than its neighbours a stray point is


def cell_keys(xyz: Floats, spacing: float) -> Ints:
    """One integer for the cubic cell of each point, shape (N,).

    Raises
    ------
    ValueError
        If the spacing is not positive, or so small that the keys would overflow.

    """
    if not spacing > 0.0:
        raise ValueError(f"spacing must be positive, got {spacing}.")
    index = np.floor((xyz - xyz.min(axis=0, initial=np.inf)) / spacing) + _RIM
    if len(index) and index.max() >= _MOST_CELLS - _RIM:
        raise ValueError(f"spacing {spacing} cuts the cloud into more than {_MOST_CELLS} cells.")
    column = index.astype(np.int64)
    return np.asarray((column[:, 0] << 42) | (column[:, 1] << 21) | column[:, 2])


def thin(cloud: PointCloud, spacing: float) -> PointCloud:
    """Keep one point a cubic cell: the one nearest to the mean of the cell's points.

    Parameters
    ----------
    cloud
        Any number of points.
    spacing
        Cell width, metres.

    Returns
    -------
    thinned
        A subset of the points with their attributes, in their old order; the same for any order
        of equal input.

    Raises
    ------
    ValueError
        If the spacing is not positive or far too small.

    """
    if len(cloud) == 0:
        return cloud
    keys = cell_keys(cloud.xyz, spacing)
    order = np.argsort(keys, kind="stable")
    sorted_keys = keys[order]
    first = np.flatnonzero(np.r_[True, sorted_keys[1:] != sorted_keys[:-1]])
    count = np.diff(np.r_[first, len(order)])
    points = cloud.xyz[order]
    mean = np.add.reduceat(points, first, axis=0) / count[:, None]
    group = np.repeat(np.arange(len(first)), count)
    off = ((points - mean[group]) ** 2).sum(axis=1)
    nearest = np.minimum.reduceat(off, first)
    hits = np.flatnonzero(off == nearest[group])
    _, one_each = np.unique(group[hits], return_index=True)  # ties go to the lowest row
    return cloud.take(np.sort(order[hits[one_each]]))


def stray_points(xyz: Floats, neighbours: int, sigma: float) -> Bools:
    """Tell which points float alone, away from any structure.

    A point is stray if the mean distance to its ``neighbours`` nearest exceeds the cloud's mean of
    that number by ``sigma`` standard deviations, and if its few nearest (a quarter of these) lie
    three times as far as is usual among them. The second condition keeps what is merely sparse,
    such as the facades, wires and masts in an airborne scan.

    Parameters
    ----------
    xyz
        Points, shape (N, 3), metres.
    neighbours
        How many nearest points to look at.
    sigma
        Standard deviations above the mean.

    Returns
    -------
    stray
        Shape (N,).

    """
    stray = np.zeros(len(xyz), dtype=bool)
    if len(xyz) <= neighbours + 1:
        return stray
    tree = Neighbours.of(xyz)
    probe = xyz[:: max(1, len(xyz) // 20_000)]
    typical = tree.nearest(probe, neighbours + 1)[0][:, 1:].mean(axis=1)
    limit = float(typical.mean() + sigma * typical.std())
    if limit <= 0.0:
        return stray
    rows = np.flatnonzero(~_crowded(xyz, limit, neighbours))
    if len(rows) == 0:
        return stray
    few = max(2, neighbours // 4)
    distance, near = tree.nearest(xyz[rows], neighbours + 1)
    beyond = distance[:, 1:].mean(axis=1) > limit
    around = xyz[near[beyond, 1 : few + 1].ravel()]
    usual = np.median(tree.nearest(around, few + 1)[0][:, few].reshape(-1, few), axis=1)
    stray[rows[beyond]] = distance[beyond, few] > _STRAY * usual
    return stray


def _crowded(xyz: Floats, reach: float, neighbours: int) -> Bools:
    """Points with surely more than ``neighbours`` points within ``reach``, themselves included.

    Counts the points in those cells around a point's own, a quarter of ``reach`` wide, that lie
    within reach as a whole. A point that is not counted as crowded may be so all the same.
    """
    width = reach / 4.0
    if np.ptp(xyz, axis=0).max() / width > _MOST_CELLS - 8:
        return np.zeros(len(xyz), dtype=bool)
    keys = cell_keys(xyz, width)
    cells, cell, count = np.unique(keys, return_inverse=True, return_counts=True)
    below = np.r_[0, np.cumsum(count)]
    total = np.zeros(len(cells), dtype=np.int64)
    for i, j in itertools.product(range(-2, 3), repeat=2):
        left = 16.0 - (abs(i) + 1) ** 2 - (abs(j) + 1) ** 2
        if left < 1.0:
            continue
        up = int(np.sqrt(left)) - 1
        centre = cells + (i << 42) + (j << 21)
        first = np.searchsorted(cells, centre - up, side="left")
        last = np.searchsorted(cells, centre + up, side="right")
        total += below[last] - below[first]
    return np.asarray(total[cell] > neighbours)


def drop_outliers(cloud: PointCloud, neighbours: int, sigma: float) -> PointCloud:
    """Return the cloud without its stray points (see :func:`stray_points`)."""
    stray = stray_points(cloud.xyz, neighbours, sigma)
    return cloud.take(~stray) if stray.any() else cloud
