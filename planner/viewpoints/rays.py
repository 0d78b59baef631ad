"""Occlusion of straight lines by a triangle mesh."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Floats
from planner.scene.cloud import Mesh

_BLOCK = 1_000_000


class RayCaster:
    """Casts float32 rays against a mesh, both sides of each triangle, in bounded blocks.

    Parameters
    ----------
    mesh
        What blocks the view; coordinates must be local, since single precision is too
        coarse for georeferenced ones. Without triangles nothing is in the way.

    """

    def __init__(self, mesh: Mesh) -> None:
        import open3d

        o3d: Any = open3d  # its type stubs know no NumPy arrays
        self._mesh = mesh
        self._tensor = o3d.core.Tensor
        self._scene = o3d.t.geometry.RaycastingScene() if len(mesh) else None
        if self._scene is not None:
            self._scene.add_triangles(
                self._tensor(mesh.vertices.astype(np.float32)),
                self._tensor(mesh.triangles.astype(np.uint32)),
            )

    def __reduce__(self) -> tuple[type["RayCaster"], tuple[Mesh]]:
        """Send the mesh alone to other processes, which build their own structures."""
        return RayCaster, (self._mesh,)

    def blocked(self, starts: NDArray[np.float32], ends: NDArray[np.float32]) -> Bools:
        """Tell between which points, both (N, 3), the mesh lies.

        The first thousandth of each line is not looked at, since the noise of a surface seen
        from afar grows with the distance.
        """
        found = np.zeros(len(starts), dtype=np.bool_)
        if self._scene is None:
            return found
        for first in range(0, len(starts), _BLOCK):
            part = slice(first, first + _BLOCK)
            rays = np.concatenate([starts[part], ends[part] - starts[part]], axis=1)
            hit = self._scene.test_occlusions(self._tensor(rays), tnear=1e-3, tfar=1.0)
            found[part] = hit.numpy()
        return found

    def lift(self, points: Floats, normals: Floats, *, radius: float) -> NDArray[np.float32]:
        """Move samples along their normals to just outside of the surface.

        A sample of the real surface may lie behind a rounded reconstruction of it. It is
        lifted onto the outermost layer within half a ``radius`` along its normal, and then
        by an eighth of a radius more.

        Parameters
        ----------
        points, normals
            Samples and their unit outward normals, shape (S, 3), metres.
        radius
            Spacing of the samples, metres.

        Returns
        -------
        starts
            Where rays begin, shape (S, 3).

        """
        reach = 0.5 * radius
        rise = np.zeros(len(points))
        if self._scene is not None and len(points):
            rays = np.concatenate([points + reach * normals, -reach * normals], axis=1)
            cast = self._scene.cast_rays(self._tensor(rays.astype(np.float32)))
            depth = cast["t_hit"].numpy().astype(np.float64)  # 0 at the top, 1 at the sample
            rise = np.where(depth < 1.0, (1.0 - depth) * reach, 0.0)
        return (points + (rise + 0.125 * radius)[:, None] * normals).astype(np.float32)
