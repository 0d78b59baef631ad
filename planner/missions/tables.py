"""The tables of a plan folder: ``viewpoints.csv``, ``path.csv`` and ``sorties.csv``."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from planner.errors import PlannerError
from planner.geometry.angles import direction
from planner.geometry.arrays import Floats
from planner.viewpoints.viewpoints import Viewpoints

VIEWPOINT_COLUMNS = ("index", "x", "y", "z", "dx", "dy", "dz", "yaw_deg", "pitch_deg", "kind")
PATH_COLUMNS = ("t", "x", "y", "z", "yaw_deg", "pitch_deg", "segment")
SORTIE_COLUMNS = ("sortie", *PATH_COLUMNS)
MAX_ROWS = 5_000_000


def write_viewpoints(path: Path, viewpoints: Viewpoints) -> None:
    """Write ``viewpoints.csv``, in visiting order, metres to 0.1 mm, degrees to 0.0001."""
    lines = [",".join(VIEWPOINT_COLUMNS)]
    lines += [
        ",".join(
            [str(record["index"])]
            + [f"{_positive(record[key], 4):.4f}" for key in ("x", "y", "z")]
            + [f"{_positive(record[key], 6):.6f}" for key in ("dx", "dy", "dz")]
            + [f"{_positive(record[key], 4):.4f}" for key in ("yaw_deg", "pitch_deg")]
            + [record["kind"]]
        )
        for record in viewpoints.to_records()
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def read_viewpoints(path: Path) -> Viewpoints:
    """Read ``viewpoints.csv`` back.

    Raises
    ------
    PlannerError
        If a line is malformed, out of order, or its direction contradicts its angles; the message
        names the line.

    """
    numbers: list[list[float]] = []
    kinds: list[str] = []
    for line, row in _rows(path, VIEWPOINT_COLUMNS):
        values = _numbers(path, line, row[:-1])
        if values[0] != len(numbers):
            raise PlannerError(
                f"{path}: line {line}: index {row[0]} where {len(numbers)} was expected; "
                "a line is missing or out of order, so plan again"
            )
        look = direction(np.array(values[7]), np.array(values[8]))
        if np.abs(look - values[4:7]).max() > 1e-3:
            raise PlannerError(
                f"{path}: line {line}: direction dx,dy,dz contradicts yaw_deg,pitch_deg; plan again"
            )
        numbers.append(values)
        kinds.append(row[-1])
    table = np.array(numbers, dtype=np.float64).reshape(-1, 9)
    none = np.full(len(table), -1, dtype=np.int64)
    return Viewpoints(table[:, 1:4], table[:, 7], table[:, 8], tuple(kinds), none)


def write_path_table(path: Path, rows: Floats) -> None:
    """Write ``path.csv``: rows of t, x, y, z, yaw, pitch, segment, shape (n, 7)."""
    _write(path, [",".join(PATH_COLUMNS), *map(_line, rows)])


def write_sortie_table(path: Path, tables: Sequence[Floats]) -> None:
    """Write ``sorties.csv``: the rows of each sortie as in ``path.csv``, after its number from 1.

    Time starts at lift-off of each sortie.
    """
    lines = [
        f"{number},{_line(row)}" for number, rows in enumerate(tables, start=1) for row in rows
    ]
    _write(path, [",".join(SORTIE_COLUMNS), *lines])


def read_sortie_table(path: Path) -> Floats:
    """Read ``sorties.csv`` back, shape (n, 8); the row of line ``k`` is ``k - 2``.

    Raises
    ------
    PlannerError
        If a line is malformed; the message names it.

    """
    rows = [_numbers(path, line, row) for line, row in _rows(path, SORTIE_COLUMNS)]
    return np.array(rows, dtype=np.float64).reshape(-1, len(SORTIE_COLUMNS))


def _line(row: Floats) -> str:
    """One row of a path as text."""
    middle = [f"{_positive(float(value), 4):.4f}" for value in row[1:6]]
    return ",".join([f"{row[0]:.6f}", *middle, f"{int(row[6])}"])


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def read_path_table(path: Path) -> Floats:
    """Read ``path.csv`` back, shape (n, 7); the row of line ``k`` is ``k - 2``.

    Raises
    ------
    PlannerError
        If a line is malformed; the message names it.

    """
    rows = [_numbers(path, line, row) for line, row in _rows(path, PATH_COLUMNS)]
    return np.array(rows, dtype=np.float64).reshape(-1, len(PATH_COLUMNS))


def _positive(value: float, digits: int) -> float:
    """Round, and turn a negative zero into zero."""
    return round(value, digits) + 0.0


def _rows(path: Path, columns: tuple[str, ...]) -> list[tuple[int, list[str]]]:
    """Rows of a table with their line numbers, after its header is checked."""
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            rows = list(enumerate(csv.reader(stream), start=1))
    except OSError as error:
        raise PlannerError(f"{path}: cannot be read ({error.strerror}); plan again") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise PlannerError(f"{path}: is not a text table ({error}); plan again") from None
    if not rows or tuple(rows[0][1]) != columns:
        raise PlannerError(f"{path}: line 1: the header must be {','.join(columns)}; plan again")
    if len(rows) > MAX_ROWS:
        raise PlannerError(f"{path}: has more than {MAX_ROWS} lines; plan again")
    for line, row in rows[1:]:
        if len(row) != len(columns):
            raise PlannerError(
                f"{path}: line {line}: has {len(row)} fields where {len(columns)} were expected; "
                "plan again"
            )
    return rows[1:]


def _numbers(path: Path, line: int, row: list[str]) -> list[float]:
    """Fields of one row as finite numbers."""
    try:
        values = [float(field) for field in row]
    except ValueError as error:
        raise PlannerError(f"{path}: line {line}: {error}; plan again") from None
    if not np.isfinite(values).all():
        raise PlannerError(f"{path}: line {line}: a number is not finite; plan again")
    return values
