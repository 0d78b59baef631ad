"""LAS and LAZ, through laspy."""

import logging
import math
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from planner.geometry.arrays import Bytes
from planner.scene.readers.source import Source, refusal, truncated

_CHUNK = 1_000_000
_BEST_RATIO = 2_000  # no LAZ packs a record into less than this share of its size


def read_las(path: Path, *, limit: int) -> Source:
    """Read a LAS or LAZ file, every k-th point if it holds more than ``limit``.

    Parameters
    ----------
    path
        File to read.
    limit
        Most points to take into memory.

    Returns
    -------
    source
        Points with classes, and colours where the record format has them.

    Raises
    ------
    PlannerError
        If the file is not LAS, is cut short, or declares more than it can hold.

    """
    import laspy

    _check_header(path)
    try:
        with _silence("laspy"), laspy.open(path) as reader:
            header = reader.header
            stride = max(1, math.ceil(header.point_count / limit))
            parts, seen = [], 0
            for chunk in reader.chunk_iterator(_CHUNK):
                rows = slice(-seen % stride, None, stride)
                parts.append(_columns(chunk, rows))
                seen += len(chunk)
    except (OSError, ValueError, laspy.LaspyException, RuntimeError) as error:
        raise truncated(path, str(error)) from error
    except BaseException as error:  # the LAZ back end panics with a class of its own
        if isinstance(error, Exception) or type(error).__name__ != "PanicException":
            raise
        raise truncated(path, str(error)) from error
    if seen != header.point_count:
        raise truncated(path, f"{seen} of {header.point_count} points")
    if not parts:
        raise refusal(path, "it holds no points", "give a file with points")
    notes = (f"Took one point in {stride} of {seen}.",) if stride > 1 else ()
    colours = [part[1] for part in parts]
    return Source(
        xyz=np.concatenate([part[0] for part in parts]),
        colours=None if colours[0] is None else _eight_bits(np.concatenate(colours)),
        classes=np.concatenate([part[2] for part in parts]),
        crs=_crs(header),
        notes=notes,
    )


@contextmanager
def _silence(name: str) -> Iterator[None]:
    """Keep a library's log off the terminal: what goes wrong is told by our own error."""
    logger = logging.getLogger(name)
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)


def _check_header(path: Path) -> None:
    """Refuse a header whose counts the file cannot hold, before anything loops over them."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(375)
    if len(head) < 227:
        raise truncated(path, f"{size} bytes")
    length, start, records, kind, width, count = struct.unpack_from("<HIIBHI", head, 94)
    end, extended = 0, 0
    if head[25] >= 4 and len(head) == 375:
        end, extended = struct.unpack_from("<QI", head, 235)
        count = max(count, struct.unpack_from("<Q", head, 247)[0])
    if length + 54 * records > start or start > size or end + 60 * extended > size:
        raise truncated(path, f"{records + extended} records declared in {size} bytes")
    packed = kind & 0x80 != 0  # the compressor marks the point format so
    if width == 0 or count * width > (size - start) * (_BEST_RATIO if packed else 1):
        raise truncated(path, f"{count} points declared in {size} bytes")


def _columns(chunk: Any, rows: slice) -> tuple[Any, Any, Any]:
    """Positions, 16-bit colours or ``None``, and classes of a chunk."""
    xyz = np.column_stack([np.asarray(getattr(chunk, axis))[rows] for axis in "xyz"])
    names = set(chunk.point_format.dimension_names)
    colours = None
    if {"red", "green", "blue"} <= names:
        colours = np.column_stack(
            [np.asarray(getattr(chunk, name))[rows] for name in ("red", "green", "blue")]
        )
    return xyz, colours, np.asarray(chunk.classification, dtype=np.uint8)[rows]


def _eight_bits(colours: np.ndarray) -> Bytes | None:
    """Colours as bytes; writers disagree on whether 16-bit fields hold 8 or 16 bits."""
    top = int(colours.max(initial=0))
    if top == 0:
        return None
    return (colours if top <= 255 else colours >> 8).astype(np.uint8)


def _crs(header: Any) -> str | None:
    """CRS of the header as ``EPSG:n`` or WKT; ``None`` if there is none or it is unreadable."""
    try:
        crs = header.parse_crs()
    except Exception:  # a damaged or exotic record must not lose the points
        return None
    if crs is None:
        return None
    code = crs.to_epsg()
    return str(crs.to_wkt()) if code is None else f"EPSG:{code}"
