"""Which side of a surface is outside: the one that the open sky can be seen from."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bools, Floats
from planner.scene.cloud import Mesh

_GRAZING = 0.17  # cosine of 80 degrees: flatter rays say little about a rough surface
_BLOCK = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Openness:
    """Share of escaping rays on both sides of each sample.

    Parameters
    ----------
    front, back
        Share of the level or rising rays on the side of the normal, and on the other, that meet
        nothing, shape (S,), in [0, 1]. 0 where no ray rises on that side.
    front_below, back_below
        The same of the descending rays.

    """

    front: Floats
    back: Floats
    front_below: Floats
    back_below: Floats


def openness(mesh: Mesh, xyz: Floats, normals: Floats, *, lift: float, rays: int = 96) -> Openness:
    """Cast rays from both sides of each sample and count those that leave the scene.

    Parity and orientation of the mesh play no part, so that open sheets and polygon soups serve.

    Parameters
    ----------
    mesh
        What stops the rays, metres.
    xyz, normals
        Samples on it, shape (S, 3), and their unit normals.
    lift
        How far along the normal, to either side, the rays start, metres.
    rays
        Directions on the whole sphere.

    Returns
    -------
    openness
        Of each sample, in order.

    """
    directions = _spread(rays)
    caster = _caster(mesh)
    shares = [np.empty(len(xyz)) for _ in range(4)]
    step = max(1, _BLOCK // rays)
    for first in range(0, len(xyz), step):
        rows = slice(first, first + step)
        cosine = normals[rows] @ directions.T  # (n, rays)
        starts = xyz[rows, None, :] + (lift * np.sign(cosine))[:, :, None] * normals[rows, None, :]
        free = ~_occluded(caster, starts, np.broadcast_to(directions, starts.shape))
        rising = directions[:, 2] >= 0.0
        for share, side, height in zip(
            shares,
            (cosine > _GRAZING, cosine < -_GRAZING) * 2,
            (rising, rising, ~rising, ~rising),
            strict=True,
        ):
            share[rows] = _share(free, side & height)
    return Openness(*shares)


def _share(free: Bools, chosen: Bools) -> Floats:
    return np.asarray((free & chosen).sum(axis=1) / np.maximum(chosen.sum(axis=1), 1))


def _spread(count: int) -> Floats:
    """Directions spread evenly over the sphere by the golden angle, shape (count, 3)."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    level = np.sqrt(1.0 - z * z)
    return np.column_stack([level * np.cos(turn), level * np.sin(turn), z])


def _caster(mesh: Mesh):  # type: ignore[no-untyped-def]  # open3d has no types
    import open3d as o3d

    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(
        o3d.core.Tensor.from_numpy(mesh.vertices.astype(np.float32)),
        o3d.core.Tensor.from_numpy(mesh.triangles.astype(np.uint32)),
    )
    return caster


def _occluded(caster, starts: Floats, directions: Floats) -> Bools:  # type: ignore[no-untyped-def]
    import open3d as o3d

    rays = np.concatenate([starts, directions], axis=-1).astype(np.float32)
    return np.asarray(caster.test_occlusions(o3d.core.Tensor.from_numpy(rays)).numpy())
