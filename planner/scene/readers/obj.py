"""Wavefront OBJ: vertices and polygon faces; materials, textures and lines are passed over."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from planner.geometry.arrays import Ints
from planner.scene.readers.polygons import triangulate_faces
from planner.scene.readers.source import Source, refusal


def read_obj(path: Path) -> Source:
    """Read an OBJ file in double precision.

    Raises
    ------
    PlannerError
        If a line cannot be understood, or a face names a vertex that is not there.

    """
    vertices: list[list[str]] = []
    faces: dict[int, list[list[int]]] = {}
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            for line in _whole_lines(file):
                words = line.split()
                if not words:
                    continue
                if words[0] == "v":
                    vertices.append(words[1:4])
                elif words[0] == "f":
                    rows = [_row(word, len(vertices)) for word in words[1:]]
                    faces.setdefault(len(rows), []).append(rows)
        xyz = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    except (ValueError, OverflowError) as error:
        raise refusal(path, f"it is no valid OBJ ({error})", "export it again") from error
    groups: list[Ints] = [np.array(rows, dtype=np.int64) for _, rows in sorted(faces.items())]
    return Source(xyz, triangulate_faces(path, xyz, groups))


def _row(word: str, count: int) -> int:
    """Vertex row of a face's corner such as ``7/1/3`` or ``-1`` (counted back from here)."""
    index = int(word.split("/", 1)[0])
    if index == 0:
        raise ValueError("a face names vertex 0; the first is 1")
    return index - 1 if index > 0 else count + index


def _whole_lines(lines: Iterable[str]) -> Iterator[str]:
    """Join lines that end in a backslash."""
    held = ""
    for line in lines:
        if line.rstrip().endswith("\\"):
            held += line.rstrip()[:-1] + " "
            continue
        yield held + line
        held = ""
    if held:
        yield held
