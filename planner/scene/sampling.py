"""Points spread evenly over a mesh."""

import numpy as np

from planner.geometry.arrays import Floats, Ints
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


def cover_mesh(mesh: Mesh, step: float) -> Floats:
    """Points on every triangle, edges and corners included, no gap wider than about ``step``.

    Unlike :func:`sample_mesh` it leaves no hole by chance, so that the cells that these points
    mark close the surface.

    Parameters
    ----------
    mesh
        Triangles, local frame.
    step
        Widest distance between neighbours in a row, and between rows, metres.

    Returns
    -------
    xyz
        Shape (N, 3), about the area over ``step`` squared plus the edges' length over ``step``.

    Raises
    ------
    ValueError
        If the step is not positive.

    """
    if not step > 0.0:
        raise ValueError(f"step must be positive, got {step}.")
    corners = mesh.vertices[mesh.triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    longest = np.argmax(sides, axis=1)
    turned = (longest[:, None] + np.arange(3)) % 3
    a, b, apex = np.moveaxis(np.take_along_axis(corners, turned[:, :, None], axis=1), 1, 0)
    base = np.maximum(sides.max(axis=1, initial=0.0), 1e-300)
    height = 2.0 * triangle_normals(mesh)[1] / base
    rows, at = _ladder(height / step)
    face = np.repeat(np.arange(len(mesh)), rows)
    low, high = (p[face] + (apex[face] - p[face]) * at[:, None] for p in (a, b))
    rows_and_edges = (
        np.concatenate([low, corners.reshape(-1, 3)]),
        np.concatenate([high, np.roll(corners, -1, axis=1).reshape(-1, 3)]),
    )
    return _along(*rows_and_edges, step)


def _along(start: Floats, end: Floats, step: float) -> Floats:
    """Points at most ``step`` apart along each segment, its ends included."""
    count, at = _ladder(np.linalg.norm(end - start, axis=1) / step)
    row = np.repeat(np.arange(len(start)), count)
    return np.asarray(start[row] + (end[row] - start[row]) * at[:, None])


def _ladder(lengths: Floats) -> tuple[Ints, Floats]:
    """Rungs at most 1 apart on each of many ladders: their numbers, and places in [0, 1]."""
    gaps = np.ceil(lengths).astype(np.int64).clip(1)
    count = gaps + 1
    rung = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return count, rung / np.repeat(gaps, count)
