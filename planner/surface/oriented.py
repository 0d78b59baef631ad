"""Clouds whose normals are known."""

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.cloud import PointCloud


def normals_of(cloud: PointCloud) -> Floats:
    """Return the outward unit normals of a cloud, shape (N, 3).

    Raises
    ------
    ValueError
        If it has none.

    """
    if cloud.normals is None:
        raise ValueError("the cloud has no normals; planner.scene.normals estimates them.")
    return cloud.normals


def joined(first: PointCloud, second: PointCloud) -> PointCloud:
    """Positions and normals of two clouds together, in that order."""
    xyz = np.vstack([first.xyz, second.xyz])
    return PointCloud(xyz, np.vstack([normals_of(first), normals_of(second)]))
