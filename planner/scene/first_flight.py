"""Simulate a nadir first flight: the coarse cloud that its photos would give."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.sampling import triangle_normals

_LIFT = 0.004  # metres off the surface at which a ray back to a camera starts
_RAYS = 1_000_000  # rays cast at once


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
    cameras
        Positions of the cameras, shape (C, 3), metres.

    """

    xyz: Floats
    surface: Floats
    sigma: Floats
    triangles: Ints
    cameras: Floats


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
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    flat = mesh.vertices[:, :2] @ turn  # along and across the flight lines
    low, high = flat.min(axis=0), flat.max(axis=0)
    bottom, top = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    depth = top + flight.height - bottom
    reach = depth * np.tan(np.radians(flight.half_angles_deg))
    stations = _stations(low, high, 2.0 * reach * (1.0 - np.array(flight.overlap)))
    cameras = np.column_stack([stations @ turn.T, np.full(len(stations), top + flight.height)])

    normals, _ = triangle_normals(mesh)
    aims, owner = _aims(stations, low, high, reach=reach, spacing=spacing, rng=rng)
    targets = np.column_stack([aims @ turn.T, np.full(len(aims), bottom)])
    hit, distance, triangle = _first_hits(scene, cameras[owner], targets)
    owner = owner[hit]
    ray = targets[hit] - cameras[owner]
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    surface = cameras[owner] + distance[:, None] * ray
    cosine = -(ray * normals[triangle]).sum(axis=1)
    facing = cosine > np.cos(np.radians(flight.max_incidence_deg))
    owner, triangle, distance = owner[facing], triangle[facing], distance[facing]
    ray, surface, cosine = ray[facing], surface[facing], cosine[facing]

    seen = _times_seen(
        scene, surface, normals[triangle], owner=owner, cameras=cameras, turn=turn, flight=flight
    )
    kept = seen >= flight.views
    sigma = flight.noise * (distance[kept] / depth) ** 2 / cosine[kept]
    error = sigma * np.clip(rng.standard_normal(len(sigma)), -3.0, 3.0)
    xyz = surface[kept] + error[:, None] * ray[kept]
    return FlownCloud(xyz, surface[kept], sigma, triangle[kept], cameras)


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


def _stations(low: Floats, high: Floats, pace: Floats) -> Floats:
    """Even grid over a rectangle, no wider than the pace, one pace beyond its rim."""
    axes = []
    for a, b, step in zip(low, high, pace, strict=True):
        count = int(np.ceil((b - a) / step)) + 2
        axes.append(0.5 * (a + b) + step * (np.arange(count) - 0.5 * (count - 1)))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def _aims(
    stations: Floats,
    low: Floats,
    high: Floats,
    *,
    reach: Floats,
    spacing: float,
    rng: np.random.Generator,
) -> tuple[Floats, Ints]:
    """Jittered grid of ground points in each camera's frame, together as dense as wanted."""
    first = np.maximum(stations - reach, low)
    last = np.minimum(stations + reach, high)
    overlap = np.prod(np.maximum(last - first, 0.0), axis=1).sum() / np.prod(high - low)
    cell = spacing * np.sqrt(overlap)
    points, owner = [], []
    for number, (a, b) in enumerate(zip(first, last, strict=True)):
        if (b - a).min() <= 0.0:
            continue
        count = np.maximum(1, np.round((b - a) / cell)).astype(int)
        grid = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 2)
        points.append(a + (grid + rng.random(grid.shape)) / count * (b - a))
        owner.append(np.full(len(grid), number))
    return np.concatenate(points), np.concatenate(owner)


def _first_hits(scene: Any, origins: Floats, targets: Floats) -> tuple[Ints, Floats, Ints]:
    """Rows of the rays that hit something, with distance and triangle of the hit."""
    ray = targets - origins
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    answer = scene.cast_rays(np.column_stack([origins, ray]).astype(np.float32))
    distance = answer["t_hit"].numpy().astype(np.float64)
    hit = np.flatnonzero(np.isfinite(distance))
    return hit, distance[hit], answer["primitive_ids"].numpy()[hit].astype(np.int64)


def _times_seen(
    scene: Any,
    surface: Floats,
    normals: Floats,
    *,
    owner: Ints,
    cameras: Floats,
    turn: Floats,
    flight: NadirFlight,
) -> Ints:
    """Count the cameras that see each point; the one that found it sees it without a test."""
    slant = np.tan(np.radians(flight.half_angles_deg))
    least = np.cos(np.radians(flight.max_incidence_deg))
    start = surface + _LIFT * normals
    seen = np.ones(len(surface), dtype=np.int64)
    for number, camera in enumerate(cameras):
        ray = camera - start
        framed = (np.abs(ray[:, :2] @ turn) <= slant * ray[:, 2:]).all(axis=1)
        facing = (ray * normals).sum(axis=1) > least * np.linalg.norm(ray, axis=1)
        rows = np.flatnonzero(framed & facing & (owner != number))
        for block in np.array_split(rows, 1 + len(rows) // _RAYS):
            rays = np.column_stack([start[block], ray[block]]).astype(np.float32)
            hidden: Bools = scene.test_occlusions(rays, tfar=1.0).numpy()
            seen[block] += ~hidden
    return seen
