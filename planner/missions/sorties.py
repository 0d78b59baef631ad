"""Sorties as files, and the proof that what was written is safe and within its limits."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.airspace.field import DistanceField
from planner.airspace.storage import StoredAirspace
from planner.config import Config
from planner.errors import PlannerError
from planner.flight.limits import Limits
from planner.flight.path import FlightPath
from planner.missions.faults import (
    SAME_METRES,
    SAME_SECONDS,
    curve_faults,
    line_faults,
    row_faults,
)
from planner.missions.records import read_json, write_json
from planner.missions.tables import read_sortie_table, write_sortie_table
from planner.sorties.sortie import Sortie, timed_sortie
from planner.sorties.station import Station, shortfall, shortfall_of_zones
from planner.viewpoints.viewpoints import Viewpoints

FILE, TABLE = "sorties.json", "sorties.csv"


@dataclass(frozen=True, slots=True)
class SortieLimits:
    """What a sortie may take: seconds without the reserve, and waypoints."""

    seconds: float
    waypoints: int | None


@dataclass(frozen=True, slots=True, eq=False)
class WrittenSorties:
    """What ``sorties.json`` holds; ``claims`` are seconds and waypoints that it states of each."""

    stations: tuple[Station, ...]
    sorties: tuple[Sortie, ...]
    most: SortieLimits
    claims: tuple[tuple[float, int], ...]


def write_sorties(
    folder: Path,
    stations: tuple[Station, ...],
    sorties: tuple[Sortie, ...],
    *,
    d_min: float,
    most: SortieLimits,
) -> None:
    """Write ``sorties.json``, the certified curves, and ``sorties.csv``, the rows to fly."""
    write_json(
        folder / FILE,
        {
            "format": "scanwright sorties",
            "version": 1,
            "motion": sorties[0].timeline.limits.to_record(),
            "climb_speed": sorties[0].climb_speed,
            "most_seconds": most.seconds,
            "most_waypoints": most.waypoints,
            "stations": [
                {"pad": station.pad.tolist(), "entry": station.entry.tolist()}
                for station in stations
            ],
            "sorties": [
                {
                    "station": sortie.number,
                    "photos": sortie.photos.tolist(),
                    "shared": sortie.shared.tolist(),
                    "duration": sortie.duration,
                    "waypoints": sortie.waypoints,
                    "pieces": sortie.path.to_records(),
                }
                for sortie in sorties
            ],
        },
    )
    write_sortie_table(folder / TABLE, [sortie.rows(d_min) for sortie in sorties])


def read_sorties(path: Path, viewpoints: Viewpoints) -> WrittenSorties:
    """Read ``sorties.json`` back.

    Raises
    ------
    PlannerError
        If it is missing, malformed, or speaks of other viewpoints.

    """
    tree = read_json(path)
    try:
        if tree["format"] != "scanwright sorties" or tree["version"] != 1:
            raise ValueError(f"format {tree['format']!r} version {tree['version']!r} is not known")
        limits, climb_speed = Limits.from_record(tree["motion"]), float(tree["climb_speed"])
        if not 0.0 < climb_speed < np.inf:
            raise ValueError(f"climb_speed {climb_speed} is not positive")
        most = tree["most_waypoints"]
        allowed = SortieLimits(float(tree["most_seconds"]), None if most is None else int(most))
        stations = tuple(
            Station(np.array(record["pad"], float), np.array(record["entry"], float))
            for record in tree["stations"]
        )
        sorties = tuple(
            _sortie(record, stations, viewpoints, limits, climb_speed) for record in tree["sorties"]
        )
        claims = tuple(
            (float(record["duration"]), int(record["waypoints"])) for record in tree["sorties"]
        )
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error).rstrip(".")
        raise PlannerError(f"{path}: {what}; plan again") from None
    return WrittenSorties(stations, sorties, allowed, claims)


def _sortie(
    record: dict[str, Any],
    stations: tuple[Station, ...],
    viewpoints: Viewpoints,
    limits: Limits,
    climb_speed: float,
) -> Sortie:
    number = int(record["station"])
    photos = np.array(record["photos"], dtype=np.int64)
    if not 0 <= number < len(stations):
        raise ValueError(f"station {number} of {len(stations)} is not known")
    if not len(photos) or photos.min() < 0 or photos.max() >= len(viewpoints):
        raise ValueError(f"photos {photos.tolist()} are not among {len(viewpoints)}")
    return timed_sortie(
        number,
        stations[number],
        viewpoints,
        FlightPath.from_records(record["pieces"], start=0),
        photos=photos,
        shared=np.array(record["shared"], dtype=np.int64),
        limits=limits,
        climb_speed=climb_speed,
    )


def sortie_faults(
    folder: Path,
    viewpoints: Viewpoints,
    field: DistanceField,
    stored: StoredAirspace,
    config: Config,
) -> tuple[int, list[str]]:
    """Number of sorties, and what their files contradict, one sentence each.

    Each sortie is proven as the whole flight is: its curve, its rows and the lines between them,
    its climb and descent, its photos where they should be, and its limits.
    """
    path, wanted = folder / FILE, config.sorties
    if not wanted.stations:
        strange = [f"{path}: is there, but config.toml names no station"] if path.exists() else []
        return 0, strange
    written = read_sorties(path, viewpoints)
    stations, sorties, most = written.stations, written.sorties, written.most
    table = read_sortie_table(folder / TABLE)
    faults = []
    usable = wanted.endurance_seconds * (1.0 - wanted.reserve)
    if most.seconds > usable + 1e-6 or most.waypoints != wanted.most_waypoints:
        faults.append(f"{path}: its limits are not those of config.toml")
    given = [station[:2] for station in wanted.stations]
    if len(given) != len(stations) or any(
        np.abs(station.pad[:2] - place).max() > SAME_METRES
        for station, place in zip(stations, given, strict=True)
    ):
        faults.append(f"{path}: its stations are not those of config.toml")
    faults += _photo_faults(path, sorties, len(viewpoints))
    for number, station in enumerate(stations):
        faults += _climb_faults(path, number, station, field, stored)
    line = 2
    for number, sortie in enumerate(sorties, start=1):
        name = f"sortie {number}"
        rows = table[table[:, 0] == number, 1:]
        faults += _limit_faults(path, name, sortie, most, written.claims[number - 1])
        faults += _place_faults(path, name, sortie)
        again = sortie.rows(field.d_min)
        faults += row_faults(folder / TABLE, rows, again, first_line=line, source=FILE)
        faults += curve_faults(sortie.path.controls, field, stored, name=f"{name}: segment")[3]
        flown = rows[1:-1]
        faults += line_faults(folder / TABLE, flown, field, stored, first_line=line + 1)[1]
        line += len(rows)
    if not np.array_equal(table[:, 0], np.sort(table[:, 0])) or line != len(table) + 2:
        faults.append(f"{folder / TABLE}: line {line}: belongs to no sortie of {FILE}")
    return len(sorties), faults


def _photo_faults(path: Path, sorties: tuple[Sortie, ...], count: int) -> list[str]:
    """Whether each photo is taken by one sortie, and by others only to be shared."""
    taken = np.zeros(count, dtype=np.int64)
    for sortie in sorties:
        np.add.at(taken, np.setdiff1d(sortie.photos, sortie.shared), 1)
    wrong = np.flatnonzero(taken != 1)
    return [
        f"{path}: viewpoint {row} is taken by {taken[row]} sorties, not counting shared photos"
        for row in wrong[:1]
    ]


def _climb_faults(
    path: Path, number: int, station: Station, field: DistanceField, stored: StoredAirspace
) -> list[str]:
    """Whether climb and descent leave the ground and come near to nothing else."""
    faults = []
    short = shortfall(station, field.clearance, field.d_min)
    if short is not None:
        faults.append(
            f"{path}: {short.height:.2f} m above station {number} the clearance is "
            f"{short.found:.2f} m where {short.needed:.2f} m are kept"
        )
    inside = shortfall_of_zones(station, stored.zones.margin)
    if inside is not None:
        faults.append(
            f"{path}: the climb at station {number} is {-inside:.2f} m too far into a zone or what "
            "is kept from it"
        )
    return faults


def _limit_faults(
    path: Path, name: str, sortie: Sortie, most: SortieLimits, claim: tuple[float, int]
) -> list[str]:
    """Whether a sortie keeps its limits, and takes what is claimed."""
    faults = []
    if abs(sortie.duration - claim[0]) > SAME_SECONDS or sortie.waypoints != claim[1]:
        faults.append(
            f"{path}: {name} takes {sortie.duration:.1f} s and {sortie.waypoints} waypoints, not "
            f"{claim[0]:.1f} s and {claim[1]}"
        )
    if sortie.duration > most.seconds + 1e-6:
        faults.append(
            f"{path}: {name} takes {sortie.duration:.1f} s where {most.seconds:.1f} s are allowed"
        )
    if most.waypoints is not None and sortie.waypoints > most.waypoints:
        faults.append(
            f"{path}: {name} has {sortie.waypoints} waypoints where {most.waypoints} are allowed"
        )
    return faults


def _place_faults(path: Path, name: str, sortie: Sortie) -> list[str]:
    """Whether the curve starts and ends at the entry and passes each photo's place."""
    curve = sortie.path
    ends = curve.controls[curve.reached >= 0, 3]
    places = np.vstack([curve.controls[:1, 0], ends])
    off = np.linalg.norm(places - sortie.timeline.viewpoints.positions, axis=1)
    return [
        f"{path}: {name}: place {place} is {off[place]:.3f} m off its curve"
        for place in np.flatnonzero(off > SAME_METRES)[:1]
    ]
