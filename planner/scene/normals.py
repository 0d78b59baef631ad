"""Normals by principal components, turned to the side that is open to the sky."""

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.neighbours import Neighbours
from planner.scene.openness import SkyGrid, sky_grid
from planner.scene.scene import Ground
from planner.scene.sky_rays import sky_lead

_BLOCK = 65_536
_CELL = 2.0  # of the occupancy grid, in typical distances between points
_UP_BIAS = 0.03  # added for a normal that points up: ground and roofs are the rule
_WAY = 0.01  # weight of the grid against one of the rays: it decides where these do not
_MOST_HIDDEN = 0.9  # share of points inside beyond which the flood cannot be trusted
_OWN = 3.0  # neighbours that a point's own opinion weighs
_ROUNDS = 3  # of agreeing with the neighbours


def estimate_normals(
    cloud: PointCloud, neighbours: int, *, ground: Ground | None = None
) -> PointCloud:
    """Return the cloud with unit normals that point out of the solid.

    The axis is that of least variance among the nearest points. Its sign is the side that sees
    more of the sky, by a grid of the cloud itself; where that is undecided, the neighbours vote.

    Parameters
    ----------
    cloud
        Points, best thinned to an even density; normals that it has are replaced.
    neighbours
        How many nearest points (itself included) make a local plane.
    ground
        Terrain, which closes the scene from below.

    Returns
    -------
    cloud
        The same points with normals.

    Raises
    ------
    ValueError
        If there are fewer than three points or neighbours.

    """
    if len(cloud) < 3 or neighbours < 3:
        raise ValueError(f"need three points and neighbours, got {len(cloud)} and {neighbours}.")
    distance, near = Neighbours.of(cloud.xyz).nearest(cloud.xyz, min(neighbours, len(cloud)))
    axes = _least_axes(cloud.xyz, near)
    spacing = float(np.median(distance[:, min(4, distance.shape[1] - 1)]))
    grid = sky_grid(cloud.xyz, _cell(cloud.xyz, spacing), ground)
    normals = _agree(*_towards_sky(cloud.xyz, axes, grid), near)
    return PointCloud(cloud.xyz, normals, cloud.colours, cloud.classes)


def orient_samples(samples: PointCloud, mesh: Mesh, grid: SkyGrid, ground: Ground) -> PointCloud:
    """Turn the normals of a mesh's samples out of the solid, and leave out samples inside of it.

    The side that more rays reach the sky from is outside; where none does on either side, the one
    that a way through free cells joins with the sky.

    Parameters
    ----------
    samples
        Points with unit normals of either sign, such as those of a polygon soup.
    mesh
        The mesh that they were taken from.
    grid
        Openness around the mesh, from points that cover it without a gap.
    ground
        Terrain.

    Returns
    -------
    samples
        The points that a ray or a way through free space joins with the sky, with outward
        normals. All of them, if that were hardly any.

    Raises
    ------
    ValueError
        If the samples have no normals.

    """
    if samples.normals is None:
        raise ValueError("cannot orient samples without normals.")
    axes = samples.normals
    lead, seen = sky_lead(samples.xyz, axes, mesh, ground)
    way, hidden = grid.sides(samples.xyz, axes)
    lead = lead + _WAY * way + _WAY * _UP_BIAS * axes[:, 2]
    normals = np.where(lead[:, None] < 0.0, -axes, axes)
    turned = PointCloud(samples.xyz, normals, samples.colours, samples.classes)
    hidden &= ~seen
    return turned.take(~hidden) if hidden.mean() < _MOST_HIDDEN else turned


def _cell(xyz: Floats, spacing: float) -> float:
    """Width of a grid cell; never nothing, though all points coincide."""
    return max(_CELL * spacing, 1e-4 * float(np.ptp(xyz, axis=0).max()), 1e-9)


def _least_axes(xyz: Floats, near: Ints) -> Floats:
    """Unit axis of least variance of each neighbourhood, shape (N, 3), either sign."""
    axes = np.empty_like(xyz)
    for start in range(0, len(xyz), _BLOCK):
        rows = slice(start, start + _BLOCK)
        around = xyz[near[rows]]
        around = around - around.mean(axis=1, keepdims=True)
        spread = np.einsum("nki,nkj->nij", around, around)
        axes[rows] = np.linalg.eigh(spread)[1][:, :, 0]
    return axes


def _towards_sky(xyz: Floats, axes: Floats, grid: SkyGrid) -> tuple[Floats, Floats]:
    """Turn each axis to its open side; also how sure that is, shape (N,), >= 0."""
    lead = grid.sides(xyz, axes)[0] + _UP_BIAS * axes[:, 2]
    return np.where(lead[:, None] < 0.0, -axes, axes), np.abs(lead)


def _agree(normals: Floats, sure: Floats, near: Ints) -> Floats:
    """Flip normals that a clear majority of surer neighbours, weighted, contradicts."""
    for _ in range(_ROUNDS):
        vote = np.empty(len(normals))
        for start in range(0, len(normals), _BLOCK):
            rows = slice(start, start + _BLOCK)
            mean = (sure[near[rows], None] * normals[near[rows]]).sum(axis=1)
            vote[rows] = (mean * normals[rows]).sum(axis=1) + _OWN * sure[rows]
        wrong = vote < 0.0
        if not wrong.any():
            break
        normals = np.where(wrong[:, None], -normals, normals)
    return normals
