"""Small scenes made of boxes, and distances by brute force."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner.geometry.frames import Frame
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.scene import Box, Ground, Scene

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2]),  # x low
        *([4, 6, 7], [4, 7, 5]),  # x high
        *([0, 4, 5], [0, 5, 1]),  # y low
        *([2, 3, 7], [2, 7, 6]),  # y high
        *([0, 2, 6], [0, 6, 4]),  # z low
        *([1, 5, 7], [1, 7, 3]),  # z high
    ]
)


def join(*meshes):
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([np.zeros((0, 3)), *(mesh.vertices for mesh in meshes)]),
        np.concatenate(
            [
                np.zeros((0, 3), int),
                *(m.triangles + at for m, at in zip(meshes, first, strict=False)),
            ]
        ),
    )


def boxes_mesh(boxes):
    """Closed boxes with outward faces."""
    boxes = np.array(boxes, dtype=float).reshape(-1, 2, 3)
    return join(*(Mesh(low + CORNERS * (high - low), FACES) for low, high in boxes))


def sheet(low, high, z, *, up=True):
    """One level rectangle."""
    (x, y), (u, v) = low, high
    corners = np.array([[x, y, z], [u, y, z], [u, v, z], [x, v, z]], dtype=float)
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])[:, :: 1 if up else -1])


def scene_of(points=(), *, heights=None, half=20.0, top=20.0, cell=2.0, turn=0.0):
    """A place of 2 * half metres around the origin on level ground, with these raw points."""
    points = np.array(points, dtype=float).reshape(-1, 3)
    count = int(2 * half / cell)
    heights = np.zeros((count, count)) if heights is None else np.asarray(heights, dtype=float)
    axes = np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1.0]]
    )
    return Scene(
        name="boxes",
        cloud=PointCloud(points),
        mesh=None,
        ground=Ground(heights, np.full(2, -half), cell),
        box=Box(np.array([0, 0, 0.5 * top]), axes, np.array([2 * half, 2 * half, top])),
        frame=Frame(np.zeros(3)),
    )


def to_edges(p, a, b):
    """Distance from points (N, 1, 3) to segments (T, 3)."""
    d = b - a
    t = (((p - a) * d).sum(-1) / np.maximum((d * d).sum(-1), 1e-300)).clip(0, 1)
    return np.linalg.norm(p - a - t[..., None] * d, axis=-1)


def to_triangles(points, corners):
    """Distance from each point to the nearest triangle, all pairs."""
    p = np.asarray(points, dtype=float)[:, None]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    near = np.minimum(np.minimum(to_edges(p, a, b), to_edges(p, b, c)), to_edges(p, c, a))
    n = np.cross(b - a, c - a)
    size = np.linalg.norm(n, axis=1)
    inside = size > 1e-8 * (np.linalg.norm(b - a, axis=1) + np.linalg.norm(c - a, axis=1)) ** 2
    for u, v in ((a, b), (b, c), (c, a)):
        inside = inside & ((np.cross(v - u, p - u) * n).sum(-1) >= 0)
    height = np.abs(((p - a) * n).sum(-1)) / np.where(size > 0, size, 1)
    return np.where(inside, np.minimum(height, near), near).min(axis=1)


def between_segments(a, b, c, d):
    """Distance between segment ab and each segment cd (T, 3): ends, and the inner optimum."""
    near = np.minimum(
        np.minimum(to_edges(a, c, d), to_edges(b, c, d)),
        np.minimum(to_edges(c, a, b), to_edges(d, a, b)),
    )
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = u @ u, v @ u, (v * v).sum(-1)
    uw, vw = w @ u, (v * w).sum(-1)
    det = uu * vv - uv * uv
    safe = np.where(det > 1e-12 * uu * vv, det, np.inf)
    s, t = ((uv * vw - vv * uw) / safe).clip(0, 1), ((uu * vw - uv * uw) / safe).clip(0, 1)
    gap = np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=-1)
    return np.minimum(near, gap)


def segment_to_triangles(a, b, corners):
    """Distance from the segment ab to the nearest triangle; 0 if it pierces one."""
    p, q, r = corners[:, 0], corners[:, 1], corners[:, 2]
    near = to_triangles(np.stack([a, b]), corners).min()
    for c, d in ((p, q), (q, r), (r, p)):
        near = min(near, between_segments(a, b, c, d).min())
    n = np.cross(q - p, r - p)
    from_a, from_b = ((a - p) * n).sum(-1), ((b - p) * n).sum(-1)
    crosses = (from_a * from_b <= 0) & (from_a != from_b)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = a + (from_a / (from_a - from_b))[:, None] * (b - a)
    for u, v in ((p, q), (q, r), (r, p)):
        crosses = crosses & ((np.cross(v - u, x - u) * n).sum(-1) >= 0)
    return 0.0 if crosses.any() else float(near)


def soup_of(seed, count=60, *, size=2.0, spread=15.0):
    """Random triangles above ground, some of them needles or points."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-spread, spread, (count, 1, 3)) + rng.normal(0, size, (count, 3, 3))
    corners[..., 2] = np.abs(corners[..., 2]) + 1.0
    corners[: count // 6, 2] = corners[: count // 6, 1] + 1e-9
    corners[count // 6 : count // 4, 1:] = corners[count // 6 : count // 4, :1]
    return Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


@pytest.fixture(scope="session")
def make():
    """Makers of scenes and meshes by name."""
    return SimpleNamespace(join=join, boxes=boxes_mesh, sheet=sheet, scene=scene_of, soup=soup_of)


@pytest.fixture(scope="session")
def brute():
    """Distances over all pairs, by no code of the planner."""
    return SimpleNamespace(points=to_triangles, segment=segment_to_triangles)
