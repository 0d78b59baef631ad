"""Poses of photos: a table, ODM's ``shots.geojson`` or COLMAP's ``images.txt``."""

import csv
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.geometry.angles import direction
from planner.geometry.arrays import Floats
from planner.scene.readers.source import refusal

COLUMNS = ("x", "y", "z", "yaw_deg", "pitch_deg")
OPTICS = ("width_px", "height_px", "focal_px")
_NAME = "name"
_LARGEST = 256_000_000  # bytes of a file
_MOST = 20_000  # photos: each is held against each new one
_HUGE = 1e12  # no coordinate on Earth is so large, in any unit
_UNIT = 1e-3  # by which a quaternion's length may differ from 1
_MALFORMED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
_FORMS = "write a table with the columns x,y,z,yaw_deg,pitch_deg"


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses as a file has them.

    Parameters
    ----------
    xyz
        Positions in the coordinates of the scene's file, shape (N, 3).
    forward, up
        Unit vectors along the view and to the top of the picture, shape (N, 3).
    level
        Whether these are along the local axes, z up, and not along those of the scene's file.
    names
        Of the photos, length N.
    optics
        Width, height and focal length in pixels, shape (N, 3); not a number where unknown.

    """

    xyz: Floats
    forward: Floats
    up: Floats
    level: bool
    names: tuple[str, ...]
    optics: Floats


def read_poses(path: Path) -> Poses:
    """Read poses by the file's extension.

    ``.csv`` holds the columns x, y, z in the coordinates of the scene's file, ``yaw_deg`` clockwise
    from grid north and ``pitch_deg`` from the horizon (-90 is nadir), and may hold ``name``,
    ``width_px``, ``height_px`` and ``focal_px``. ``.geojson`` and ``.json`` are what OpenDroneMap
    writes as ``shots.geojson``; ``.txt`` is COLMAP's ``images.txt``, whose model must have
    been brought to the coordinates of the scene's file.

    Raises
    ------
    PlannerError
        If the file is missing, too large, of another kind, or a pose in it is malformed; the
        message names the line or the photo.

    """
    readers: dict[str, Callable[[Path, str], Poses]] = {
        ".csv": _table, ".geojson": _shots, ".json": _shots, ".txt": _colmap,
    }  # fmt: skip
    reader = readers.get(path.suffix.lower())
    if reader is None:
        wrong = f"the extension {path.suffix!r} is unknown for poses"
        raise refusal(path, wrong, "give a .csv, ODM's shots.geojson or COLMAP's images.txt")
    try:
        if path.stat().st_size > _LARGEST:
            raise refusal(path, f"it is larger than {_LARGEST / 1e6:.0f} MB", "leave photos out")
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise refusal(path, "it is no text", _FORMS) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise refusal(path, f"it cannot be read ({reason})", "check the path") from None
    poses = reader(path, text)
    if len(poses.xyz) == 0:
        raise refusal(path, "it holds no pose", "export it again, or leave scene.images out")
    return poses


def _table(path: Path, text: str) -> Poses:
    """Table with a header."""
    lines = text.splitlines()
    head = [word.strip().lower() for word in lines[0].split(",")] if lines else []
    missing = [name for name in COLUMNS if head.count(name) != 1]
    if missing:
        wrong = f"line 1: its header names no column {missing[0]}, or more than one"
        raise refusal(path, wrong, _FORMS)
    known = [name for name in OPTICS if name in head]
    if known and len(known) < len(OPTICS):
        wrong = f"line 1: its header names {known[0]}, but not all of {', '.join(OPTICS)}"
        raise refusal(path, wrong, "give all three of them or none")
    rows, names, optics = [], [], []
    for line, words in _rows(path, lines[1:]):
        if len(words) != len(head):
            wrong = f"line {line}: it has {len(words)} fields where the header has {len(head)}"
            raise refusal(path, wrong, "mend that line")
        cells = dict(zip(head, words, strict=True))
        rows.append([_number(path, line, name, cells[name]) for name in COLUMNS])
        optics.append([_number(path, line, name, cells[name]) for name in known])
        names.append(cells.get(_NAME) or f"line {line}")
        if not (abs(rows[-1][3]) <= 360.0 and abs(rows[-1][4]) <= 90.0):
            wrong = f"line {line}: yaw {rows[-1][3]:g} or pitch {rows[-1][4]:g} is out of range"
            raise refusal(path, wrong, "give degrees, pitch from -90 (nadir) to 90")
        if known and not min(optics[-1]) > 0.0:
            raise refusal(path, f"line {line}: {', '.join(OPTICS)} must be positive", "mend them")
    table = np.array(rows).reshape(-1, 5)
    yaw, pitch = table[:, 3], table[:, 4]
    return Poses(
        xyz=table[:, :3],
        forward=direction(yaw, pitch),
        up=direction(yaw, pitch + 90.0),
        level=True,
        names=tuple(names),
        optics=np.array(optics).reshape(-1, 3) if known else np.full((len(table), 3), np.nan),
    )


def _rows(path: Path, lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and fields of the lines that hold something."""
    for number, line in enumerate(lines, start=2):
        if number > _MOST + 1:
            raise refusal(path, f"it holds more than {_MOST} photos", "leave photos out")
        if line.strip():
            try:
                yield number, [word.strip() for word in next(csv.reader([line], strict=True))]
            except csv.Error as error:
                raise refusal(path, f"line {number}: {error}", "mend that line") from None


def _number(path: Path, line: int, name: str, word: str) -> float:
    """A finite number."""
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not abs(value) < _HUGE:
        wrong = f"line {line}: {name} is {word[:40]!r}, which is no usable number"
        raise refusal(path, wrong, "mend that line")
    return value


def _shots(path: Path, text: str) -> Poses:
    """Shots of OpenDroneMap: positions in its projected system, turns as angle times axis."""
    try:
        tree = json.loads(text)
        features = tree["features"]
        if len(features) > _MOST:
            raise refusal(path, f"it holds more than {_MOST} photos", "leave photos out")
    except (ValueError, RecursionError) as error:
        raise refusal(path, f"it is not valid JSON ({error})", "export it again") from None
    except (KeyError, TypeError):
        raise refusal(path, "it holds no features", "give ODM's odm_report/shots.geojson") from None
    xyz, turns, names, optics = [], [], [], []
    for row, feature in enumerate(features):
        try:
            shot = feature["properties"]
            names.append(str(shot.get("filename", f"shot {row}")))
            xyz.append(_three(shot["translation"]))
            turns.append(_turn(_three(shot["rotation"])))
            optics.append(_lens(shot))
        except _MALFORMED as error:
            wrong = f"shot {row}: it has no translation and rotation of three numbers ({error!r})"
            remedy = "give the odm_report/shots.geojson of a finished ODM project"
            raise refusal(path, wrong, remedy) from None
    return _turned(xyz, turns, names, np.array(optics).reshape(-1, 3))


def _three(values: Any) -> Floats:
    """Three finite numbers."""
    three = np.array([float(value) for value in values])
    if three.shape != (3,) or not (np.abs(three) < _HUGE).all():
        raise ValueError(f"{values}")
    return three


def _lens(shot: dict[str, Any]) -> list[float]:
    """Width, height and focal length in pixels of a shot, where it says all of them."""
    width, height = float(shot.get("width") or 0.0), float(shot.get("height") or 0.0)
    lens = width, height, float(shot.get("focal") or 0.0) * max(width, height)
    return list(lens) if all(0.0 < value < _HUGE for value in lens) else [np.nan] * 3


def _turn(angle_axis: Floats) -> Floats:
    """Rotation ``camera_from_world`` about an axis by its length in radians, shape (3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(angle_axis).as_matrix())


def _colmap(path: Path, text: str) -> Poses:
    """COLMAP's images: two lines each, the second with points."""
    xyz: list[Floats] = []
    turns: list[Floats] = []
    names: list[str] = []
    lines = [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=1)
        if not line.startswith("#")
    ]
    for number, line in lines[::2]:
        words = line.split(maxsplit=9)
        if not words:
            continue
        try:
            values = np.array([float(word) for word in words[1:8]])
            turn = _quaternion(values[:4])
            xyz.append(_three(-turn.T @ _three(values[4:])))
            names.append(words[9].strip())
        except _MALFORMED:
            wrong = f"line {number}: it is no image (id, quaternion, translation, camera, name)"
            raise refusal(path, wrong, "export the model as text with COLMAP again") from None
        turns.append(turn)
        if len(names) > _MOST:
            raise refusal(path, f"it holds more than {_MOST} photos", "leave photos out")
    return _turned(xyz, turns, names, np.full((len(names), 3), np.nan))


def _quaternion(wxyz: Floats) -> Floats:
    """Rotation of a unit quaternion, real part first, shape (3, 3)."""
    from scipy.spatial.transform import Rotation

    if not (np.abs(wxyz) < 2.0).all() or abs(np.linalg.norm(wxyz) - 1.0) > _UNIT:
        raise ValueError("no unit quaternion")
    return np.asarray(Rotation.from_quat(np.roll(wxyz, -1)).as_matrix())


def _turned(xyz: list[Floats], turns: list[Floats], names: list[str], optics: Floats) -> Poses:
    """Poses of cameras with x to the right, y down and z forward."""
    matrices = np.array(turns).reshape(-1, 3, 3)
    return Poses(
        xyz=np.array(xyz).reshape(-1, 3),
        forward=matrices[:, 2],
        up=-matrices[:, 1],
        level=False,
        names=tuple(names),
        optics=optics,
    )
