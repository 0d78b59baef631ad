"""Faces with any number of corners, with or without holes, as triangles."""

from pathlib import Path

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.scene.readers.source import refusal


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
        Shape (T, 3), rows of ``xyz``.

    Raises
    ------
    PlannerError
        If a face names a vertex that is not there.

    """
    parts: list[Ints] = []
    for group in faces:
        if len(group) and not 0 <= group.min(initial=0) <= group.max(initial=0) < len(xyz):
            wrong = f"a face names vertex {group.max(initial=0)} of {len(xyz)}"
            raise refusal(path, wrong, "the file is damaged: export it again")
        corners = group.shape[1] if group.ndim == 2 else 0
        parts += [
            np.column_stack([group[:, 0], group[:, i], group[:, i + 1]])
            for i in range(1, corners - 1)
        ]
    return np.concatenate(parts) if parts else np.empty((0, 3), dtype=np.int64)
