"""The bounding box along the scene's dominant horizontal directions (paper section 3.2.2).

A crop need not lie along the walls in it. Lengths follow from the longest side, so that walls may
turn the box only where it hardly gets longer: never by 41 %, as across a square.
"""

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.scene import Box

_BINS = 180  # half a degree each, over the quarter turn after which a block looks the same
_WALL = 0.35  # largest vertical part of a wall's normal
_CLEAR = 1.6  # how far the best direction must rise above the mean to count as dominant
_LONGER = 1.05  # longest side along the walls, at most, over that of the least rectangle
_LARGER = 1.5  # the same of the area: a narrow strip is not boxed across


def bounding_box(xyz: Floats, normals: Floats | None = None) -> Box:
    """Smallest box around the points with one vertical axis and two dominant ones.

    The horizontal axes follow the commonest azimuth of the walls, modulo a quarter turn; without
    normals, if no azimuth stands out, or if the longest side would be over 5 % longer or the area
    over half larger for it, they follow the rectangle of least area.

    Parameters
    ----------
    xyz
        Points, shape (N, 3), N >= 1, metres, local frame.
    normals
        Unit normals of these or of other points of the scene, shape (M, 3); the sign is ignored.

    Returns
    -------
    box
        The longer horizontal axis comes first and points to +x (or +y where it is exactly across).

    Raises
    ------
    ValueError
        If there is no point.

    """
    if len(xyz) == 0:
        raise ValueError("a box needs at least one point, got 0.")
    least = _box_along(xyz, _least_area_azimuth(xyz[:, :2]))
    azimuth = None if normals is None else _wall_azimuth(normals)
    if azimuth is None:
        return least
    along = _box_along(xyz, azimuth)
    hardly_longer = along.size[0] <= _LONGER * least.size[0]
    hardly_larger = along.size[:2].prod() <= _LARGER * least.size[:2].prod()
    return along if hardly_longer and hardly_larger else least


def _wall_azimuth(normals: Floats) -> float | None:
    """Commonest azimuth of wall normals in [0, pi/2), or ``None`` if none stands out."""
    walls = normals[np.abs(normals[:, 2]) < _WALL]
    if len(walls) < 50:
        return None
    angle = np.arctan2(walls[:, 1], walls[:, 0]) % (0.5 * np.pi)
    histogram = np.bincount(
        (angle / (0.5 * np.pi) * _BINS).astype(np.int64) % _BINS, minlength=_BINS
    ).astype(np.float64)
    kernel = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]) / 16.0
    smooth = sum(
        weight * np.roll(histogram, shift)
        for shift, weight in zip(range(-3, 4), kernel, strict=True)
    )
    best = int(np.argmax(smooth))
    if smooth[best] < _CLEAR * smooth.mean():
        return None
    near = (angle - (best + 0.5) / _BINS * 0.5 * np.pi + 0.25 * np.pi) % (
        0.5 * np.pi
    ) - 0.25 * np.pi
    near = near[np.abs(near) < np.radians(3.0)]
    return float(((best + 0.5) / _BINS * 0.5 * np.pi + np.median(near)) % (0.5 * np.pi))


def _least_area_azimuth(xy: Floats) -> float:
    """Azimuth of an edge of the convex hull whose rectangle has the least area."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = xy[ConvexHull(xy).vertices]
    except (QhullError, ValueError):  # fewer than three points, or all on a line
        far = xy[np.argmax(((xy - xy[0]) ** 2).sum(axis=1))] - xy[0]
        return float(np.arctan2(far[1], far[0]) % (0.5 * np.pi))
    edges = np.roll(hull, -1, axis=0) - hull
    angles = np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (0.5 * np.pi), 9))
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    across = np.column_stack([-np.sin(angles), np.cos(angles)])
    area = np.ptp(hull @ along.T, axis=0) * np.ptp(hull @ across.T, axis=0)
    return float(angles[np.argmin(area)])


def _box_along(xyz: Floats, azimuth: float) -> Box:
    """Box whose horizontal axes are turned by ``azimuth`` radians."""
    axes = np.eye(3)
    axes[0, :2] = np.cos(azimuth), np.sin(azimuth)
    axes[1, :2] = -np.sin(azimuth), np.cos(azimuth)
    size = np.ptp(xyz @ axes.T, axis=0)
    if size[1] > size[0]:
        axes[[0, 1]] = axes[1], -axes[0]
    lead = axes[0]
    if lead[0] < -1e-12 or (abs(lead[0]) <= 1e-12 and lead[1] < 0.0):
        axes[:2] *= -1.0
    local = xyz @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    return Box(centre=0.5 * (low + high) @ axes, axes=axes, size=high - low)
