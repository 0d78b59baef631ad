"""PLY: ascii or binary of either byte order, cloud or mesh, any extra properties."""

from pathlib import Path

import numpy as np

from planner.geometry.arrays import Bytes, Floats, Ints
from planner.scene.readers.ply_body import AsciiBody, BinaryBody, PlyElement, PlyProperty
from planner.scene.readers.polygons import triangulate_faces
from planner.scene.readers.source import Source, colour_bytes, refusal, truncated

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER = 1 << 20


def read_ply(path: Path) -> Source:
    """Read a PLY file; without faces it is a point cloud.

    Raises
    ------
    PlannerError
        If the header cannot be understood, has no vertices, or promises more than the file holds.

    """
    data = path.read_bytes()
    order, elements, start = _header(path, data)
    body = memoryview(data)[start:]
    columns: dict[str, np.ndarray] = {}
    faces: list[Ints] = []
    reader = AsciiBody(path, body) if order == "" else BinaryBody(path, body, order)
    for element in elements:
        if element.name == "vertex":
            columns = reader.scalars(element)
        elif element.name == "face":
            faces = reader.polygons(element)
        else:
            reader.skip(element)
    if not {"x", "y", "z"} <= columns.keys():
        raise refusal(path, "its vertices have no x, y, z", "export it with positions")
    xyz = np.column_stack([columns[axis].astype(np.float64) for axis in "xyz"])
    triangles = triangulate_faces(path, xyz, faces) if faces else None
    return Source(xyz, triangles, _normals(columns), _colours(columns))


def _header(path: Path, data: bytes) -> tuple[str, list[PlyElement], int]:
    """Byte order, elements and the offset of the body."""
    end = data.find(b"end_header", 0, _LONGEST_HEADER)
    stop = data.find(b"\n", end)
    if end < 0 or stop < 0:
        raise truncated(path, "no end_header")
    order: str | None = None
    elements: list[PlyElement] = []
    for line in data[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(PlyElement(words[1], int(words[2]), ()))
            elif words[:1] == ["property"]:
                last = elements[-1]
                elements[-1] = PlyElement(
                    last.name, last.count, (*last.properties, _property(words[1:]))
                )
        except (KeyError, IndexError, ValueError) as error:
            wrong = f"its header line {line.strip()!r} cannot be understood"
            raise refusal(path, wrong, "export it as a standard PLY") from error
    if order is None or any(element.count < 0 for element in elements):
        raise refusal(path, "its header names no format or a negative count", "export it again")
    return order, elements, stop + 1


def _property(words: list[str]) -> PlyProperty:
    if words[0] == "list":
        return PlyProperty(words[3], _TYPES[words[2]], _TYPES[words[1]])
    return PlyProperty(words[1], _TYPES[words[0]])


def _normals(columns: dict[str, np.ndarray]) -> Floats | None:
    if not {"nx", "ny", "nz"} <= columns.keys():
        return None
    return np.column_stack([columns[name].astype(np.float64) for name in ("nx", "ny", "nz")])


def _colours(columns: dict[str, np.ndarray]) -> Bytes | None:
    for prefix in ("", "diffuse_"):
        names = [prefix + name for name in ("red", "green", "blue")]
        if set(names) <= columns.keys():
            table = np.column_stack([columns[name].astype(np.float64) for name in names])
            whole = columns[names[0]].dtype == np.uint8
            return table.astype(np.uint8) if whole else colour_bytes(table)
    return None
