"""The Poisson surface of a cloud: it spans holes and missing facades (paper 3.2.2)."""

import numpy as np

from planner.scene.cloud import Mesh, PointCloud
from planner.surface.oriented import normals_of


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
        see :mod:`planner.surface.trim`.

    Raises
    ------
    ValueError
        If the cloud has no normals.

    """
    import open3d as o3d

    # copies, since Open3D refuses read-only arrays
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.xyz.copy()))
    points.normals = o3d.utility.Vector3dVector(normals_of(cloud).copy())
    # one thread: with more the result differs from run to run
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        points, depth=depth, n_threads=1
    )
    return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles))
