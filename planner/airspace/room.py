"""Whether zones do what they were drawn for, and what is missing where nothing is free."""

from dataclasses import dataclass, replace

import numpy as np

from planner.airspace.airspace import Airspace
from planner.airspace.zones import Ceiling, Prism, signed_distance_to_polygon
from planner.config import FLIGHT_MARGIN
from planner.findings import Finding
from planner.geometry.arrays import Floats

_LOOKS = 30_000  # places of the lattice on which room is sought


@dataclass(frozen=True, slots=True)
class Room:
    """The roomiest place of an airspace.

    Parameters
    ----------
    place
        Local metres.
    spare
        Distance beyond ``d_min`` and zones there, metres; negative is what is missing.
    spare_of_zones, spare_of_solids
        The same of each alone, at the places that are best for each.

    """

    place: tuple[float, float, float]
    spare: float
    spare_of_zones: float
    spare_of_solids: float


def idle_zones(airspace: Airspace) -> tuple[Finding, ...]:
    """Zones, and a ceiling, that meet nothing of the space in which flight is considered.

    Parameters
    ----------
    airspace
        With its zones.

    Returns
    -------
    findings
        One a zone, its number the distance from that space, metres.

    """
    found = []
    for row, prism in enumerate(airspace.zones.prisms):
        away = _distance_to_box(prism, *airspace.bounds)
        if away > (airspace.zones.kept if prism.kind == "keep_out" else 0.0):
            message = (
                f"zone {prism.name or row!r} ({prism.kind}) lies {away:.1f} m away from all places "
                "that could be flown to, so it changes nothing; are its coordinates right?"
                if prism.kind == "keep_out"
                else f"zone {prism.name or row!r} (keep_in) lies {away:.1f} m away from the scene, "
                "so nothing is free; are its coordinates right?"
            )
            found.append(Finding("airspace", "zone-meets-nothing", message, away, partial=False))
    ceiling = airspace.zones.ceiling
    over = 0.0 if ceiling is None else _height_over_box(ceiling, *airspace.bounds)
    if ceiling is not None and over > airspace.zones.kept * ceiling.stretch:
        message = (
            f"airspace.ceiling {ceiling.above_ground:g} m lies {over:.1f} m above all places that "
            "could be flown to, so it changes nothing; it is metres above the ground under the "
            "drone, not above the sea"
        )
        found.append(Finding("airspace", "ceiling-meets-nothing", message, over, partial=False))
    return tuple(found)


def roomiest(airspace: Airspace) -> Room:
    """Look for the place with most room on a lattice over the whole airspace."""
    at, solids = _solids_on_lattice(airspace)
    zones = airspace.zone_margin(at)
    spare = np.minimum(solids, zones)
    best = int(spare.argmax())
    x, y, z = at[best].tolist()
    return Room((x, y, z), float(spare[best]), float(zones.max()), float(solids.max()))


def lack_of_room(airspace: Airspace, *, margin: float = FLIGHT_MARGIN) -> str:
    """Say in a clause what keeps all places from being free, with the number that is missing."""
    for finding in idle_zones(airspace):
        if "nothing is free" in finding.message:
            return finding.message
    room = roomiest(airspace)
    x, y, z = room.place
    where = f"the roomiest place ({x:.1f}, {y:.1f}, {z:.1f})"
    if 0.0 <= room.spare < margin:
        return f"{where} has {room.spare:.2f} m to spare where flight.margin keeps {margin:g} m"
    ceiling, kept = airspace.zones.ceiling, airspace.zones.kept
    if room.spare >= 0.0:
        spare = f"{where} has {room.spare:.2f} m to spare, but"
        if not _has_room_near(airspace, margin):
            return f"{spare} is too far from the scene"
        cure = "lower scale.voxel" + ("" if ceiling is None else " or raise airspace.ceiling")
        return f"{spare} no position of the grid is in such a narrow space; {cure}"
    if ceiling is not None:
        above = ceiling.above_ground
        if above < airspace.d_min:
            what, lack = "is under d_min", airspace.d_min + kept - above
        else:
            what, lack = "forbids all", _lack_of_height(airspace, ceiling, margin)
        if np.isfinite(lack):
            return f"airspace.ceiling {above:.4g} m {what}; {_raise(lack)}"
    lacks = f"{where} lacks {-room.spare:.2f} m between solids and zones"
    return f"{lacks}, from which airspace.zone_margin keeps {kept:g} m" if kept else lacks


def _raise(lack: float) -> str:
    """Cure for a ceiling that lacks so much: a layer thinner than the grid may hold no position."""
    return f"raise it by over {lack:.2f} m, and by scale.voxel more to have room for positions"


def _solids_on_lattice(airspace: Airspace) -> tuple[Floats, Floats]:
    """Places all over an airspace, shape (n, 3), and their room beyond ``d_min``, shape (n,)."""
    low, high = airspace.bounds
    step = float(np.cbrt(np.prod(high - low) / _LOOKS))
    axes = [
        np.arange(a + 0.5 * step, max(b, a + step), step) for a, b in zip(low, high, strict=True)
    ]
    at = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return at, airspace.clearance_range(at)[0] - airspace.d_min


def _has_room_near(airspace: Airspace, margin: float) -> bool:
    """Whether any place with that much to spare is near enough to the scene for photos."""
    at, solids = _solids_on_lattice(airspace)
    near = airspace.obstacle_distance(at) <= airspace.d_max
    return bool((near & (np.minimum(solids, airspace.zone_margin(at)) >= margin)).any())


def _lack_of_height(airspace: Airspace, ceiling: Ceiling, margin: float) -> float:
    """By how much to raise the ceiling until a place is free; infinite if none would be."""
    at, solids = _solids_on_lattice(airspace)
    zones = replace(airspace.zones, ceiling=None)
    free = np.minimum(solids, zones.margin(at)) >= margin
    lack = (margin + zones.kept - ceiling.margin(at[free])) * ceiling.stretch
    return float(lack.min(initial=np.inf))


def _height_over_box(ceiling: Ceiling, low: Floats, high: Floats) -> float:
    """Height of the lowest place of a ceiling over a box, metres above the box's top; exact."""
    lines = [
        np.unique(np.clip(origin + ceiling.cell * np.arange(count), a, b).tolist() + [a, b])
        for origin, count, a, b in zip(
            ceiling.origin, ceiling.corners.shape, low[:2], high[:2], strict=True
        )
    ]  # between them it is bilinear, so lowest at a crossing
    at = np.stack(np.meshgrid(*lines, [high[2]], indexing="ij"), axis=-1).reshape(-1, 3)
    return float(ceiling.height(at).min() - high[2])


def _distance_to_box(prism: Prism, low: Floats, high: Floats) -> float:
    """Distance between a prism and a box, metres; 0 where they meet."""
    over = max(prism.bottom - float(high[2]), float(low[2]) - prism.top, 0.0)
    corners = np.array([[x, y] for x in (low[0], high[0]) for y in (low[1], high[1])])
    beyond = np.maximum(low[:2] - prism.polygon, prism.polygon - high[:2]).clip(0.0)
    beside = min(
        float(np.hypot(*beyond.T).min()),
        float(signed_distance_to_polygon(corners, prism.polygon).clip(0.0).min()),
    )
    if beside > 0.0 and _edge_enters(prism.polygon, low[:2], high[:2]):
        beside = 0.0
    return float(np.hypot(over, beside))


def _edge_enters(polygon: Floats, low: Floats, high: Floats) -> bool:
    """Whether any edge of a polygon meets a rectangle."""
    start, step = polygon, np.roll(polygon, -1, axis=0) - polygon
    flat = step == 0.0
    divisor = np.where(flat, 1.0, step)
    first, second = (low - start) / divisor, (high - start) / divisor
    inside = (start >= low) & (start <= high)
    enter = np.where(flat, np.where(inside, 0.0, 2.0), np.minimum(first, second)).max(axis=1)
    leave = np.where(flat, np.where(inside, 1.0, -1.0), np.maximum(first, second)).min(axis=1)
    return bool((np.maximum(enter, 0.0) <= np.minimum(leave, 1.0)).any())
