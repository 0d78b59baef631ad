"""PCD of the Point Cloud Library: ascii, binary and binary_compressed."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.geometry.arrays import Bytes
from planner.scene.readers.source import Source, refusal, truncated

_LONGEST_HEADER = 1 << 16
_BEST_RATIO = 300  # LZF cannot pack better
_KEYS = ("FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "POINTS", "DATA")


@dataclass(frozen=True, slots=True)
class _Header:
    fields: tuple[str, ...]
    dtypes: tuple[np.dtype[np.generic], ...]
    counts: tuple[int, ...]
    points: int
    organised: bool
    data: str
    start: int

    @property
    def record(self) -> int:
        """Bytes of one point."""
        return sum(d.itemsize * c for d, c in zip(self.dtypes, self.counts, strict=True))


def read_pcd(path: Path) -> Source:
    """Read a PCD file; points without a position in an organised cloud are left out.

    Raises
    ------
    PlannerError
        If the header cannot be understood or promises more than the file holds.

    """
    data = path.read_bytes()
    header = _header(path, data)
    body = data[header.start :]
    readers = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}
    columns = readers[header.data](path, body, header)
    if not {"x", "y", "z"} <= columns.keys():
        raise refusal(path, "its points have no x, y, z", "export it with positions")
    xyz = np.column_stack([columns[axis].astype(np.float64) for axis in "xyz"])
    normals = None
    names = ("normal_x", "normal_y", "normal_z")
    if set(names) <= columns.keys():
        normals = np.column_stack([columns[name].astype(np.float64) for name in names])
    colours = _colours(columns)
    if header.organised:
        seen = np.isfinite(xyz).all(axis=1)
        xyz = xyz[seen]
        normals = None if normals is None else normals[seen]
        colours = None if colours is None else colours[seen]
    return Source(xyz, normals=normals, colours=colours)


def _header(path: Path, data: bytes) -> _Header:
    """Parse the lines up to and with DATA."""
    found: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in found:
        end = data.find(b"\n", start, _LONGEST_HEADER)
        if end < 0:
            raise truncated(path, "no DATA line")
        words = data[start:end].decode("ascii", "replace").split()
        start = end + 1
        if words and words[0] in _KEYS:
            found[words[0]] = words[1:]
    try:
        fields = tuple(found["FIELDS"])
        kinds = zip(found["TYPE"], found["SIZE"], strict=True)
        dtypes = tuple(np.dtype("<" + kind.lower() + str(int(size))) for kind, size in kinds)
        counts = tuple(int(c) for c in found.get("COUNT", ["1"] * len(fields)))
        width, height = int(found["WIDTH"][0]), int(found.get("HEIGHT", ["1"])[0])
        points = int(found["POINTS"][0]) if "POINTS" in found else width * height
        if not len(fields) == len(dtypes) == len(counts) or points < 0 or min(counts) < 1:
            raise ValueError("its lines do not agree")
        if found["DATA"][0] not in {"ascii", "binary", "binary_compressed"}:
            raise ValueError(f"DATA {found['DATA'][0]}")
        return _Header(fields, dtypes, counts, points, height > 1, found["DATA"][0], start)
    except (KeyError, IndexError, ValueError, TypeError) as error:
        wrong = f"its PCD header cannot be understood ({error})"
        raise refusal(path, wrong, "export it again with the Point Cloud Library") from error


def _ascii(path: Path, body: bytes, header: _Header) -> dict[str, np.ndarray]:
    words = body.split()
    width = sum(header.counts)
    if len(words) < header.points * width:
        raise truncated(path, f"{len(words) // width} of {header.points} points")
    try:
        table = np.array(words[: header.points * width], dtype="S").astype(np.float64)
    except ValueError as error:
        raise truncated(path, str(error)) from error
    table = table.reshape(header.points, width)
    at = np.cumsum((0, *header.counts))
    columns = {}
    for name, dtype, count, first in zip(
        header.fields, header.dtypes, header.counts, at, strict=False
    ):
        if count == 1:
            # a packed colour is written as its float or its integer value
            columns[name] = (
                table[:, first].astype(dtype) if name in {"rgb", "rgba"} else table[:, first]
            )
    return columns


def _binary(path: Path, body: bytes, header: _Header) -> dict[str, np.ndarray]:
    have = len(body) // header.record
    if have < header.points:
        raise truncated(path, f"{have} of {header.points} points")
    spec = [
        (f"f{i}", dtype, (count,))
        for i, (dtype, count) in enumerate(zip(header.dtypes, header.counts, strict=True))
    ]
    table = np.frombuffer(body, np.dtype(spec), header.points)
    return {
        name: table[f"f{i}"][:, 0] for i, name in enumerate(header.fields) if header.counts[i] == 1
    }


def _compressed(path: Path, body: bytes, header: _Header) -> dict[str, np.ndarray]:
    """Two 32-bit sizes, then one LZF block that holds the fields one after the other."""
    from planner.scene.readers.lzf import unpack

    if len(body) < 8:
        raise truncated(path, "no sizes of the compressed block")
    packed, size = np.frombuffer(body, "<u4", 2).tolist()
    if size != header.record * header.points or size > _BEST_RATIO * max(packed, 1):
        raise truncated(path, f"{size} bytes unpacked for {header.points} points")
    if packed > len(body) - 8:
        raise truncated(path, f"{len(body) - 8} of {packed} packed bytes")
    block, length = unpack(np.frombuffer(body, np.uint8, packed, 8), size)
    if length != size:
        raise truncated(path, "the compressed block")
    columns, at = {}, 0
    for name, dtype, count in zip(header.fields, header.dtypes, header.counts, strict=True):
        if count == 1:
            columns[name] = np.frombuffer(block, dtype, header.points, at)
        at += dtype.itemsize * count * header.points
    return columns


def _colours(columns: dict[str, np.ndarray]) -> Bytes | None:
    """Red, green and blue out of the packed 32 bits."""
    packed = columns.get("rgb", columns.get("rgba"))
    if packed is None or packed.dtype.itemsize != 4:
        return None
    bits = np.ascontiguousarray(packed).view(np.uint32)
    return np.column_stack([(bits >> shift & 255).astype(np.uint8) for shift in (16, 8, 0)])
