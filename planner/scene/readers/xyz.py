"""Tables of points as text: XYZ, CSV, TXT; any usual separator, with or without a header."""

import re
from pathlib import Path

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.readers.source import Source, colour_bytes, refusal

_COMMENTS = ("#", "//", "%", "!")
_NAMES = {
    "x": "x", "y": "y", "z": "z", "easting": "x", "northing": "y", "east": "x", "north": "y",
    "elevation": "z", "height": "z", "nx": "nx", "ny": "ny", "nz": "nz",
    "normal_x": "nx", "normal_y": "ny", "normal_z": "nz",
    "r": "red", "g": "green", "b": "blue", "red": "red", "green": "green", "blue": "blue",
    "class": "class", "classification": "class",
}  # fmt: skip


def read_xyz(path: Path) -> Source:
    """Read a text table of points.

    Columns go by the header's names where there is one. Otherwise the first three are x, y, z, and
    three further ones are colours if they are all whole numbers from 0 to 255, else normals.

    Raises
    ------
    PlannerError
        If a row is no row of numbers, or there are fewer than three columns.

    """
    first, names, skip = _start(path)
    separator = _separator(first)
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            lines = (_decimal_points(line, separator) for line in file)
            table = np.loadtxt(
                lines, delimiter=separator, skiprows=skip, comments=_COMMENTS, ndmin=2
            )
    except ValueError as error:
        wrong = f"it is no table of numbers ({_located(str(error), skip)})"
        raise refusal(path, wrong, "mend that row or export it as x y z columns") from error
    if table.shape[1] < 3:
        wrong = f"it has {table.shape[1]} columns of numbers"
        raise refusal(path, wrong, "export it with at least the columns x, y and z")
    columns = _columns(table, names)
    if not {"x", "y", "z"} <= columns.keys():
        raise refusal(path, f"its header {' '.join(names)!r} names no x, y, z", "name them so")
    colours = _stack(columns, ("red", "green", "blue"))
    return Source(
        np.column_stack([columns[name] for name in "xyz"]),
        normals=_stack(columns, ("nx", "ny", "nz")),
        colours=None if colours is None else colour_bytes(colours),
        classes=columns["class"].clip(0, 255).astype(np.uint8) if "class" in columns else None,
    )


def _start(path: Path) -> tuple[str, list[str], int]:
    """First line of data, names of the columns if there is a header, and lines to skip."""
    names: list[str] = []
    skip = 0
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for line in file:
            bare = line.strip()
            words = [word for word in re.split(r"[\s,;]+", bare.lstrip("/#%! ")) if word]
            named = [_NAMES.get(re.sub(r"\W.*$", "", word.lower()), "") for word in words]
            if {"x", "y", "z"} <= set(named):
                names = named
            elif bare and not bare.startswith(_COMMENTS) and len(words) > 1:
                return bare, names, skip
            skip += 1
            if skip > 100:
                break
    raise refusal(path, "it has no row of numbers", "export it as x y z columns")


def _separator(line: str) -> str | None:
    """What stands between the numbers of a line; ``None`` for white space."""
    if ";" in line:
        return ";"
    if "," in line and len(line.split(",")) >= 3:
        return ","
    return None


def _decimal_points(line: str, separator: str | None) -> str:
    """Turn decimal commas to points where commas do not separate; drop a trailing separator."""
    if separator != ",":
        line = line.replace(",", ".")
    return line if separator is None else line.rstrip().rstrip(separator) + "\n"


def _located(message: str, skip: int) -> str:
    """The parser's message with the row counted from the start of the file."""
    return re.sub(
        r"\brow (\d+)", lambda found: f"line {int(found.group(1)) + skip + 1}", message, count=1
    )


def _columns(table: Floats, names: list[str]) -> dict[str, Floats]:
    """Columns by name."""
    if len(names) == table.shape[1]:
        return {name: table[:, i] for i, name in enumerate(names) if name}
    order = ["x", "y", "z"]
    extra = table[:, 3:6] if table.shape[1] in {6, 9} else table[:, 4:7]
    if extra.shape[1] == 3 and len(extra):
        whole = bool(((extra == np.rint(extra)) & (extra >= 0) & (extra <= 255)).all())
        gap = [] if table.shape[1] in {6, 9} else [""]
        order += gap + (["red", "green", "blue"] if whole else ["nx", "ny", "nz"])
    return {name: table[:, i] for i, name in enumerate(order) if name}


def _stack(columns: dict[str, Floats], names: tuple[str, ...]) -> Floats | None:
    if not set(names) <= columns.keys():
        return None
    return np.column_stack([columns[name] for name in names])
