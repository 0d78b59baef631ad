"""Points spread evenly over a mesh."""

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.cloud import Mesh, PointCloud


def triangle_normals(mesh: Mesh) -> tuple[Floats, Floats]:
    """Unit normals, shape (T, 3), by winding, and areas, shape (T,), square metres.

    A triangle without area has the normal (0, 0, 1).
    """
    corners = mesh.vertices[mesh.triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1)
    flat = length <= 0.0
    unit = cross / np.where(flat, 1.0, length)[:, None]
    unit[flat] = (0.0, 0.0, 1.0)
    return unit, 0.5 * length


def sample_mesh(mesh: Mesh, spacing: float, seed: int) -> PointCloud:
    """Spread points uniformly by area, about one per ``spacing`` squared.

    Points fall by systematic sampling along the running area, so that each triangle gets its share
    to within one point; the position in the triangle is uniform.

    Parameters
    ----------
    mesh
        Triangles, local frame.
    spacing
        Wanted distance between points, metres.
    seed
        Seed of the positions.

    Returns
    -------
    cloud
        Points with the unit normals of their triangles as these are wound.

    Raises
    ------
    ValueError
        If the spacing is not positive or the mesh has no area.

    """
    if not spacing > 0.0:
        raise ValueError(f"spacing must be positive, got {spacing}.")
    normals, areas = triangle_normals(mesh)
    total = float(areas.sum())
    if not total > 0.0:
        raise ValueError(f"a mesh of {len(mesh)} triangles has area {total}.")
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    count = max(1, round(total / spacing**2))
    ticks = (np.arange(count) + rng.random()) * (total / count)
    face = np.searchsorted(np.cumsum(areas), ticks).clip(0, len(areas) - 1)
    u, v = rng.random((2, count))
    root = np.sqrt(u)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles[face]], 1, 0)
    xyz = a * (1.0 - root)[:, None] + b * (root * (1.0 - v))[:, None] + c * (root * v)[:, None]
    return PointCloud(xyz, normals[face])
