"""Places of take-off and landing, and the climb from the ground to where flight begins."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from planner.errors import PlannerError
from planner.findings import Finding
from planner.flight.path import JOINT_DECIMALS
from planner.geometry.arrays import Floats, read_only

RISE = 0.5
"""Distance from solids that a climb must gain, metres a metre of height."""

FREE = 0.25
"""Height up to which nothing is asked of a climb, as a share of ``d_min``: grass and noise."""

FINEST = 1e-3
"""Stretches of a climb smaller than this, metres, are not halved further."""

STRIDE = 0.1
"""Steps in which a height to fly at is looked for, as a share of ``d_min``."""


SPARE = 2.0
"""Margins that an entry keeps, so that what is flown from it keeps one."""


class Place(Protocol):
    """What a station needs to know of an airspace."""

    @property
    def d_min(self) -> float:
        """Wanted distance to solids, metres."""

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner of the space that is considered, each (3,)."""

    def clearance(self, points: Floats) -> Floats:
        """Signed distance to solids, shape (m,), metres."""

    def zone_margin(self, points: Floats) -> Floats:
        """Signed distance to zones beyond what is kept, (m,), metres, infinite without any."""


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """A place of take-off and landing.

    Parameters
    ----------
    pad
        On the ground, shape (3,), metres.
    entry
        Straight above, where flight begins and ends, shape (3,), metres.

    """

    pad: Floats
    entry: Floats

    def __post_init__(self) -> None:
        for name in ("pad", "entry"):
            object.__setattr__(self, name, read_only(getattr(self, name), (3,), name=name))
        if (self.pad[:2] != self.entry[:2]).any() or not self.pad[2] < self.entry[2]:
            raise ValueError(f"the entry {self.entry} must be straight above the pad {self.pad}.")

    @property
    def climb(self) -> float:
        """Height from the pad to the entry, metres."""
        return float(self.entry[2] - self.pad[2])


@dataclass(frozen=True, slots=True)
class Shortfall:
    """Where a climb has too little room: metres above the pad, found and asked for."""

    height: float
    found: float
    needed: float


def shortfall(
    station: Station, distance: Callable[[Floats], Floats], d_min: float
) -> Shortfall | None:
    """Prove that a climb leaves the ground and comes near to nothing else, or say where not.

    At height ``h`` above the pad ``min(d_min, RISE (h - FREE d_min))`` is kept. Near the ground
    that is little, and level ground leaves twice as much room; but a wall beside the pad is
    found. Both change by bounded amounts a metre, so that halving proves all heights.

    Parameters
    ----------
    station
        Pad and entry.
    distance
        Signed distance to solids of points (m, 3), metres.
    d_min
        Distance that is kept in flight, metres.

    """
    middle, half = np.array([0.5 * station.climb]), 0.5 * station.climb
    while len(middle):
        found = distance(station.pad + middle[:, None] * np.array([0.0, 0.0, 1.0]))
        needed = np.minimum(d_min, RISE * (middle - FREE * d_min))
        spare = found - needed
        if (spare < 0.0).any():
            row = int(np.argmin(np.where(spare < 0.0, middle, np.inf)))
            return Shortfall(float(middle[row]), float(found[row]), float(needed[row]))
        if half < FINEST:
            return None
        middle = middle[spare < (1.0 + RISE) * half]
        half *= 0.5
        middle = np.concatenate([middle - half, middle + half])
    return None


def find_stations(
    points: Sequence[Sequence[float]],
    airspace: Place,
    height: Callable[[Floats], Floats],
    *,
    margin: float,
    remedy: str = "move it",
) -> tuple[Station, ...]:
    """Stations at these points, each with the lowest height above it that flight can begin at.

    Parameters
    ----------
    points
        x, y and, where it is not on the ground, z of each pad, metres.
    airspace
        Solids and zones.
    height
        Height of the ground at points (m, 2), metres.
    margin
        What is kept beyond ``d_min``, metres.
    remedy
        What to do about a point that is too close to something.

    Raises
    ------
    PlannerError
        If a point is out of bounds, inside of something solid or a zone, or too close to
        something; the message names the room that is there and what is asked for.

    """
    return tuple(
        _station(number, np.asarray(point, dtype=np.float64), airspace, height, margin, remedy)
        for number, point in enumerate(points)
    )


def pad_of(
    number: int,
    point: Floats,
    bounds: tuple[Floats, Floats],
    height: Callable[[Floats], Floats],
    *,
    d_min: float,
    margin: float,
) -> Floats:
    """Pad of a station, shape (3,), metres, as far as bounds and ground can tell.

    Raises
    ------
    PlannerError
        If it is out of the space in which flight is considered, deep in the ground, or so high
        that no flight can begin above it.

    """
    name, (low, high) = _name(number, point), bounds
    beyond = float(np.maximum(low[:2] - point[:2], point[:2] - high[:2]).max())
    if beyond > 0.0:
        raise PlannerError(
            f"{name}: is {beyond:.1f} m outside of the space in which flight is considered; "
            f"move it or raise airspace.beyond by that much"
        )
    ground = float(height(point[None, :2])[0])
    given = len(point) > 2
    pad = np.round([*point[:2], point[2] if given else ground], JOINT_DECIMALS) + 0.0
    remedy = "leave the height out to stand on the ground" if given else "move it"
    if pad[2] < ground - d_min:
        raise PlannerError(
            f"{name}: its height {pad[2]:g} m is {ground - pad[2]:.1f} m under the ground; {remedy}"
        )
    if pad[2] + d_min + SPARE * margin >= high[2]:
        raise PlannerError(
            f"{name}: is at {pad[2]:.1f} m, where flight is considered up to {high[2]:.1f} m only; "
            f"{remedy}"
        )
    return np.asarray(pad)


def _name(number: int, point: Floats) -> str:
    return f"sorties.stations[{number}] = ({point[0]:g}, {point[1]:g})"


def _station(  # noqa: PLR0917 - one call
    number: int,
    point: Floats,
    airspace: Place,
    height: Callable[[Floats], Floats],
    margin: float,
    remedy: str,
) -> Station:
    d_min, bounds = airspace.d_min, airspace.bounds
    pad = pad_of(number, point, bounds, height, d_min=d_min, margin=margin)
    name, kept = _name(number, point), d_min + SPARE * margin
    heights = np.arange(kept, bounds[1][2] - pad[2], STRIDE * d_min)
    above = np.round(pad + heights[:, None] * np.array([0.0, 0.0, 1.0]), JOINT_DECIMALS)
    room, zones = airspace.clearance(above), airspace.zone_margin(above)
    free = (room >= kept) & (zones >= SPARE * margin)
    if not free.any():
        best, widest = float(room.max()), float(zones.max())
        what = (
            f"solids leave {best:.2f} m of room where d_min {d_min:.2f} m is kept"
            if best < kept
            else f"zones or the ceiling leave {widest:.2f} m beyond airspace.zone_margin, where "
            f"{SPARE * margin:.3f} m are kept"
        )
        raise PlannerError(f"{name}: flight can begin nowhere above it ({what}); {remedy}")
    station = Station(pad, above[int(np.argmax(free))])
    short = shortfall(station, airspace.clearance, d_min)
    if short is not None:
        raise PlannerError(
            f"{name}: is inside of or beside something solid: {short.height:.2f} m above it the "
            f"clearance is {short.found:.2f} m where {short.needed:.2f} m are kept; {remedy}"
        )
    inside = shortfall_of_zones(station, airspace.zone_margin)
    if inside is not None:
        raise PlannerError(
            f"{name}: its climb is {-inside:.2f} m too far into a zone or what "
            "airspace.zone_margin keeps from it; move it or change the zone"
        )
    return station


def outside_scan(
    stations: Sequence[Station], distance: Callable[[Floats], Floats], d_min: float
) -> tuple[Finding, ...]:
    """Stations that nothing was scanned near to: their ground and what stands there are guessed.

    Parameters
    ----------
    stations
        In the order of the settings.
    distance
        Distance from points (m, 3) to the nearest raw point, metres.
    d_min
        Distance up to which a pad counts as scanned, metres.

    Returns
    -------
    findings
        One a station, its number the distance from the nearest raw point, metres.

    """
    if not stations:
        return ()
    pads = np.stack([station.pad for station in stations])
    return tuple(
        Finding(
            "sorties",
            "station-outside-scan",
            f"sorties.stations[{number}] = ({x:g}, {y:g}) is {away:.1f} m from the nearest point "
            f"of the scan: its ground is only assumed, at {z:.1f} m, and what stands there is not "
            "known; see that it is level and clear, or move it to where the scan has points",
            float(away),
            partial=False,
        )
        for number, ((x, y, z), away) in enumerate(zip(pads, distance(pads), strict=True))
        if away > d_min
    )


def shortfall_of_zones(station: Station, margin: Callable[[Floats], Floats]) -> float | None:
    """Smallest zone margin along a climb if it is negative, by halving; else ``None``."""
    middle, half = np.array([0.5 * station.climb]), 0.5 * station.climb
    while len(middle) and half >= FINEST:
        found = margin(station.pad + middle[:, None] * np.array([0.0, 0.0, 1.0]))
        if (found < 0.0).any():
            return float(found.min())
        middle = middle[found < half]
        half *= 0.5
        middle = np.concatenate([middle - half, middle + half])
    return None
