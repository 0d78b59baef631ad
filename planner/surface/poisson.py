"""The Poisson surface of a cloud: it spans holes and missing facades (paper 3.2.2)."""

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.scene import Box


def poisson_mesh(cloud: PointCloud, *, depth: int) -> Mesh:
    """Reconstruct the surface whose gradient fits the cloud's normals best.

    Parameters
    ----------
    cloud
        Points with outward normals, metres.
    depth
        Depth of the octree: 2^depth cells along the longest side.

    Returns
    -------
    mesh
        Closed but for the octree's rim, normals outward. Far from points it is invention:
        see :func:`trim`.

    Raises
    ------
    ValueError
        If the cloud has no normals.

    """
    import open3d as o3d

    if cloud.normals is None:
        raise ValueError("the Poisson surface needs normals, the cloud has none.")
    # copies, since Open3D refuses read-only arrays
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.xyz.copy()))
    points.normals = o3d.utility.Vector3dVector(cloud.normals.copy())
    # one thread: with more the result differs from run to run
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        points, depth=depth, n_threads=1
    )
    return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles))


def trim(mesh: Mesh, points: Floats, box: Box, *, distance: float, margin: float) -> Mesh:
    """Drop triangles far from every point or outside of the box, and vertices left alone.

    Parameters
    ----------
    mesh
        Surface, metres.
    points
        What was measured, shape (N, 3), metres.
    box
        Bounding box of the scene.
    distance
        Farthest that a vertex may lie from a point, metres.
    margin
        How far a vertex may lie outside of the box, metres.

    Returns
    -------
    mesh
        The triangles all of whose vertices remain, in their order.

    """
    from scipy.spatial import cKDTree

    near, _ = cKDTree(points).query(mesh.vertices, distance_upper_bound=distance)
    keep = np.isfinite(near) & box.contains(mesh.vertices, margin=margin)
    return select_triangles(mesh, keep[mesh.triangles].all(axis=1))


def select_triangles(mesh: Mesh, keep: np.ndarray) -> Mesh:
    """Return the mesh of the chosen triangles (a mask), without unused vertices."""
    triangles = mesh.triangles[keep]
    used, inverse = np.unique(triangles, return_inverse=True)
    return Mesh(mesh.vertices[used], inverse.reshape(-1, 3))
