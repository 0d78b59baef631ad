"""Simulate a nadir first flight: the coarse cloud that its photos would give."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.images import Images
from planner.scene.sampling import triangle_normals

_LIFT = 0.004  # metres off the surface at which a ray back to a camera starts
_RAYS = 1_000_000  # rays cast at once
MOST_SIGMAS = 3.0  # at which the noise is cut
BEYOND = 0.75  # how far the lines go on past the rim, as a share of half a footprint


@dataclass(frozen=True, slots=True)
class NadirFlight:
    """A grid of cameras that look straight down.

    Parameters
    ----------
    height
        Flying height above the highest point, metres.
    half_angles_deg
        Half the field of view along and across the flight lines, degrees.
    overlap
        Share of the footprint at the ground that neighbouring photos share, along and across.
    views
        Cameras that must see a point before it is triangulated.
    max_incidence_deg
        Largest angle between a ray and the surface normal at which an image still matches.
    noise
        Standard deviation of the depth straight below, at ground level, metres; it grows with
        the square of the distance and with 1 / cos(incidence), and is cut at three deviations.

    """

    height: float = 60.0
    half_angles_deg: tuple[float, float] = (27.0, 37.0)
    overlap: tuple[float, float] = (0.8, 0.6)
    views: int = 3
    max_incidence_deg: float = 75.0
    noise: float = 0.04


@dataclass(frozen=True, slots=True, eq=False)
class FlownCloud:
    """What the flight recovered.

    Parameters
    ----------
    xyz
        Points with noise, shape (N, 3), metres.
    surface
        The same points without noise, on the mesh, shape (N, 3), metres.
    sigma
        Standard deviation of the noise of each, shape (N,), metres.
    triangles
        Triangle that each lies on, shape (N,).
    camera
        Camera that measured each, shape (N,).
    cameras
        Positions of the cameras, shape (C, 3), metres.

    """

    xyz: Floats
    surface: Floats
    sigma: Floats
    triangles: Ints
    camera: Ints
    cameras: Floats

    @classmethod
    def empty(cls) -> "FlownCloud":
        """What no flight recovers."""
        none, no_rows = np.zeros((0, 3)), np.zeros(0, dtype=np.int64)
        return cls(none, none, np.zeros(0), no_rows, no_rows, none)


def fly_first(
    mesh: Mesh, flight: NadirFlight, *, spacing: float, heading: float, seed: int
) -> FlownCloud:
    """Fly over a mesh and reconstruct what enough cameras see.

    Each camera casts an even grid of rays, as its pixels would, so that surface seen at a slant
    or by few cameras gets few points. A hit counts if enough cameras, the casting one included,
    see it unoccluded and not too slanted; its depth then gets noise along the casting ray.

    Parameters
    ----------
    mesh
        The place, triangles with outward normals, local frame of at most a few kilometres.
    flight
        Height, overlaps and what it takes to match.
    spacing
        Distance between points on open ground, metres.
    heading
        Direction of the flight lines from +x, counter-clockwise, radians.
    seed
        Seed of the noise and of the jitter of the rays.

    Returns
    -------
    cloud
        Points ordered by camera.

    """
    scene = ray_scene(mesh)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1,)))
    lines = _lay_lines(mesh, flight, heading)
    cameras = lines.cameras
    normals, _ = triangle_normals(mesh)

    targets, owner = _targets(lines, spacing, rng)
    ray = targets - cameras[owner]
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    hit, triangle = _first_hits(scene, cameras[owner], ray)
    cosine = -(ray * normals[triangle]).sum(axis=1)
    good = hit & (cosine > np.cos(np.radians(flight.max_incidence_deg)))
    ray, triangle, cosine, owner = (values[good] for values in (ray, triangle, cosine, owner))
    corner = mesh.vertices[mesh.triangles[triangle, 0]]  # float32 hits are off by millimetres
    distance = ((cameras[owner] - corner) * normals[triangle]).sum(axis=1) / cosine
    surface = cameras[owner] + distance[:, None] * ray
    kept = _seen_enough(scene, surface, normals[triangle], owner, lines=lines, flight=flight)

    sigma = flight.noise * (distance[kept] / lines.depth) ** 2 / cosine[kept]
    error = sigma * np.clip(rng.standard_normal(len(sigma)), -MOST_SIGMAS, MOST_SIGMAS)
    xyz = surface[kept] + error[:, None] * ray[kept]
    return FlownCloud(xyz, surface[kept], sigma, triangle[kept], owner[kept], cameras)


def flown_images(cameras: Floats, flight: NadirFlight, *, heading: float) -> Images:
    """Photos of a flight: poses and optics of cameras whose pictures' tops point along the lines.

    Parameters
    ----------
    cameras
        Positions, shape (C, 3), metres.
    flight
        Gives the field of view.
    heading
        Direction of the flight lines from +x, counter-clockwise, radians.

    """
    along, across = np.tan(np.radians(flight.half_angles_deg))
    width = 5472.0
    height, focal = round(width * along / across), 0.5 * width / across
    count = len(cameras)
    yaw = (90.0 - np.degrees(heading) + 180.0) % 360.0 - 180.0
    return Images(
        positions=cameras,
        yaw_deg=np.full(count, yaw),
        pitch_deg=np.full(count, -90.0),
        names=tuple(f"first-{number}" for number in range(count)),
        optics=np.tile([width, height, focal], (count, 1)),
    )


def ray_scene(mesh: Mesh) -> Any:
    """Open3D scene that casts float32 rays at a mesh; its methods take and give NumPy views."""
    import open3d as o3d

    tensor: Any = o3d.core.Tensor
    scene: Any = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        tensor(np.ascontiguousarray(mesh.vertices, dtype=np.float32)),
        tensor(np.ascontiguousarray(mesh.triangles, dtype=np.uint32)),
    )
    return scene


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Flight lines: ``turn`` maps (along, across) to (x, y); the rest in along and across."""

    turn: Floats  # (2, 2)
    low: Floats  # (2,) rim of the mesh
    high: Floats  # (2,)
    bottom: float  # lowest point of the mesh
    depth: float  # of that point below the cameras
    reach: Floats  # (2,) half the footprint there
    cameras: Floats  # (C, 3) in x, y, z

    @property
    def stations(self) -> Floats:
        """Cameras along and across the lines, shape (C, 2)."""
        return np.asarray(self.cameras[:, :2] @ self.turn)


def _lay_lines(mesh: Mesh, flight: NadirFlight, heading: float) -> _Lines:
    """Even grid of cameras over the mesh and past its rim, no wider than the overlaps allow."""
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, -s], [s, c]])
    flat = mesh.vertices[:, :2] @ turn
    low, high = flat.min(axis=0), flat.max(axis=0)
    bottom, top = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    depth = top + flight.height - bottom
    reach = depth * np.tan(np.radians(flight.half_angles_deg))
    pace = 2.0 * reach * (1.0 - np.array(flight.overlap))
    axes = [
        np.linspace(a, b, int(np.ceil((b - a) / step)) + 1)
        for a, b, step in zip(low - BEYOND * reach, high + BEYOND * reach, pace, strict=True)
    ]
    stations = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    cameras = np.column_stack([stations @ turn.T, np.full(len(stations), top + flight.height)])
    return _Lines(turn, low, high, bottom, depth, reach, cameras)


def _targets(lines: _Lines, spacing: float, rng: np.random.Generator) -> tuple[Floats, Ints]:
    """Jittered grid in each camera's frame, together as dense as wanted on open ground.

    Returns
    -------
    targets, owner
        Points on the plane of the lowest ground, shape (M, 3), and the camera of each.

    """
    first = np.maximum(lines.stations - lines.reach, lines.low)
    last = np.minimum(lines.stations + lines.reach, lines.high)
    span = np.maximum(last - first, 0.0)
    overlap = span.prod(axis=1).sum() / np.prod(lines.high - lines.low)
    count = np.maximum(1, np.round(span / (spacing * np.sqrt(overlap)))).astype(int)
    points, owner = [], []
    for number in np.flatnonzero(span.min(axis=1) > 0.0):
        axes = (np.arange(n) for n in count[number])
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        share = (grid + rng.random(grid.shape)) / count[number]
        points.append(first[number] + share * span[number])
        owner.append(np.full(len(grid), number))
    flat = np.concatenate(points) @ lines.turn.T
    return np.column_stack([flat, np.full(len(flat), lines.bottom)]), np.concatenate(owner)


def _first_hits(scene: Any, origins: Floats, rays: Floats) -> tuple[Bools, Ints]:
    """Tell which rays hit something, and the triangle of each one's first hit, 0 without one."""
    answer = scene.cast_rays(np.column_stack([origins, rays]).astype(np.float32))
    hit: Bools = np.isfinite(answer["t_hit"].numpy())
    triangle = answer["primitive_ids"].numpy().astype(np.int64)
    return hit, np.where(hit, triangle, 0)


def _seen_enough(
    scene: Any,
    surface: Floats,
    normals: Floats,
    owner: Ints,
    *,
    lines: _Lines,
    flight: NadirFlight,
) -> Bools:
    """Tell which points enough cameras see; the one that found it sees it without a test."""
    slant = np.tan(np.radians(flight.half_angles_deg))
    least = np.cos(np.radians(flight.max_incidence_deg))
    start = surface + _LIFT * normals
    (along, across), height = (start[:, :2] @ lines.turn).T.copy(), start[:, 2].copy()
    seen = np.ones(len(surface), dtype=np.int64)
    for number, (camera, place) in enumerate(zip(lines.cameras, lines.stations, strict=True)):
        below = camera[2] - height
        framed = np.abs(along - place[0]) <= slant[0] * below
        framed &= np.abs(across - place[1]) <= slant[1] * below
        rows = np.flatnonzero(framed & (seen < flight.views) & (owner != number))
        ray = camera - start[rows]
        facing = (ray * normals[rows]).sum(axis=1) > least * np.linalg.norm(ray, axis=1)
        rows, ray = rows[facing], ray[facing]
        for block in np.array_split(np.arange(len(rows)), 1 + len(rows) // _RAYS):
            rays = np.column_stack([start[rows[block]], ray[block]]).astype(np.float32)
            hidden: Bools = scene.test_occlusions(rays, tfar=1.0).numpy()
            seen[rows[block]] += ~hidden
    return seen >= flight.views
