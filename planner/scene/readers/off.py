"""OFF, the Object File Format, as text."""

from pathlib import Path

import numpy as np

from planner.scene.readers.polygons import triangulate_faces
from planner.scene.readers.source import Source, refusal, truncated

_KINDS = ("OFF", "COFF", "NOFF", "CNOFF", "STOFF")


def read_off(path: Path) -> Source:
    """Read an OFF file; colours and normals are passed over.

    Raises
    ------
    PlannerError
        If it is a binary OFF, cannot be understood, or is cut short.

    """
    with path.open(encoding="utf-8", errors="replace") as file:
        bare = (line.split("#", 1)[0].strip() for line in file)
        lines = [line for line in bare if line]
    first = lines[0].split() if lines else []
    if not first or first[0].upper() not in _KINDS or first[1:2] == ["BINARY"]:
        raise refusal(path, "it does not begin as a text OFF", "export it as ascii OFF or PLY")
    try:
        counts, body = (first[1:], lines[1:]) if len(first) > 1 else (lines[1].split(), lines[2:])
        vertices, faces = int(counts[0]), int(counts[1])
        if len(body) < vertices + faces or vertices < 0 or faces < 0:
            raise truncated(path, f"{len(body)} of {vertices + faces} lines")
        words = [line.split()[:3] for line in body[:vertices]]
        xyz = np.array(words, dtype=np.float64).reshape(-1, 3)
        found: dict[int, list[list[int]]] = {}
        for line in body[vertices : vertices + faces]:
            parts = line.split()
            corners = int(parts[0])
            rows = [int(part) for part in parts[1 : corners + 1]]
            found.setdefault(len(rows), []).append(rows)
            if len(rows) != corners:
                raise ValueError(f"face line {line[:40]!r}")
    except (ValueError, IndexError, OverflowError) as error:
        raise refusal(path, f"it is no valid OFF ({error})", "export it again") from error
    groups = [np.array(rows, dtype=np.int64) for _, rows in sorted(found.items())]
    return Source(xyz, triangulate_faces(path, xyz, groups))
