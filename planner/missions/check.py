"""Read a plan folder back and prove it safe, with other code than the one that planned it."""

import hashlib
import zipfile
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.airspace.field import DistanceField
from planner.airspace.storage import StoredAirspace, read_arrays
from planner.config import Config, load_config
from planner.errors import PlannerError
from planner.flight.limits import Limits
from planner.flight.path import FlightPath
from planner.flight.sampling import sample_path
from planner.flight.timing import Timeline, fly_in_time
from planner.geometry import bezier
from planner.geometry.arrays import Floats
from planner.missions.faults import SAME_METRES, curve_faults, line_faults, row_faults
from planner.missions.records import read_json
from planner.missions.sorties import sortie_faults
from planner.missions.tables import read_path_table, read_viewpoints
from planner.viewpoints.viewpoints import Viewpoints

ELSEWHERE = "elsewhere"
"""Key of ``path.json``: photos at the end of ``viewpoints.csv`` that only sorties take."""

MOST_ARRAY_BYTES = 4 * 2**30
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    ValueError,
    KeyError,
    EOFError,
    NotImplementedError,
    RuntimeError,
    MemoryError,
)


@dataclass(frozen=True, slots=True)
class Check:
    """What the files of a plan prove, or what they contradict.

    Parameters
    ----------
    problems
        What is unsafe or contradictory, one sentence each; empty if all is proven.
    pieces, rows, viewpoints
        Numbers of Bezier pieces, rows of ``path.csv`` and viewpoints that were checked.
    d_min
        Distance that is asked for, metres.
    clearance
        Proven lower bound of the distance to solids over the whole curve, metres.
    piece
        Piece of the curve where that is.
    raw_clearance
        The same to the raw points of the coarse model alone, by a KD-tree, metres.
    zone_distance
        Proven lower bound of the distance to zones, metres; ``None`` without zones.
    line_clearance
        Proven lower bound of the distance to solids along straight lines from row to row of
        ``path.csv``, metres.
    line_nearest
        Place on those lines, near which that is: x, y, z, metres.
    line
        Line of ``path.csv`` before that place.
    sorties
        Number of sorties that were proven as well.

    """

    problems: tuple[str, ...]
    pieces: int
    rows: int
    viewpoints: int
    d_min: float
    clearance: float | None
    piece: int
    raw_clearance: float | None
    zone_distance: float | None
    line_clearance: float | None = None
    line_nearest: tuple[float, float, float] | None = None
    line: int = -1
    sorties: int = 0

    @property
    def ok(self) -> bool:
        """Whether the plan is proven safe and its files agree."""
        return not self.problems

    @property
    def summary(self) -> str:
        """One sentence for people."""
        if self.clearance is None:
            return "safe: the plan flies nowhere"
        return (
            f"safe: {self.pieces} pieces proven to stay {self.clearance:.3f} m from everything "
            f"solid by the checker's own, coarser distances (asked: {self.d_min:.3f} m; nearest in "
            f"segment {self.piece}); "
            f"{self.rows} rows and {self.viewpoints} viewpoints agree, and straight lines from row "
            f"to row stay {self.line_clearance:.3f} m away"
            + (f"; {self.sorties} sorties keep that and their limits" if self.sorties else "")
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {"ok": self.ok, **asdict(self), "problems": list(self.problems)}


def check_folder(
    folder: str | Path, *, scene: str | Path | None = None, sealed: bool = True
) -> Check:
    """Prove a written plan from its files alone.

    Every row of ``path.csv`` is worked out again from ``path.json`` (to 1 mm), the viewpoints are
    found on the curve, and the whole curve is proven to keep ``d_min`` from the solids and from the
    raw points, and ``zone_margin`` from the zones: by a distance field and a KD-tree, and halving
    of the curve under a Lipschitz bound, none of which took part in planning.

    Parameters
    ----------
    folder
        Plan folder.
    scene
        File that the plan was made from; if given, its hash must be the recorded one.
    sealed
        Whether ``report.json`` must be there, with the hash of every other file; it is written
        last, once the rest is proven.

    Returns
    -------
    check
        The proof, or the contradictions.

    Raises
    ------
    PlannerError
        If a file is missing, truncated or malformed; the message names file and line.

    """
    folder = Path(folder)
    if not folder.is_dir():
        raise PlannerError(f"{folder}: is no folder; name the folder of a plan")
    arrays = read_arrays_file(folder / "airspace.npz")
    field = DistanceField.from_arrays(arrays, name=str(folder / "airspace.npz"))
    stored = read_arrays(arrays, name=str(folder / "airspace.npz"))
    path, limits = read_path_file(folder / "path.json")
    config = read_config(folder / "config.toml")
    viewpoints = read_viewpoints(folder / "viewpoints.csv")
    rows = read_path_table(folder / "path.csv")
    sorties = 0
    problems = [
        *_hash_problems(folder / "scene.json", scene),
        *_viewpoint_problems(
            folder / "viewpoints.csv", path, viewpoints, field, _elsewhere(folder, config)
        ),
    ]
    if not problems:
        problems += _row_problems(folder, fly_in_time(path, viewpoints, limits), rows, field.d_min)
        sorties, faults = sortie_faults(folder, viewpoints, field, stored, config)
        problems += faults
    problems += _agreement_problems(folder, path, field, stored, config)
    if sealed:
        problems += _seal_problems(folder)
    # a flight of one photo has no curve: its place is proven instead
    standing = np.repeat(viewpoints.positions[:, None], 4, axis=1)
    controls = path.controls if len(path) else standing
    solid, raw, zones, near = curve_faults(controls, field, stored)
    flown, off_line = line_faults(folder / "path.csv", rows, field, stored, first_line=2)
    problems += near + off_line
    lowest = int(np.argmin(solid.bound)) if len(controls) else -1
    zone_distance = float(zones.bound.min()) if len(controls) else np.inf
    raw_clearance = float(raw.bound.min()) if len(controls) else np.inf
    return Check(
        problems=tuple(problems),
        pieces=len(path),
        rows=len(rows),
        viewpoints=len(viewpoints),
        d_min=field.d_min,
        clearance=float(solid.bound[lowest]) if len(controls) else None,
        piece=lowest,
        raw_clearance=raw_clearance if np.isfinite(raw_clearance) else None,
        zone_distance=zone_distance if np.isfinite(zone_distance) else None,
        line_clearance=None if flown is None else flown.bound,
        line_nearest=None if flown is None else _triple(flown.point),
        line=-1 if flown is None else flown.nearest + 2,
        sorties=sorties,
    )


def read_config(path: Path) -> Config:
    """Settings that a plan was made with."""
    if not path.is_file():
        raise PlannerError(f"{path}: is missing; plan again")
    return load_config(path)


def read_arrays_file(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of an NPZ file, without unpickling and within bounded memory."""
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(item.file_size for item in archive.infolist()) > MOST_ARRAY_BYTES:
                raise PlannerError(f"{path}: unpacks to more than 4 GB; plan again")
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except OSError as error:
        raise PlannerError(
            f"{path}: cannot be read ({error.strerror or error}); plan again"
        ) from None
    except _DAMAGED as error:
        raise PlannerError(f"{path}: is damaged ({error}); plan again") from None


def read_path_file(path: Path) -> tuple[FlightPath, Limits]:
    """Curve and limits of motion of ``path.json``."""
    tree = read_json(path)
    try:
        if tree["format"] != "scanwright path" or tree["version"] != 2:
            raise ValueError(f"format {tree['format']!r} version {tree['version']!r} is not known")
        limits = Limits.from_record(tree["motion"])
        return FlightPath.from_records(tree["pieces"], start=int(tree["start"])), limits
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error).rstrip(".")
        raise PlannerError(f"{path}: {what}; plan again") from None


def _hash_problems(record: Path, scene: str | Path | None) -> list[str]:
    """Whether the scene file is the one that was planned."""
    tree = read_json(record)
    if not isinstance(tree, dict) or not isinstance(tree.get("sha256"), str):
        raise PlannerError(f"{record}: sha256 is missing; plan again")
    if scene is None:
        return []
    try:
        found = sha256(Path(scene))
    except OSError as error:
        raise PlannerError(f"{scene}: cannot be read ({error.strerror}); check the path") from None
    if found == tree["sha256"]:
        return []
    return [f"{scene}: is not the file that was planned (its SHA-256 begins with {found[:12]})"]


def _agreement_problems(
    folder: Path,
    path: FlightPath,
    field: DistanceField,
    stored: StoredAirspace,
    config: Config,
) -> list[str]:
    """Whether the files speak of the same distance, zones and clearances."""
    problems = []
    claimed = read_json(folder / "path.json").get("d_min")
    wanted = config.scale.d_min
    if claimed != field.d_min or wanted not in {None, field.d_min}:
        problems.append(
            f"{folder / 'airspace.npz'}: d_min is {field.d_min}, but {claimed} in path.json"
            + ("" if wanted is None else f" and {wanted} in config.toml")
        )
    ceiling = stored.zones.ceiling
    above = None if ceiling is None else ceiling.above_ground
    wanted_zones = config.airspace
    if len(stored.zones.prisms) != len(wanted_zones.zones) or above != wanted_zones.ceiling:
        problems.append(f"{folder / 'airspace.npz'}: zones or ceiling are not those of config.toml")
    if stored.zones.kept != wanted_zones.zone_margin:
        problems.append(
            f"{folder / 'airspace.npz'}: zone_margin is {stored.zones.kept:g}, but "
            f"{wanted_zones.zone_margin:g} in config.toml"
        )
    if len(path):
        middle = bezier.evaluate(path.controls, np.full(len(path), 0.5))
        bold = np.flatnonzero(path.clearance > field.clearance(middle) + SAME_METRES)
        problems += [
            f"{folder / 'path.json'}: segment {piece} claims a clearance of "
            f"{path.clearance[piece]:.3f} m that it has not"
            for piece in bold[:1]
        ]
    return problems


def _seal_problems(folder: Path) -> list[str]:
    """Whether every file is the one whose hash the report holds."""
    report = read_json(folder / "report.json")
    sums = report.get("files") if isinstance(report, dict) else None
    if not isinstance(sums, dict) or not sums:
        raise PlannerError(f"{folder / 'report.json'}: files is missing; plan again")
    problems = []
    for name, recorded in sums.items():
        place = folder / Path(name).name
        if not place.is_file():
            raise PlannerError(f"{place}: is missing; plan again")
        if sha256(place) != recorded:
            problems.append(f"{place}: was changed after it was proven")
    return problems


def sha256(path: Path) -> str:
    """Hash of a file, hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _elsewhere(folder: Path, config: Config) -> int:
    """Photos that only sorties take; that these do is proven with the sorties."""
    claimed = read_json(folder / "path.json").get(ELSEWHERE, 0)
    if not isinstance(claimed, int) or claimed < 0 or (claimed and not config.sorties.stations):
        raise PlannerError(f"{folder / 'path.json'}: {ELSEWHERE} is {claimed!r}; plan again")
    return claimed


def _viewpoint_problems(
    table: Path, path: FlightPath, viewpoints: Viewpoints, field: DistanceField, elsewhere: int
) -> list[str]:
    """Whether the curve passes through each viewpoint, in order, but for those elsewhere."""
    ends = np.flatnonzero(path.reached >= 0)
    named = np.concatenate([[path.start] if path.start >= 0 else [], path.reached[ends]]).astype(
        int
    )
    visited = len(np.unique(named))
    if visited + elsewhere != len(viewpoints) or (visited and named.max() >= visited):
        line = min(len(viewpoints), visited + elsewhere) + 2
        return [
            f"{table}: line {line}: has {len(viewpoints)} viewpoints where the path visits "
            f"{visited}"
            + (f" and sorties {elsewhere} more" if elsewhere else "")
            + "; a line is missing or too many"
        ]
    if not len(path):
        return []
    places = np.vstack([path.controls[:1, 0], path.controls[ends, 3]])
    pieces = np.concatenate([[0], ends])
    off = np.linalg.norm(places - viewpoints.positions[named], axis=1)
    problems = []
    for row in np.flatnonzero(off > SAME_METRES):
        position = viewpoints.positions[named[row]]
        clearance = float(field.clearance(position[None])[0])
        problems.append(
            f"{table}: line {named[row] + 2}: viewpoint {named[row]} is {off[row]:.3f} m off the "
            f"path's segment {pieces[row]}; the clearance there is {clearance:.3f} m "
            f"(d_min {field.d_min:.3f} m)"
        )
    return problems


def _row_problems(folder: Path, timeline: Timeline, rows: Floats, d_min: float) -> list[str]:
    """Whether each row of ``path.csv`` is what ``path.json`` says; names the first that is not."""
    try:
        wanted = sample_path(timeline, d_min=d_min)
    except ValueError as error:
        raise PlannerError(f"{folder / 'path.json'}: {error} plan again") from None
    return row_faults(folder / "path.csv", rows, wanted, first_line=2, source="path.json")


def _triple(point: Floats) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z
