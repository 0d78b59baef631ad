"""From the prior to its surface and directed samples (paper 3.2.2)."""

from collections.abc import Iterable

import numpy as np

from planner.config import SurfaceSettings
from planner.errors import PlannerError
from planner.geometry.arrays import Bools, Floats
from planner.scene.cleaning import thin
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.normals import estimate_normals
from planner.scene.sampling import triangle_normals
from planner.scene.scene import Ground, Scene
from planner.surface.clusters import cluster_samples
from planner.surface.openness import openness
from planner.surface.oriented import joined, normals_of
from planner.surface.poisson import poisson_mesh
from planner.surface.poisson_disk import least_radius, poisson_disk
from planner.surface.samples import THINNING, Surface, SurfaceSamples
from planner.surface.snap import snap_to_cloud
from planner.surface.trim import trim
from planner.surface.walls import stand_walls

DEFAULTS = SurfaceSettings()
_SNAP = 0.8  # share of R within which points pull the surface
_PER_CLUSTER = 400
_OPEN = 0.06  # of the rays that rise on one side: fewer, and that side is inside


def reconstruct_surface(
    scene: Scene,
    *,
    radius: float,
    poisson_depth: int,
    settings: SurfaceSettings = DEFAULTS,
    normal_neighbours: int = 16,
    seed: int = 0,
) -> Surface:
    """Reconstruct the surface of a scene and draw directed samples on what can be reached of it.

    A cloud gets a Poisson surface, snapped to its points and cut off far from them; what spans
    holes and missing facades stays, since this is what must be photographed. A mesh is its own
    surface. Samples on inner sides, below the ground and on the undersides that Poisson invents
    are left out; an orientation that contradicts the open sky is turned.

    Parameters
    ----------
    scene
        The prior.
    radius
        Poisson-disk radius R, metres.
    poisson_depth
        Depth of the Poisson octree; a cell of about R/4 shows what R can sample.
    settings
        Number of clusters, and where the surface is cut off.
    normal_neighbours
        Points that a normal is estimated from.
    seed
        Of the samples.

    Returns
    -------
    surface
        Mesh, samples, and the thinned cloud with normals.

    Raises
    ------
    PlannerError
        If no sample remains, or so many would be drawn that they do not fit into memory.

    """
    thinned = _with_normals(thin(scene.cloud, THINNING * radius), normal_neighbours, scene.ground)
    if scene.mesh is not None:
        mesh = scene.mesh
    else:
        mesh = _poisson(thinned, scene.ground, radius, poisson_depth, settings)
    least = least_radius(mesh)
    if radius < least:
        raise PlannerError(
            f"{scene.source or scene.name}: samples {radius:.3g} m apart are too many for a "
            f"surface of {triangle_normals(mesh)[1].sum():.0f} m2; set scale.radius to at least "
            f"{_rounded_up(least)} m"
        )
    samples = _sample(mesh, thinned, scene.ground, radius=radius, settings=settings, seed=seed)
    if len(samples) == 0:
        raise PlannerError(
            f"{scene.source or scene.name}: no surface sample of radius {radius:.3g} m can be "
            "reached from outside; set scale.radius between the spacing of the points and the size "
            "of what they show, or check the up axis"
        )
    return Surface(mesh, samples, thinned)


def other_samples(
    surface: Surface, ground: Ground, *, settings: SurfaceSettings = DEFAULTS, seeds: Iterable[int]
) -> SurfaceSamples:
    """Draw more samples of a surface, as dense as its own once for each seed.

    Parameters
    ----------
    surface, ground
        What :func:`reconstruct_surface` gave, and the ground of its scene.
    settings
        Of the surface.
    seeds
        Any integers from 0; other ones than that of the surface's own samples.

    """
    draws = [
        _sample(
            *(surface.mesh, surface.thinned, ground),
            radius=surface.samples.radius,
            settings=settings,
            seed=seed,
        )
        for seed in seeds
    ]
    return SurfaceSamples(
        np.concatenate([draw.xyz for draw in draws]),
        np.concatenate([draw.normals for draw in draws]),
        np.concatenate([draw.cluster for draw in draws]),
        surface.samples.radius,
    )


def _poisson(
    thinned: PointCloud, ground: Ground, radius: float, depth: int, settings: SurfaceSettings
) -> Mesh:
    known = thinned
    if settings.walls:
        known = joined(thinned, stand_walls(thinned, ground, radius=radius))
    rough = poisson_mesh(known, depth=depth)
    cut = trim(rough, known.xyz, ground, radius=radius, distance=settings.trim * radius)
    return snap_to_cloud(cut, thinned, reach=_SNAP * radius)


def _with_normals(cloud: PointCloud, neighbours: int, ground: Ground) -> PointCloud:
    if cloud.normals is not None:
        return cloud
    return estimate_normals(cloud, neighbours, ground=ground)


def _sample(
    mesh: Mesh,
    thinned: PointCloud,
    ground: Ground,
    *,
    radius: float,
    settings: SurfaceSettings,
    seed: int,
) -> SurfaceSamples:
    drawn = poisson_disk(mesh, radius, seed=seed)
    normals = triangle_normals(mesh)[0][drawn.triangle]
    sides = openness(mesh, drawn.xyz, normals, lift=0.02 * radius)
    turn = sides.back > sides.front
    normals = np.where(turn[:, None], -normals, normals)
    front = np.maximum(sides.front, sides.back)
    below = np.where(turn, sides.back_below, sides.front_below)
    mean, supported = _mean_normals(drawn.xyz, normals, thinned, radius)
    height = drawn.xyz[:, 2] - ground.height(drawn.xyz)
    keep = _reachable(
        normals, front=front, below=below, supported=supported, height=height, radius=radius
    )
    xyz, normals = drawn.xyz[keep], mean[keep]
    count = settings.clusters or max(1, round(len(xyz) / _PER_CLUSTER))
    return SurfaceSamples(xyz, normals, cluster_samples(xyz, normals, count), radius)


def _rounded_up(length: float) -> str:
    """At least this length, in three digits or so."""
    return f"{length * 1.005:.3g}"


def _reachable(
    normals: Floats,
    *,
    front: Floats,
    below: Floats,
    supported: Bools,
    height: Floats,
    radius: float,
) -> Bools:
    """Tell which samples have open space before them; undersides must have been measured too."""
    underside = (normals[:, 2] < -0.5) & supported & (height > radius) & (below > _OPEN)
    return ((front > _OPEN) & (normals[:, 2] > -0.5) & (height > -radius)) | underside


def _mean_normals(
    xyz: Floats, normals: Floats, cloud: PointCloud, radius: float
) -> tuple[Floats, Bools]:
    """Mean normal of the points within R that face the sample's way, else the surface's own.

    Returns the unit normals, shape (S, 3), and whether there was any such point, shape (S,).
    """
    from scipy.spatial import cKDTree

    facing_out = normals_of(cloud)
    pairs = cKDTree(xyz).sparse_distance_matrix(cKDTree(cloud.xyz), radius, output_type="ndarray")
    row, point = pairs["i"], pairs["j"]
    facing = np.einsum("pc,pc->p", normals[row], facing_out[point]) > 0.5
    row, point = row[facing], point[facing]
    total = np.column_stack(
        [np.bincount(row, facing_out[point, axis], minlength=len(xyz)) for axis in range(3)]
    )
    length = np.linalg.norm(total, axis=1)
    found = length > 1e-9
    mean = np.where(found[:, None], total / np.where(found, length, 1.0)[:, None], normals)
    return mean, found
