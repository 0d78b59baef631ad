"""PLY: ascii or binary of either byte order, cloud or mesh, any extra properties."""

from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from planner.geometry.arrays import Bytes, Floats, Ints
from planner.scene.readers.polygons import triangulate_faces
from planner.scene.readers.source import Source, refusal, truncated

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER = 1 << 20


@dataclass(frozen=True, slots=True)
class _Property:
    name: str
    dtype: str
    count_dtype: str | None = None  # set for a list


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


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
    reader = _Ascii(path, body) if order == "" else _Binary(path, body, order)
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


def _header(path: Path, data: bytes) -> tuple[str, list[_Element], int]:
    """Byte order, elements and the offset of the body."""
    end = data.find(b"end_header", 0, _LONGEST_HEADER)
    stop = data.find(b"\n", end)
    if end < 0 or stop < 0:
        raise truncated(path, "no end_header")
    order: str | None = None
    elements: list[_Element] = []
    for line in data[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2]), ()))
            elif words[:1] == ["property"]:
                last = elements[-1]
                elements[-1] = _Element(
                    last.name, last.count, (*last.properties, _property(words[1:]))
                )
        except (KeyError, IndexError, ValueError) as error:
            wrong = f"its header line {line.strip()!r} cannot be understood"
            raise refusal(path, wrong, "export it as a standard PLY") from error
    if order is None or any(element.count < 0 for element in elements):
        raise refusal(path, "its header names no format or a negative count", "export it again")
    return order, elements, stop + 1


def _property(words: list[str]) -> _Property:
    if words[0] == "list":
        return _Property(words[3], _TYPES[words[2]], _TYPES[words[1]])
    return _Property(words[1], _TYPES[words[0]])


class _Binary:
    """Walks a binary body element by element."""

    def __init__(self, path: Path, body: memoryview, order: str) -> None:
        self._path, self._body, self._order, self._at = path, body, order, 0

    def scalars(self, element: _Element) -> dict[str, np.ndarray]:
        """Columns of an element without lists."""
        if any(p.count_dtype for p in element.properties):
            raise refusal(self._path, "its vertices carry lists", "export it as a standard PLY")
        fields = [(p.name, self._order + p.dtype) for p in element.properties]
        try:
            dtype = np.dtype(fields)
        except ValueError as error:
            raise refusal(self._path, f"bad vertex properties ({error})", "export it") from error
        table = self._table(dtype, element.count)
        return {p.name: table[p.name] for p in element.properties}

    def polygons(self, element: _Element) -> list[Ints]:
        """Vertex rows of each face, in groups of equal length, shape (F_k, k)."""
        if element.count == 0:
            return []
        equal = self._equal_lists(element)
        return equal if equal is not None else self._walk(element)

    def skip(self, element: _Element) -> None:
        """Pass over an element that is of no use here."""
        if any(p.count_dtype for p in element.properties):
            self._walk(element)
        else:
            self.scalars(element)

    def _table(self, dtype: np.dtype[np.void], count: int) -> np.ndarray:
        need = dtype.itemsize * count
        if need > len(self._body) - self._at:
            have = (len(self._body) - self._at) // max(1, dtype.itemsize)
            raise truncated(self._path, f"{have} of {count} records")
        table = np.frombuffer(self._body, dtype, count, self._at)
        self._at += need
        return table

    def _equal_lists(self, element: _Element) -> list[Ints] | None:
        """All faces at once where every list has the length of the first; else ``None``."""
        at = self._at
        fields: list[tuple[str, str, tuple[int, ...]]] = []
        for i, p in enumerate(element.properties):
            if p.count_dtype is None:
                fields.append((f"p{i}", self._order + p.dtype, ()))
                at += np.dtype(p.dtype).itemsize
                continue
            width = np.dtype(p.count_dtype).itemsize
            if at + width > len(self._body):
                return None
            length = int(np.frombuffer(self._body, self._order + p.count_dtype, 1, at)[0])
            if not 0 <= length <= 64:
                return None
            fields.append((f"n{i}", self._order + p.count_dtype, ()))
            fields.append((f"p{i}", self._order + p.dtype, (length,)))
            at += width + length * np.dtype(p.dtype).itemsize
        dtype = np.dtype(fields)
        if dtype.itemsize * element.count > len(self._body) - self._at:
            return None
        table = np.frombuffer(self._body, dtype, element.count, self._at)
        for name in table.dtype.names or ():
            if name.startswith("n") and (table[name] != table[name][0]).any():
                return None
        self._at += dtype.itemsize * element.count
        at_list = _face_list(self._path, element)
        return [table[f"p{at_list}"].astype(np.int64)]

    def _walk(self, element: _Element) -> list[Ints]:
        """Face by face, for lists of mixed length."""
        kinds = [
            (
                np.dtype(self._order + p.dtype),
                None if p.count_dtype is None else np.dtype(self._order + p.count_dtype),
            )
            for p in element.properties
        ]
        wanted = _face_list(self._path, element) if element.name == "face" else -1
        found: dict[int, list[np.ndarray]] = {}
        for _ in range(element.count):
            for i, (dtype, count_dtype) in enumerate(kinds):
                length = 1 if count_dtype is None else int(self._table(count_dtype, 1)[0])
                values = self._table(dtype, max(0, length))
                if i == wanted:
                    found.setdefault(len(values), []).append(values)
        return [np.array(rows, dtype=np.int64) for _, rows in sorted(found.items())]


class _Ascii:
    """Walks an ascii body element by element."""

    def __init__(self, path: Path, body: memoryview) -> None:
        self._path, self._at = path, 0
        self._lines = bytes(body).decode("ascii", "replace").splitlines()

    def scalars(self, element: _Element) -> dict[str, np.ndarray]:
        """Columns of an element without lists."""
        names = [p.name for p in element.properties]
        words = " ".join(self._take(element.count)).split()
        if len(words) != element.count * len(names):
            self._damaged(f"{len(words)} numbers in {element.count} lines of {element.name}")
        table = self._numbers(words).reshape(element.count, len(names))
        return {name: table[:, i] for i, name in enumerate(names)}

    def polygons(self, element: _Element) -> list[Ints]:
        """Vertex rows of each face, in groups of equal length, shape (F_k, k)."""
        wanted = _face_list(self._path, element) if element.count else -1
        found: dict[int, list[list[int]]] = {}
        for line in self._take(element.count):
            words, at = line.split(), 0
            try:
                for i, p in enumerate(element.properties):
                    length = 1 if p.count_dtype is None else int(words[at])
                    at += 0 if p.count_dtype is None else 1
                    if i == wanted:
                        rows = [int(word) for word in words[at : at + length]]
                        if len(rows) != length:
                            self._damaged(f"face line {line[:40]!r}")
                        found.setdefault(length, []).append(rows)
                    at += length
            except (ValueError, IndexError):
                self._damaged(f"face line {line[:40]!r}")
        return [np.array(rows, dtype=np.int64) for _, rows in sorted(found.items())]

    def skip(self, element: _Element) -> None:
        """Pass over an element that is of no use here."""
        self._take(element.count)

    def _take(self, count: int) -> list[str]:
        lines = self._lines[self._at : self._at + count]
        if len(lines) < count:
            self._damaged(f"{len(lines)} of {count} lines")
        self._at += count
        return lines

    def _numbers(self, words: list[str]) -> Floats:
        try:
            return np.array(words, dtype=np.float64)
        except ValueError as error:
            self._damaged(str(error))

    def _damaged(self, what: str) -> NoReturn:
        raise truncated(self._path, what)


def _face_list(path: Path, element: _Element) -> int:
    """Which property of a face lists its vertices."""
    for i, p in enumerate(element.properties):
        if p.count_dtype is not None and p.name in {"vertex_indices", "vertex_index"}:
            return i
    raise refusal(path, "its faces name no vertex_indices", "export it as a standard PLY")


def _normals(columns: dict[str, np.ndarray]) -> Floats | None:
    if not {"nx", "ny", "nz"} <= columns.keys():
        return None
    return np.column_stack([columns[name].astype(np.float64) for name in ("nx", "ny", "nz")])


def _colours(columns: dict[str, np.ndarray]) -> Bytes | None:
    for names in (
        ("red", "green", "blue"),
        ("r", "g", "b"),
        ("diffuse_red", "diffuse_green", "diffuse_blue"),
    ):
        if set(names) <= columns.keys():
            table = np.column_stack([columns[name].astype(np.float64) for name in names])
            table = np.nan_to_num(table)
            top = table.max(initial=0.0)
            scale = 255.0 if 0.0 < top <= 1.0 else 255.0 / 65535.0 if top > 255.0 else 1.0
            return (table * scale).clip(0, 255).astype(np.uint8)
    return None
