"""Buildings of nine styles, each a handful of closed solids on one parcel."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from planner.scene.town.solids import (
    Footprint,
    Solid,
    box,
    gabled,
    loft,
    polygon,
    ring,
    slanted,
)

STOREY = 3.0  # metres


class Kind(IntEnum):
    """What a triangle of the town belongs to."""

    GROUND = 0
    STREET = 1
    COURTYARD = 2
    UNDER_BRIDGE = 3
    BUILDING = 4
    BALCONY = 5
    BRIDGE = 6
    TRUNK = 7
    CROWN = 8


@dataclass(frozen=True, slots=True)
class Site:
    """Where and how high to build.

    Parameters
    ----------
    room
        Rectangle that no part of the building may leave.
    bottom
        Height of the foundations, below the ground all around, metres.
    ground
        Height that the building's own height counts from, metres.
    height
        Height of the highest part above ``ground``, metres.
    attached
        Whether a party wall is shared, so that walls stand on the parcel's rim.

    """

    room: Footprint
    bottom: float
    ground: float
    height: float
    attached: bool = False

    @property
    def top(self) -> float:
        """Height of the highest part, metres."""
        return self.ground + self.height


@dataclass(slots=True)
class Building:
    """Solids of one building, and what a bridge or a tree has to know of it.

    Parameters
    ----------
    room
        Rectangle that no part leaves.
    parts
        Closed solids and their kinds.
    body
        Plain walls that reach from the ground to ``body_top``, metres, if it has such.
    court
        Open courtyard inside, if it has one.

    """

    room: Footprint
    parts: list[tuple[Solid, Kind]] = field(default_factory=list)
    body: Footprint | None = None
    body_top: float = 0.0
    court: Footprint | None = None

    def add(self, *solids: Solid, kind: Kind = Kind.BUILDING) -> None:
        """Add solids of one kind."""
        self.parts += [(solid, kind) for solid in solids]


Style = Callable[[Site, np.random.Generator], Building]


def house(site: Site, rng: np.random.Generator) -> Building:
    """Gabled or hipped house with overhanging eaves, a chimney and now and then an annexe."""
    eave = 0.0 if site.attached else float(rng.uniform(0.3, 0.7))
    room = site.room.long_side_first()
    walls = room.inset(eave)
    slope = float(rng.uniform(0.5, 1.0))
    rise = min(slope * room.v, 0.55 * site.height)
    eaves, hip = site.top - rise, float(rng.choice([0.0, 0.0, 0.4, 0.9])) * room.v
    built = Building(site.room, body=walls, body_top=eaves)
    if eave:
        built.add(box(walls, site.bottom, eaves + 0.4 * eave * rise / room.v))
        built.add(gabled(room, eaves, eaves, site.top, hip=hip))
    else:
        built.add(gabled(room, site.bottom, eaves, site.top, hip=hip))
    if rng.random() < 0.7:  # the chimney's top stays under the ridge, so that the height holds
        u, v = float(rng.uniform(-0.4, 0.4)) * walls.u, 0.35 * room.v
        built.add(box(room.part((u - 0.4, u + 0.4), (v - 0.4, v + 0.4)), eaves, site.top - 0.05))
    if not site.attached and rng.random() < 0.4:
        balconies(built, site, walls, eaves, rng, share=0.6)
    return built


def terrace(site: Site, rng: np.random.Generator) -> Building:
    """Town house with a mono-pitch roof between its neighbours."""
    room = site.room
    low = site.top - min(0.3 * site.height, float(rng.uniform(0.5, 3.0)))
    built = Building(site.room, body=room, body_top=low)
    built.add(slanted(room, site.bottom, low, site.top))
    return built


def flats(site: Site, rng: np.random.Generator) -> Building:
    """Flat-roofed block with a parapet, a stair head and balconies on every floor."""
    deep = min(1.6, 0.12 * min(site.room.u, site.room.v) * 2.0)
    walls = site.room.inset(0.0 if site.attached else deep).long_side_first()
    roof = site.top - 2.4 if site.height > 9.0 else site.top - 0.8
    built = Building(site.room, body=walls, body_top=roof)
    built.add(box(walls, site.bottom, roof))
    _parapet(built, walls, roof, min(0.8, site.top - roof))
    if site.height > 9.0:
        u = float(rng.uniform(-0.5, 0.5)) * walls.u
        w = min(2.0, 0.3 * walls.v)
        built.add(box(walls.part((u - w, u + w), (-w, w)), roof - 0.2, site.top))
    _machines(built, walls, roof, min(1.2, site.top - roof), rng)
    if not site.attached and deep > 0.9:
        balconies(built, site, walls, roof, rng, share=0.8)
    return built


def setback(site: Site, rng: np.random.Generator) -> Building:
    """Two to four tiers, each smaller than the one below."""
    tiers = int(rng.integers(2, 5)) if site.height > 12.0 else 2
    cuts = np.sort(rng.uniform(0.3, 0.9, tiers - 1))
    tops = site.ground + site.height * np.append(np.maximum.accumulate(cuts), 1.0)
    step = min(0.8 * min(site.room.u, site.room.v) / tiers, float(rng.uniform(1.5, 4.0)))
    built = Building(site.room, body=site.room, body_top=float(tops[0]))
    tier, floor = site.room, site.bottom
    for level, top in enumerate(tops):
        lid = float(top) if level == tiers - 1 else float(top) - 0.6
        built.add(box(tier, floor, lid))
        if level < tiers - 1:
            _parapet(built, tier, lid, 0.6)
        floor, tier = lid - 0.3, tier.inset(step, step * float(rng.uniform(0.4, 1.0)))
    return built


def tower(site: Site, rng: np.random.Generator) -> Building:
    """Square, octagonal or round shaft on a podium, with a flat or a pointed top."""
    room = site.room
    radius = min(room.u, room.v) * float(rng.uniform(0.62, 0.95))
    radius = min(radius, 11.0)
    corners = int(rng.choice([4, 4, 8, 20]))
    turn = float(rng.uniform(0.0, np.pi / 2)) if corners == 4 else 0.0
    podium = site.ground + min(float(rng.uniform(4.0, 8.0)), 0.4 * site.height)
    point = float(rng.uniform(0.5, 1.2)) * radius if rng.random() < 0.4 else 0.0
    shaft = site.top - min(point, 0.3 * site.height)
    outline = polygon(room.x, room.y, radius, corners, turn)
    built = Building(site.room, body=room, body_top=podium)
    built.add(box(room, site.bottom, podium - 0.5))
    _parapet(built, room, podium - 0.5, 0.5)
    if point:
        built.add(
            loft([outline] * 2, [podium - 1.0, shaft], apex=np.array([[room.x, room.y, site.top]]))
        )
        return built
    built.add(loft([outline] * 2, [podium - 1.0, site.top - 1.0]))
    rim = polygon(room.x, room.y, radius - 0.4, corners, turn)
    built.add(ring(outline, rim, site.top - 1.2, site.top))
    hut = polygon(room.x, room.y, 0.4 * radius, corners, turn)
    built.add(loft([hut] * 2, [site.top - 1.2, site.top - 0.1]))
    return built


def courtyard(site: Site, rng: np.random.Generator) -> Building:
    """Four wings round an open yard, under a flat or a pitched roof."""
    wing = min(float(rng.uniform(5.0, 8.0)), 0.56 * min(site.room.u, site.room.v))
    court = site.room.inset(wing)
    outer, inner = site.room.corners(), court.corners()
    built = Building(site.room, body=site.room, court=court)
    if rng.random() < 0.6:
        built.body_top = site.top - min(float(rng.uniform(0.35, 0.8)) * wing, 0.4 * site.height)
        built.add(ring(outer, inner, site.bottom, built.body_top, ridge=site.top))
    else:
        built.body_top = site.top - 0.8
        built.add(ring(outer, inner, site.bottom, built.body_top))
        _parapet(built, site.room, built.body_top, 0.8)
    return built


def cantilever(site: Site, rng: np.random.Generator) -> Building:
    """Upper storeys that stand out over a smaller ground floor on two sides or four."""
    out = min(float(rng.uniform(1.5, 3.0)), 0.35 * min(site.room.u, site.room.v))
    foot = site.room.inset(out, out if rng.random() < 0.5 else 0.0)
    split = site.ground + min(float(rng.uniform(3.0, 5.0)), 0.5 * site.height)
    built = Building(site.room)
    built.add(box(foot, site.bottom, split + 0.3))
    built.add(box(site.room, split, site.top - 0.6))
    _parapet(built, site.room, site.top - 0.6, 0.6)
    _machines(built, site.room, site.top - 0.6, 0.6, rng)
    return built


def wings(site: Site, rng: np.random.Generator) -> Building:
    """L-shaped house: two gabled wings at a right angle."""
    room = site.room.long_side_first()
    wide = 2.0 * room.v * float(rng.uniform(0.45, 0.6))
    rise = min(float(rng.uniform(0.3, 0.5)) * wide, 0.5 * site.height)
    eaves = site.top - rise
    main = room.part((-room.u, room.u), (room.v - wide, room.v))
    side = float(rng.choice([-1.0, 1.0]))
    ends = sorted((side * room.u, side * (room.u - wide)))
    wing = room.part((ends[0], ends[1]), (-room.v, room.v - 0.3 * wide)).long_side_first()
    built = Building(site.room)
    built.add(gabled(main, site.bottom, eaves, site.top))
    drop = min(1.0, 0.2 * rise)
    built.add(gabled(wing, site.bottom, eaves - drop, site.top - drop))
    return built


def church(site: Site, rng: np.random.Generator) -> Building:
    """Nave with a steep roof and a tower with a spire at one end."""
    room = site.room.long_side_first()
    side = min(0.7 * room.v, 0.3 * room.u)
    nave_top = site.ground + 0.55 * site.height
    eaves = nave_top - min(0.9 * room.v, 0.3 * site.height)
    nave = room.part((-room.u + 2.0 * side - 0.3, room.u), (-room.v, room.v))
    base = room.part((-room.u, -room.u + 2.0 * side), (-side, side))
    shaft = site.ground + float(rng.uniform(0.6, 0.75)) * site.height
    built = Building(site.room)
    built.add(gabled(nave, site.bottom, eaves, nave_top))
    built.add(box(base.inset(0.15), site.bottom, shaft + 0.1))
    tip = np.array([[base.x, base.y, site.top]])
    built.add(loft([base.corners()], [shaft], apex=tip))
    return built


def balconies(
    built: Building,
    site: Site,
    walls: Footprint,
    roof: float,
    rng: np.random.Generator,
    *,
    share: float,
) -> None:
    """Hang rows of balconies on one long side or on both, within the parcel.

    Parameters
    ----------
    built
        Building that gets them.
    site
        Its site; the balconies end at the rim of its room.
    walls
        Footprint of the walls, first axis along the long side.
    roof
        Height below which they hang, metres.
    rng
        Source of chance.
    share
        Chance of each single balcony.

    """
    room = site.room.long_side_first()
    deep = min(room.v - walls.v, 1.6)
    columns = int((2.0 * walls.u - 1.0) // 4.0)
    floors = int((roof - site.ground - 1.3) // STOREY)
    if deep < 0.3 or columns < 1 or floors < 1:
        return
    for side in (-1.0, 1.0) if rng.random() < 0.5 else (1.0,):
        there = rng.random((floors, columns)) < share
        there[0, 0] = True
        v = sorted((side * (walls.v - 0.1), side * (walls.v + deep)))
        for floor, column in np.argwhere(there):
            u = (column - 0.5 * (columns - 1)) * 4.0
            z = site.ground + STOREY * (floor + 1.0) - 0.2
            slab = walls.part((u - 1.3, u + 1.3), (v[0], v[1]))
            built.add(box(slab, z, z + 1.2), kind=Kind.BALCONY)


def _parapet(built: Building, walls: Footprint, roof: float, height: float) -> None:
    thick = min(0.35, 0.2 * min(walls.u, walls.v))
    built.add(ring(walls.corners(), walls.inset(thick).corners(), roof - 0.15, roof + height))


def _machines(
    built: Building, walls: Footprint, roof: float, height: float, rng: np.random.Generator
) -> None:
    """Put up to four ventilation boxes on a roof."""
    if min(walls.u, walls.v) < 3.0:
        return
    for _ in range(int(rng.integers(0, 5))):
        u = float(rng.uniform(-0.75, 0.75)) * walls.u
        v = float(rng.uniform(-0.7, 0.7)) * walls.v
        w = float(rng.uniform(0.4, 0.8))
        built.add(box(walls.part((u - w, u + w), (v - w, v + w)), roof - 0.1, roof + height))
