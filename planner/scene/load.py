"""From a file to a scene: read, place, clean, and find ground and bounding box."""

import hashlib
from pathlib import Path

import numpy as np

from planner.config import SceneSettings
from planner.geometry.arrays import Floats
from planner.scene.box import bounding_box
from planner.scene.cleaning import stray_points, thin
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.degenerate import check_shape
from planner.scene.ground import estimate_ground
from planner.scene.normals import estimate_normals, orient_normals
from planner.scene.placing import Placed, place
from planner.scene.readers.formats import read_source
from planner.scene.readers.source import refusal
from planner.scene.sampling import sample_mesh
from planner.scene.scene import Ground, Scene

_DEFAULTS = SceneSettings()
_SAMPLE = 0.25 * 0.015  # of the longest side: a quarter of the default radius R
_GROUND_CELL = 0.5 * 0.015  # of the longest side
_MOST_SAMPLES = 2_000_000


def load_scene(path: Path | str, settings: SceneSettings = _DEFAULTS) -> Scene:
    """Read a scan or a model and make it ready for planning.

    Parameters
    ----------
    path
        PLY, LAS/LAZ, PCD, XYZ/CSV/TXT, OBJ, STL, OFF, GLB/glTF, CityJSON or CityJSONSeq file.
    settings
        Up axis, unit, CRS and cleaning.

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
        return _cloud_scene(path, placed, settings)
    return _mesh_scene(path, placed)


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
    ground = estimate_ground(cloud.xyz, cell=_GROUND_CELL * longest, classes=cloud.classes)
    coarse = thin(cloud, 2.0 * _SAMPLE * longest)
    if len(coarse) >= 3:
        coarse = estimate_normals(coarse, settings.normal_neighbours, ground=ground)
    return _scene(
        path, placed, cloud, ground=ground, normals=coarse.normals, notes=notes, strays=strays
    )


def _mesh_scene(path: Path, placed: Placed) -> Scene:
    """Scene of a mesh: samples take the place of points."""
    source, notes = placed.source, list(placed.notes)
    assert source.triangles is not None
    mesh = Mesh(source.xyz, source.triangles)
    used = mesh.vertices[np.unique(mesh.triangles)]
    if len(used) == 0:
        raise refusal(path, "the mesh has no faces", "export it with faces, or as a PLY cloud")
    longest = float(np.ptp(used, axis=0).max())
    check_shape(path, used, least=4)
    corners = mesh.vertices[mesh.triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * float(np.linalg.norm(sides, axis=1).sum())
    spacing = max(_SAMPLE * longest, float(np.sqrt(area / _MOST_SAMPLES)))
    cloud = sample_mesh(mesh, spacing, seed=0)
    ground = estimate_ground(cloud.xyz, cell=_GROUND_CELL * longest)
    before = len(cloud)
    cloud = orient_normals(cloud, spacing, ground=ground)
    notes.append(f"Sampled the mesh of {len(mesh)} triangles every {spacing:.3g} m.")
    if len(cloud) < before:
        notes.append(f"Left out {before - len(cloud)} of {before} samples inside of solids.")
    return _scene(path, placed, cloud, mesh=mesh, ground=ground, normals=cloud.normals, notes=notes)


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
