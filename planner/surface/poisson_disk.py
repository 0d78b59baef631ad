"""Blue-noise samples of a mesh, given their distance and not their number (paper 3.2.2)."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.sampling import triangle_normals

_CANDIDATES = 32  # a disk of half the radius holds 25 on average: none is missed in practice
_LIMIT = 20_000_000  # darts, which bounds the memory


@dataclass(frozen=True, slots=True, eq=False)
class DiskSamples:
    """Points of a mesh, no two closer than the radius.

    Parameters
    ----------
    xyz
        Shape (S, 3), metres.
    triangle
        Triangle that each lies on, shape (S,).

    """

    xyz: Floats
    triangle: Ints


def poisson_disk(mesh: Mesh, radius: float, *, seed: int = 0) -> DiskSamples:
    """Draw samples at least ``radius`` apart that leave no gap between them.

    Darts are thrown at the mesh, uniform in area, until every candidate is taken or blocked; what
    is left between samples is then smaller than a disk of half the radius, so that the surface lies
    within 1.5 ``radius`` of a sample.

    Parameters
    ----------
    mesh
        Surface, metres.
    radius
        Poisson-disk radius R, metres, positive.
    seed
        Of the darts.

    Returns
    -------
    samples
        In the order in which they were accepted.

    Raises
    ------
    ValueError
        If the radius is not positive, or so small that the darts would not fit into memory.

    """
    from planner.surface.darts import throw_darts

    if not radius > 0.0:
        raise ValueError(f"radius must be positive, got {radius}.")
    _, area = triangle_normals(mesh)
    total = float(area.sum())
    if total == 0.0:
        return DiskSamples(np.empty((0, 3)), np.empty(0, np.int64))
    count = int(np.ceil(_CANDIDATES * total / radius**2)) + _CANDIDATES
    if count > _LIMIT:
        raise ValueError(
            f"radius {radius} m needs {count} darts on {total:.0f} m2; at most {_LIMIT}."
        )
    rng = np.random.default_rng(seed)
    triangle = np.searchsorted(np.cumsum(area), rng.random(count) * total, side="right")
    triangle = np.minimum(triangle, len(mesh) - 1)
    xyz = _points_in_triangles(mesh, triangle, rng)
    rows = np.flatnonzero(throw_darts(xyz, float(radius)))
    return DiskSamples(xyz[rows], triangle[rows].astype(np.int64))


def least_radius(mesh: Mesh) -> float:
    """Smallest radius, metres, whose darts on all of a mesh fit into memory."""
    _, area = triangle_normals(mesh)
    return float(np.sqrt(_CANDIDATES * area.sum() / (_LIMIT - 2 * _CANDIDATES)))


def _points_in_triangles(mesh: Mesh, triangle: Ints, rng: np.random.Generator) -> Floats:
    root, along = np.sqrt(rng.random((len(triangle), 1))), rng.random((len(triangle), 1))
    a, b, c = (mesh.vertices[mesh.triangles[triangle, k]] for k in range(3))
    return np.asarray((1.0 - root) * a + root * (1.0 - along) * b + root * along * c)
