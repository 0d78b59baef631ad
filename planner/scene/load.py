"""From a file to a scene: read, place, clean, and find ground and bounding box."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.config import SceneSettings
from planner.geometry.arrays import Floats, Ints
from planner.scene.box import bounding_box
from planner.scene.cleaning import stray_points, thin
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.degenerate import check_shape
from planner.scene.ground import estimate_ground
from planner.scene.images import load_images
from planner.scene.normals import estimate_normals, orient_samples
from planner.scene.openness import finest_cell, sky_grid
from planner.scene.placing import Placed, place
from planner.scene.readers.formats import read_source
from planner.scene.readers.source import refusal
from planner.scene.sampling import cover_mesh, sample_mesh, triangle_normals
from planner.scene.scene import Ground, Scene

_DEFAULTS = SceneSettings()
_SAMPLE = 0.25 * 0.015  # of the longest side: a quarter of the default radius R
_GROUND_CELL = 0.5 * 0.015  # of the longest side
_HOUSE = 2.0  # metres: a wider cell would hold a low shed together with its yard
_MOST_SAMPLES = 2_000_000


def load_scene(path: Path | str, settings: SceneSettings = _DEFAULTS) -> Scene:
    """Read a scan or a model and make it ready for planning.

    Parameters
    ----------
    path
        PLY, LAS/LAZ, PCD, XYZ/CSV/TXT, OBJ, STL, OFF, GLB/glTF, CityJSON or CityJSONSeq file.
    settings
        Up axis, unit, CRS, cleaning, and poses of the first flight's photos.

    Returns
    -------
    scene
        Local frame, metres, z up. A cloud is cleaned but not thinned and has no normals (those of
        a file may point anywhere: :func:`planner.scene.normals.estimate_normals` makes new ones);
        a mesh is sampled, with outward normals, without what no way from the sky leads to.

    Raises
    ------
    PlannerError
        If the file cannot be used, with the reason and the remedy in one line.

    """
    path = Path(path)
    placed = place(path, read_source(path, limit=settings.max_points), settings)
    if placed.source.triangles is None:
        scene = _cloud_scene(path, placed, settings)
    else:
        scene = _mesh_scene(path, placed, placed.source.triangles)
    return with_images(scene, settings)


def with_images(scene: Scene, settings: SceneSettings = _DEFAULTS) -> Scene:
    """The scene with the photos of the first flight that the settings name, if they do."""
    if settings.images is None:
        return scene
    images = load_images(settings.images, frame=scene.frame, box=scene.box)
    note = f"The poses of {len(images)} photos of the first flight are in {images.file}."
    return replace(scene, images=images, notes=(*scene.notes, note))


def _cloud_scene(path: Path, placed: Placed, settings: SceneSettings) -> Scene:
    """Scene of a point cloud."""
    source, notes = placed.source, list(placed.notes)
    cloud = PointCloud(source.xyz, None, source.colours, source.classes)
    check_shape(path, cloud.xyz)
    if source.normals is not None:
        notes.append("The normals in the file are not used: estimated anew.")
    before = len(cloud)
    cloud = _at_most(cloud, settings.max_points)
    if len(cloud) < before:
        notes.append(f"Thinned from {before} to {len(cloud)} points (scene.max_points).")
    stray = stray_points(cloud.xyz, settings.outlier_neighbours, settings.outlier_sigma)
    strays = cloud.xyz[stray]
    if len(strays):
        notes.append(f"Dropped {len(strays)} stray points of {len(cloud)}.")
        cloud = cloud.take(~stray)
    longest = float(np.ptp(cloud.xyz, axis=0).max())
    ground = estimate_ground(
        cloud.xyz, cell=_ground_cell(longest, placed.metric), classes=cloud.classes
    )
    coarse = thin(cloud, 2.0 * _SAMPLE * longest)
    if len(coarse) >= 3:
        coarse = estimate_normals(coarse, settings.normal_neighbours, ground=ground)
    return _scene(
        path, placed, cloud, ground=ground, normals=coarse.normals, notes=notes, strays=strays
    )


def _mesh_scene(path: Path, placed: Placed, triangles: Ints) -> Scene:
    """Scene of a mesh: samples take the place of points."""
    notes = list(placed.notes)
    mesh = _whole_mesh(path, placed.source.xyz, triangles)
    span = np.ptp(mesh.vertices, axis=0)
    check_shape(path, mesh.vertices, least=4)
    spacing = _SAMPLE * float(span.max())
    area = float(triangle_normals(mesh)[1].sum())
    spacing = max(spacing, float(np.sqrt(area / _MOST_SAMPLES)))
    samples = sample_mesh(mesh, spacing, seed=0)
    cell = max(finest_cell(span), 0.5 * spacing)
    cover = cover_mesh(mesh, 0.5 * cell)
    ground = estimate_ground(cover, cell=_ground_cell(float(span.max()), placed.metric), low=0.0)
    cloud = orient_samples(samples, mesh, sky_grid(cover, cell, ground), ground)
    notes.append(f"Sampled the mesh of {len(mesh)} triangles every {spacing:.3g} m.")
    if len(cloud) < len(samples):
        inside = len(samples) - len(cloud)
        notes.append(f"Left out {inside} of {len(samples)} samples inside of solids.")
    return _scene(path, placed, cloud, mesh=mesh, ground=ground, normals=cloud.normals, notes=notes)


def _whole_mesh(path: Path, xyz: Floats, triangles: Ints) -> Mesh:
    """The mesh without triangles that have no area and vertices that no triangle names."""
    triangles = triangles[triangle_normals(Mesh(xyz, triangles))[1] > 0.0]
    if len(triangles) == 0:
        raise refusal(path, "its faces have no area", "export it as a mesh with whole faces")
    used, row = np.unique(triangles, return_inverse=True)
    return Mesh(xyz[used], row.reshape(-1, 3))


def _ground_cell(longest: float, metric: bool) -> float:
    """Width of a terrain cell: half of the default radius R, but no wider than a building."""
    cell = _GROUND_CELL * longest
    return min(cell, max(_HOUSE, 0.25 * cell)) if metric else cell


def _scene(
    path: Path,
    placed: Placed,
    cloud: PointCloud,
    *,
    mesh: Mesh | None = None,
    ground: Ground,
    normals: Floats | None,
    notes: list[str],
    strays: Floats | None = None,
) -> Scene:
    """Put the parts together."""
    with path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    return Scene(
        name=path.name.split(".")[0],
        cloud=cloud,
        mesh=mesh,
        ground=ground,
        box=bounding_box(cloud.xyz, normals),
        frame=placed.frame,
        metric=placed.metric,
        source=str(path),
        sha256=sha256,
        notes=tuple(notes),
        strays=strays,
    )


def _at_most(cloud: PointCloud, limit: int) -> PointCloud:
    """The cloud itself, or thinned to at most ``limit`` points."""
    spacing = 0.0
    while len(cloud) > limit:
        span = np.ptp(cloud.xyz, axis=0)
        spacing = max(
            1.3 * spacing, float(np.sqrt(max(span[0] * span[1], span.max() * 1e-6) / limit))
        )
        cloud = thin(cloud, spacing)
    return cloud
