"""Which points lie in solid matter, told by the true mesh itself."""

import numpy as np

from planner.geometry.arrays import Bools, Floats
from planner.scene.cloud import Mesh
from planner.scene.first_flight import ray_scene
from planner.scene.sampling import triangle_normals

_SKEW = np.array([0.0021, 0.0013, 1.0])  # a ray straight up would run along walls


def inside(mesh: Mesh, points: Floats) -> Bools:
    """Tell which points lie in a solid or under the ground.

    A ray to the sky leaves every solid that its start lies in: the sum over all crossings, +1 where
    the ray comes out of a face and -1 where it goes in, is the number of solids around the start.
    That holds for solids that overlap, where a parity would not.

    Parameters
    ----------
    mesh
        Closed solids with outward faces, and an open ground sheet that faces up.
    points
        Shape (N, 3), metres, within the sheet's outline.

    Returns
    -------
    inside
        Shape (N,).

    """
    rays = np.column_stack([points, np.broadcast_to(_SKEW, (len(points), 3))])
    answer = ray_scene(mesh).list_intersections(rays.astype(np.float32))
    row = answer["ray_ids"].numpy().astype(np.int64)
    normals, _ = triangle_normals(mesh)
    out = np.sign(normals[answer["primitive_ids"].numpy().astype(np.int64)] @ _SKEW)
    return np.bincount(row, weights=out, minlength=len(points)) > 0.5
