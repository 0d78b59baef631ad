"""Faces with any number of corners, with or without holes, as triangles."""

from pathlib import Path

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.readers.ears import clip_ears, join_holes
from planner.scene.readers.source import refusal

_FANS = 8  # corners up to which every corner is tried as the centre of a fan


def triangulate_faces(path: Path, xyz: Floats, faces: list[Ints]) -> Ints:
    """Triangles of faces that are grouped by their number of corners.

    Parameters
    ----------
    path
        For the error message.
    xyz
        Vertices, shape (N, 3).
    faces
        Groups of vertex rows, each of shape (F_k, k); groups with k < 3 are left out.

    Returns
    -------
    triangles
        Shape (T, 3), rows of ``xyz``, wound as their faces.

    Raises
    ------
    PlannerError
        If a face names a vertex that is not there.

    """
    parts: list[Ints] = [np.empty((0, 3), dtype=np.int64)]
    for group in faces:
        if group.ndim != 2 or group.shape[1] < 3:
            continue
        low, high = group.min(initial=0), group.max(initial=0)
        if low < 0 or high >= len(xyz):
            wrong = f"a face names vertex {low if low < 0 else high} of {len(xyz)}"
            raise refusal(path, wrong, "the file is damaged: export it again")
        with np.errstate(over="ignore", invalid="ignore"):  # absurd coordinates are told later
            parts += _fans(xyz, group)
    return np.concatenate(parts)


def triangulate_rings(xyz: Floats, rings: list[Ints]) -> Ints:
    """Triangles of one flat polygon with holes.

    Parameters
    ----------
    xyz
        Vertices, shape (N, 3).
    rings
        Vertex rows of the outer ring and of each hole, without the first repeated at the end.

    Returns
    -------
    triangles
        Shape (T, 3), rows of ``xyz``, wound as the outer ring.

    """
    flat = _flatten(xyz, rings)
    if flat is None:
        return np.empty((0, 3), dtype=np.int64)
    rows = np.concatenate(rings)
    places = np.split(np.arange(len(rows)), np.cumsum([len(ring) for ring in rings])[:-1])
    loops: list[list[int]] = [place.tolist() for place in places]
    found = clip_ears(flat, join_holes(flat, loops))
    return rows[np.array(found, dtype=np.int64).reshape(-1, 3)]


def _fans(xyz: Floats, group: Ints) -> list[Ints]:
    """Triangles of equally long faces: fans where one corner sees all others, else ears."""
    corners = group.shape[1]
    if corners == 3:
        return [group]
    parts = []
    left = group
    for turn in range(corners if corners <= _FANS else 1):
        rolled = np.roll(left, -turn, axis=1)
        good = _sees_all(xyz[rolled])
        parts += [rolled[good][:, [0, i, i + 1]] for i in range(1, corners - 1)]
        left = left[~good]
    parts += [triangulate_rings(xyz, [face]) for face in left]
    return parts


def _sees_all(corners: Floats) -> Bools:
    """Whether the fan about the first corner folds nowhere, for faces of shape (F, k, 3)."""
    spokes = corners[:, 1:] - corners[:, :1]
    cross = np.cross(spokes[:, :-1], spokes[:, 1:])  # (F, k - 2, 3), twice the fan's areas
    total = cross.sum(axis=1, keepdims=True)  # Newell's normal
    along = (cross * total).sum(axis=2)
    return np.asarray((along >= -1e-9 * (total * total).sum(axis=2)).all(axis=1))


def _flatten(xyz: Floats, rings: list[Ints]) -> Floats | None:
    """All rings, one after the other, on the plane that the outer one turns left in."""
    outer = xyz[rings[0]]
    spokes = outer[1:] - outer[0]
    normal = np.cross(spokes[:-1], spokes[1:]).sum(axis=0)
    length = np.linalg.norm(normal)
    if not length > 0.0:
        return None
    normal /= length
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    plane = np.stack([first, np.cross(normal, first)])
    return np.asarray((xyz[np.concatenate(rings)] - outer[0]) @ plane.T)
