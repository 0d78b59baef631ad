"""How much of the sky the two sides of a mesh's surface see, by exact rays.

Unlike a grid of cells, rays tell the sides of a thin parapet apart and pass no crack.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from planner.geometry.arrays import Bools, Floats
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground

_RINGS = ((-25.0, 8), (5.0, 16), (20.0, 8), (50.0, 8), (78.0, 8))  # elevation, rays in the ring
_LIFT = 1e-5  # of the scene's length, off the surface
_BLOCK = 1_000_000  # rays at once


def sky_lead(xyz: Floats, normals: Floats, mesh: Mesh, ground: Ground) -> tuple[Floats, Bools]:
    """Compare the sky that both sides of each point of a surface see.

    Parameters
    ----------
    xyz, normals
        Points on the mesh and unit normals of either sign, shape (N, 3), local frame.
    mesh
        Triangles of any orientation.
    ground
        Terrain; from a point that lies on it no ray goes down.

    Returns
    -------
    lead
        Share of rays that reach the sky in front (along the normal) less those behind, shape
        (N,). A ray that goes down may bounce off once, so that undersides face the open too.
    open
        Whether any ray is open, shape (N,).

    """
    import open3d as o3d

    scene: Any = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32))

    def flight(start: Floats, way: Floats) -> Floats:
        rays = np.concatenate([start, way], axis=-1).astype(np.float32)
        return np.asarray(scene.cast_rays(rays, nthreads=1)["t_hit"].numpy(), dtype=np.float64)

    lift = _LIFT * float(np.ptp(mesh.vertices, axis=0).max())
    raised = xyz[:, 2] - ground.height(xyz) > ground.cell
    ways = _ways()
    lead = np.zeros(len(xyz))
    seen = np.zeros(len(xyz), dtype=bool)
    size = max(1, _BLOCK // len(ways))
    for first in range(0, len(xyz), size):
        rows = slice(first, first + size)
        side = np.sign(normals[rows] @ ways.T)  # (n, W): whether a ray starts in front
        start = xyz[rows][:, None, :] + lift * side[:, :, None] * normals[rows][:, None, :]
        free = _open(flight, start, ways, lift) & (side != 0.0)
        free &= raised[rows][:, None] | (ways[:, 2] >= 0.0)
        lead[rows] = (side * free).sum(axis=1) / len(ways)
        seen[rows] = free.any(axis=1)
    return lead, seen


def _open(
    flight: Callable[[Floats, Floats], Floats], start: Floats, ways: Floats, lift: float
) -> Bools:
    """Which rays reach the sky, shape (n, W); one that goes down may bounce off once."""
    every = np.broadcast_to(ways, start.shape)
    far = flight(start, every)
    free = np.isinf(far)
    down = np.broadcast_to(ways[:, 2] < 0.0, far.shape) & ~free
    spot = start[down] + (far[down] - lift)[:, None] * every[down]
    free[down] = np.isinf(flight(spot, every[down] * [1.0, 1.0, -1.0]))
    return np.asarray(free)


def _ways() -> Floats:
    """Unit directions of the rays, shape (W, 3)."""
    found = []
    for elevation, count in _RINGS:
        turn = np.arange(count) * (2.0 * np.pi / count) + 0.1 * (1.0 + np.abs(elevation) / 10.0)
        up, level = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
        ring = [level * np.cos(turn), level * np.sin(turn), np.full(count, up)]
        found.append(np.column_stack(ring))
    return np.concatenate([*found, [[0.0, 0.0, 1.0]]])
