"""STL, binary or ascii."""

import re
from pathlib import Path

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.readers.source import Source, refusal, truncated

_HEAD = 84  # 80 free bytes and a count
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])


def read_stl(path: Path) -> Source:
    """Read an STL file; equal corners become one vertex.

    Raises
    ------
    PlannerError
        If the file is neither kind of STL or is cut short.

    """
    data = path.read_bytes()
    declared = int(np.frombuffer(data, "<u4", 1, 80)[0]) if len(data) >= _HEAD else -1
    whole = declared >= 0 and len(data) == _HEAD + declared * _RECORD.itemsize
    if not whole and data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:4096]:
        corners = _ascii(path, data)
    elif declared < 0:
        raise truncated(path, f"{len(data)} bytes")
    else:
        have = (len(data) - _HEAD) // _RECORD.itemsize
        if have < declared:
            raise truncated(path, f"{have} of {declared} triangles")
        corners = np.frombuffer(data, _RECORD, declared, _HEAD)["corners"].astype(np.float64)
    if len(corners) == 0:
        raise refusal(path, "the mesh has no faces", "export it with faces, or as a PLY cloud")
    xyz, row = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return Source(xyz, row.reshape(-1, 3))


def _ascii(path: Path, data: bytes) -> Floats:
    """Corners, shape (T, 3, 3)."""
    if b"endsolid" not in data[-4096:]:
        raise truncated(path, "no endsolid")
    words = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", data)
    if len(words) % 3:
        raise truncated(path, f"{len(words)} corners of triangles")
    try:
        return np.array(words, dtype="S").astype(np.float64).reshape(-1, 3, 3)
    except ValueError as error:
        raise refusal(path, f"it is no valid STL ({error})", "export it again") from error
