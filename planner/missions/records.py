"""The JSON files of a plan folder, and the samples as a coloured PLY."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import PlannerError
from planner.geometry.arrays import Bytes, Floats, Ints

MAX_BYTES = 512 * 2**20


def write_json(path: Path, tree: Any) -> None:
    """Write a tree as JSON, one key a line down to two levels, refusing NaN and infinity."""
    path.write_text(json.dumps(tree, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises
    ------
    PlannerError
        If it is missing, too large or not JSON; the message names the line.

    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise PlannerError(f"{path}: is larger than {MAX_BYTES // 2**20} MB; plan again")
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PlannerError(f"{path}: cannot be read ({error.strerror}); plan again") from None
    except json.JSONDecodeError as error:
        raise PlannerError(f"{path}: line {error.lineno}: {error.msg}; plan again") from None
    except (ValueError, RecursionError) as error:
        raise PlannerError(f"{path}: is not JSON ({type(error).__name__}); plan again") from None


def write_points(
    path: Path,
    xyz: Floats,
    *,
    normals: Floats,
    colours: Bytes,
    numbers: dict[str, Floats | Ints],
    comments: tuple[str, ...] = (),
) -> None:
    """Write points with named numbers as a binary PLY that common viewers open.

    Parameters
    ----------
    path
        File to write.
    xyz, normals
        Shape (N, 3), metres and unit vectors.
    colours
        Shape (N, 3), 0 to 255.
    numbers
        Further columns by name, each (N,); integers become ``int``, the rest ``double``.
    comments
        Lines for the header.

    """
    columns: list[tuple[str, str, str, Any]] = []
    columns += [(name, "double", "<f8", xyz[:, axis]) for axis, name in enumerate("xyz")]
    columns += [
        (name, "float", "<f4", normals[:, axis]) for axis, name in enumerate(("nx", "ny", "nz"))
    ]
    columns += [
        (name, "uchar", "u1", colours[:, axis])
        for axis, name in enumerate(("red", "green", "blue"))
    ]
    for name, values in numbers.items():
        whole = np.issubdtype(values.dtype, np.integer)
        columns.append((name, "int" if whole else "double", "<i4" if whole else "<f8", values))
    table = np.zeros(len(xyz), dtype=[(name, kind) for name, _, kind, _ in columns])
    for name, _, _, values in columns:
        table[name] = values
    header = ["ply", "format binary_little_endian 1.0"]
    header += [f"comment {line}" for line in comments]
    header += [f"element vertex {len(xyz)}"]
    header += [f"property {kind} {name}" for name, kind, _, _ in columns]
    header += ["end_header"]
    path.write_bytes("\n".join(header).encode("ascii") + b"\n" + table.tobytes())
