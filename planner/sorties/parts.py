"""Parts of free space that no flight can leave, each flown from the stations that reach it."""

from dataclasses import dataclass, replace

import numpy as np

from planner.airspace.space import Space
from planner.config import FlightSettings, SortieSettings
from planner.findings import Finding
from planner.flight.fly import Flight
from planner.flight.limits import Limits
from planner.flight.timing import fly_in_time
from planner.geometry.arrays import Floats, Ints, read_only
from planner.route.ways import FreeWays
from planner.sorties.schedule import plan_sorties
from planner.sorties.sorties import Sorties
from planner.sorties.station import Station


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Photos that are flown together, and where from.

    Parameters
    ----------
    rows
        Rows of the photos in visiting order, shape (n,).
    stations
        Numbers of the stations that reach them.

    """

    rows: Ints
    stations: tuple[int, ...]

    def __post_init__(self) -> None:
        rows = read_only(self.rows, (None,), name="rows", dtype=np.int64)
        object.__setattr__(self, "rows", rows)


def parts_to_fly(
    spaces: Ints, positions: Floats, stations: tuple[Station, ...], ways: FreeWays
) -> tuple[Part, ...]:
    """Find the parts of free space that have photos and are reached from some station.

    Parameters
    ----------
    spaces
        Number of the part that each photo lies in, shape (V,): 0 for the one with most photos,
        and so on.
    positions
        Places of the photos in visiting order, shape (V, 3), metres.
    stations
        Places of take-off and landing; there may be none.
    ways
        Free ways.

    Returns
    -------
    parts
        At least one, the largest that a station reaches first: it is what ``path.json`` holds, if
        any of it is flown. All photos are one part if there are no stations, or none that reaches
        anything: then it is for the flight and its sorties to refuse.

    """
    every = np.arange(len(positions))
    found = []
    for space in np.unique(spaces).tolist() if stations else ():
        rows = every[spaces == space]
        homes = _reaching(positions[rows], stations, ways)
        if homes:
            found.append(Part(rows, homes))
    return tuple(found) or (Part(every, tuple(range(len(stations)))),)


def _reaching(positions: Floats, stations: tuple[Station, ...], ways: FreeWays) -> tuple[int, ...]:
    """Stations that are not known to be apart from the photo that is nearest to each."""
    homes = []
    for number, station in enumerate(stations):
        nearest = int(np.linalg.norm(positions - station.entry, axis=1).argmin())
        if not ways.between(station.entry, positions[nearest]).apart:
            homes.append(number)
    return tuple(homes)


def parts_left(
    spaces: Ints, positions: Floats, parts: tuple[Part, ...], findings: tuple[Finding, ...]
) -> tuple[Finding, ...]:
    """Findings on parts of free space that no station reaches, with the photos that it costs.

    Parameters
    ----------
    spaces, positions
        As :func:`parts_to_fly` takes them.
    parts
        What is flown to, whether or not the flight keeps any photo.
    findings
        What the order says of parts that cannot be reached from the first.

    """
    if len(parts) == 1 and len(parts[0].rows) == len(positions):
        return findings
    reached = {int(spaces[part.rows[0]]) for part in parts}
    return tuple(
        _unreached(positions[spaces == space])
        for space in np.unique(spaces).tolist()
        if space not in reached
    )


def _unreached(positions: Floats) -> Finding:
    x, y, z = positions[0]
    count = len(positions)
    message = (
        f"{count} viewpoint{'s' if count > 1 else ''} around ({x:.1f}, {y:.1f}, {z:.1f}) cannot be "
        "reached from any take-off point without coming too close to something; add one to "
        "sorties.stations from which they can"
    )
    return Finding("sorties", "separate-space", message, float(count))


def plan_parts(
    flights: tuple[Flight, ...],
    parts: tuple[Part, ...],
    stations: tuple[Station, ...],
    airspace: Space,
    edges: Ints,
    *,
    settings: SortieSettings,
    flight_settings: FlightSettings,
    limits: Limits,
    seed: int,
) -> Sorties:
    """Sorties through all parts, each from the stations that reach it.

    Parameters
    ----------
    flights
        One a part, through its photos.
    parts
        Where each is flown from.
    stations, airspace, settings, flight_settings, seed
        As :func:`~planner.sorties.schedule.plan_sorties` takes them.
    edges
        Pairs of photos that match, shape (E, 2); photos are numbered part after part.
    limits
        Of motion.

    Returns
    -------
    sorties
        ``flight`` is that of the first part; the photos of ``others`` are numbered after its own.

    Raises
    ------
    Unattainable
        If a photo cannot be taken within the limits; the message names what is missing.

    """
    found: list[Sorties] = []
    first = 0
    for flight, part in zip(flights, parts, strict=True):
        count = len(flight.viewpoints)
        own = edges[((edges >= first) & (edges < first + count)).all(axis=1)] - first
        one = plan_sorties(
            flight,
            fly_in_time(flight.path, flight.viewpoints, limits),
            tuple(stations[number] for number in part.stations),
            airspace,
            own,
            settings=settings,
            flight_settings=flight_settings,
            seed=seed,
        )
        found.append(_renumbered(one, part.stations, first))
        first += count
    return (
        found[0] if len(found) == 1 and found[0].stations == stations else _merged(found, stations)
    )


def _renumbered(sorties: Sorties, homes: tuple[int, ...], first: int) -> Sorties:
    """Sorties whose stations and photos are numbered among all."""
    flown = tuple(
        replace(
            sortie,
            number=homes[sortie.number],
            photos=sortie.photos + first,
            shared=sortie.shared + first,
        )
        for sortie in sorties.flown
    )
    return replace(sorties, flown=flown, order=sorties.order + first)


def _merged(found: list[Sorties], stations: tuple[Station, ...]) -> Sorties:
    """All sorties as one schedule; a method that a part did not try takes what its own took."""
    methods = list(dict.fromkeys(method for one in found for method in one.seconds))
    seconds = {
        method: sum(one.seconds.get(method, one.seconds[one.method]) for one in found)
        for method in methods
    }
    used = "routing" if any(one.method == "routing" for one in found) else "split"
    seconds[used] = sum(one.seconds[one.method] for one in found)
    return replace(
        found[0],
        stations=stations,
        flown=tuple(sortie for one in found for sortie in one.flown),
        order=np.concatenate([one.order for one in found]),
        method=used,
        seconds=seconds,
        rounds=sum(one.rounds for one in found),
        proven=all(one.proven for one in found),
        others=tuple(one.flight for one in found[1:]),
    )
