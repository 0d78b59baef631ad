"""Pull a Poisson surface, which rounds every edge, onto the points that it was made from."""

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.sampling import triangle_normals
from planner.surface.oriented import normals_of


def vertex_normals(mesh: Mesh) -> Floats:
    """Area-weighted unit normal of each vertex, shape (N, 3); 0 where triangles cancel."""
    normals, area = triangle_normals(mesh)
    weighted = normals * area[:, None]
    total = np.zeros_like(mesh.vertices)
    for corner in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(
                mesh.triangles[:, corner], weighted[:, axis], minlength=len(total)
            )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(total / np.where(length > 0.0, length, 1.0))


def snap_to_cloud(mesh: Mesh, cloud: PointCloud, *, reach: float, neighbours: int = 12) -> Mesh:
    """Move each vertex onto the plane of the nearby points that face the same way.

    The plane passes through the weighted mean of the points, across their weighted mean normal;
    weights fall with distance and with the angle between normals, so that at an edge each side
    keeps to its own plane. Where no such point is within reach the surface stays as it is.

    Parameters
    ----------
    mesh
        Surface with outward triangles, metres.
    cloud
        Points with normals, about ``reach`` / 2 apart.
    reach
        Farthest point that counts, and the farthest that a vertex moves, metres.
    neighbours
        Points that are asked.

    Returns
    -------
    mesh
        The same triangles with moved vertices.

    """
    from scipy.spatial import cKDTree

    normals = normals_of(cloud)
    distance, row = cKDTree(cloud.xyz).query(
        mesh.vertices, k=min(neighbours, len(cloud)), distance_upper_bound=reach
    )
    near = np.isfinite(distance)
    row = np.where(near, row, 0)
    own = vertex_normals(mesh)
    facing = np.einsum("vkc,vc->vk", normals[row], own).clip(0.0) ** 2
    weight = np.where(near, np.exp(-((2.0 * np.where(near, distance, 0.0) / reach) ** 2)), 0.0)
    weight *= facing
    total = weight.sum(axis=1)
    safe = np.maximum(total, 1e-12)[:, None]
    centre = np.einsum("vk,vkc->vc", weight, cloud.xyz[row]) / safe
    normal = np.einsum("vk,vkc->vc", weight, normals[row])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    shift = np.einsum("vc,vc->v", centre - mesh.vertices, normal)
    shift = np.where((total > 0.1) & (np.abs(shift) <= reach), shift, 0.0)
    return Mesh(mesh.vertices + shift[:, None] * normal, mesh.triangles)
