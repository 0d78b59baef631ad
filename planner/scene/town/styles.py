"""Buildings of nine styles, each a handful of closed solids on one site."""

from collections.abc import Callable

import numpy as np

from planner.scene.town.building import Building, Site
from planner.scene.town.fittings import balconies, machines, parapet
from planner.scene.town.solids import box, gabled, loft, polygon, ring, slanted

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
    room = site.room.long_side_first()
    deep = min(1.6, max(0.9, 0.24 * room.v))
    walls = room.inset(0.0 if site.attached else deep, deep)
    roof = site.top - 2.4 if site.height > 9.0 else site.top - 0.8
    built = Building(site.room, body=walls, body_top=roof)
    built.add(box(walls, site.bottom, roof))
    parapet(built, walls, roof, min(0.8, site.top - roof))
    if site.height > 9.0:
        u = float(rng.uniform(-0.5, 0.5)) * walls.u
        w = min(2.0, 0.3 * walls.v)
        built.add(box(walls.part((u - w, u + w), (-w, w)), roof - 0.2, site.top))
    machines(built, walls, roof, min(1.2, site.top - roof), rng)
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
            parapet(built, tier, lid, 0.6)
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
    parapet(built, room, podium - 0.5, 0.5)
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
        parapet(built, site.room, built.body_top, 0.8)
    return built


def cantilever(site: Site, rng: np.random.Generator) -> Building:
    """Upper storeys that stand out over a smaller ground floor on two sides or four."""
    out = min(float(rng.uniform(1.5, 3.0)), 0.35 * min(site.room.u, site.room.v))
    foot = site.room.inset(out, out if rng.random() < 0.5 else 0.0)
    split = site.ground + min(float(rng.uniform(3.0, 5.0)), 0.5 * site.height)
    built = Building(site.room)
    built.add(box(foot, site.bottom, split + 0.3))
    built.add(box(site.room, split, site.top - 0.6))
    parapet(built, site.room, site.top - 0.6, 0.6)
    machines(built, site.room, site.top - 0.6, 0.6, rng)
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
