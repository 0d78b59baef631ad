"""What stands between the buildings: a bridge over a street, and trees."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.town.buildings import Building
from planner.scene.town.layout import Layout, Rect
from planner.scene.town.relief import Relief
from planner.scene.town.solids import Footprint, Solid, box, loft, polygon


@dataclass(frozen=True, slots=True)
class Bridge:
    """Solids of a bridge and the rectangle of its deck, long side first."""

    parts: tuple[Solid, ...]
    deck: Footprint


def skybridge(
    layout: Layout, buildings: list[Building], relief: Relief, rng: np.random.Generator
) -> Bridge | None:
    """Deck between two walls that face each other over a street, if any pair allows one.

    Both walls must reach 8 m or more and overlap on 4 m or more; 4.5 m stay free under the deck.
    """
    spots = []
    for street in layout.streets:
        for a in buildings:
            for b in buildings:
                spot = _between(street, a, b)
                if spot is not None:
                    spots.append(spot)
    if not spots:
        return None
    deck, roof = spots[int(rng.integers(len(spots)))]
    ground = float(relief.height(np.array([deck.at(u * deck.u, 0.0) for u in (-1, 0, 1)])).max())
    if roof < ground + 8.0:
        return None
    floor = ground + float(rng.uniform(4.5, min(roof - ground - 2.5, 14.0)))
    return Bridge(tuple(_deck(deck, floor)), deck)


def _between(street: Rect, a: Building, b: Building) -> tuple[Footprint, float] | None:
    """Deck from the wall of ``a`` up the axis to that of ``b``, and the lower of their tops."""
    if a.body is None or b.body is None or a is b:
        return None
    along_y = street.depth > street.width  # the street runs along y, the bridge along x
    p, q = _bounds(a.body), _bounds(b.body)
    if not along_y:
        p, q = p[:, ::-1], q[:, ::-1]
    near, far = (street.x0, street.x1) if along_y else (street.y0, street.y1)
    if not (near - 2.5 <= p[1, 0] <= near + 0.1 and far - 0.1 <= q[0, 0] <= far + 2.5):
        return None
    low, high = max(p[0, 1], q[0, 1]), min(p[1, 1], q[1, 1])
    if high - low < 4.0 or min(a.body_top, b.body_top) < 8.0:
        return None
    x, y = 0.5 * (p[1, 0] + q[0, 0]), 0.5 * (low + high)
    half = 0.5 * (q[0, 0] - p[1, 0]) + 0.3
    wide = min(0.5 * (high - low) - 0.5, 1.8)
    deck = Footprint(x, y, half, wide) if along_y else Footprint(y, x, half, wide, 0.5 * np.pi)
    return deck, min(a.body_top, b.body_top)


def _bounds(body: Footprint) -> Floats:
    corners = body.corners()
    return np.array([corners.min(axis=0), corners.max(axis=0)])


def _deck(deck: Footprint, floor: float) -> list[Solid]:
    """Slab of 0.5 m with a railing on both sides."""
    rails = [
        box(deck.part((-deck.u, deck.u), (v - 0.1, v + 0.1)), floor + 0.4, floor + 1.6)
        for v in (-deck.v + 0.1, deck.v - 0.1)
    ]
    return [box(deck, floor, floor + 0.5), *rails]


def footbridge(street: Rect, relief: Relief, rng: np.random.Generator) -> Bridge:
    """Deck on two piers across a street, 4.5 to 6 m above it."""
    along_y = street.depth > street.width
    long, wide = max(street.depth, street.width), min(street.depth, street.width)
    shift = float(rng.uniform(-0.3, 0.3)) * long
    x, y = 0.5 * (street.x0 + street.x1), 0.5 * (street.y0 + street.y1)
    deck = (
        Footprint(x, y + shift, 0.5 * wide - 0.3, 1.4)
        if along_y
        else Footprint(x + shift, y, 0.5 * wide - 0.3, 1.4, 0.5 * np.pi)
    )
    ground = relief.height(np.array([deck.at(u * deck.u, 0.0) for u in (-1, 0, 1)]))
    floor = float(ground.max() + rng.uniform(4.5, 6.0))
    piers = [
        box(deck.part((u, u + 1.0), (-1.0, 1.0)), float(ground.min()) - 1.0, floor + 0.2)
        for u in (-deck.u, deck.u - 1.0)
    ]
    return Bridge((*_deck(deck, floor), *piers), deck)


@dataclass(frozen=True, slots=True)
class Tree:
    """Trunk and crown of one tree."""

    trunk: Solid
    crown: Solid


def plant(
    layout: Layout,
    *,
    courts: list[Footprint],
    deck: Footprint | None,
    relief: Relief,
    size: tuple[float, float],
    rng: np.random.Generator,
) -> list[Tree]:
    """Plant parks densely, yards with one to three trees and street sides in rows.

    No crown comes nearer than 0.3 m to a built parcel or a bridge, and crowns hardly touch.
    """
    spots = _spots(layout, courts, size, rng)
    built = [p.rect for p in layout.parcels if not p.park]
    court_rects = [Rect(*_bounds(court).ravel()) for court in courts]
    placed: list[tuple[float, float, float]] = []
    for x, y, radius in spots:
        if deck is not None and _bridge_gap(deck, x, y) < radius + 0.3:
            continue
        room = _room(x, y, built, court_rects, size)
        radius = min(radius, room - 0.3)
        if radius < 0.8:
            continue
        if any(np.hypot(x - a, y - b) < 0.85 * (radius + r) for a, b, r in placed):
            continue
        placed.append((x, y, radius))
    if not placed:
        return []
    ground = relief.height(np.array(placed)[:, :2])
    return [_tree(*spot, float(z), rng) for spot, z in zip(placed, ground, strict=True)]


def _room(
    x: float, y: float, built: list[Rect], courts: list[Rect], size: tuple[float, float]
) -> float:
    """Distance to the nearest wall or the rim of the place, metres; below zero inside a house."""
    rim = min(0.5 * size[0] - abs(x), 0.5 * size[1] - abs(y))
    for court in courts:
        if court.gap(x, y) == 0.0:
            return min(x - court.x0, court.x1 - x, y - court.y0, court.y1 - y)
    return min([rim, *(rect.gap(x, y) for rect in built)])


def _bridge_gap(deck: Footprint, x: float, y: float) -> float:
    low, high = _bounds(deck)
    return Rect(*low, *high).gap(x, y)


def _spots(
    layout: Layout, courts: list[Footprint], size: tuple[float, float], rng: np.random.Generator
) -> list[tuple[float, float, float]]:
    """Wished-for places and crown radii, metres."""
    spots: list[tuple[float, float, float]] = []

    def wish(x: float, y: float, low: float, high: float) -> None:
        spots.append((x, y, float(rng.uniform(low, high))))

    for parcel in layout.parcels:
        if parcel.park:
            rect = parcel.rect
            for _ in range(int(np.clip(rect.area / 25.0, 3, 40))):
                wish(rng.uniform(rect.x0, rect.x1), rng.uniform(rect.y0, rect.y1), 1.5, 3.5)
    for court in courts:
        for _ in range(int(rng.integers(1, 4))):
            u, v = rng.uniform(-0.6, 0.6, 2)
            wish(*court.at(u * court.u, v * court.v), 1.2, 2.6)
    for street in layout.streets:
        if min(street.width, street.depth) < 8.0 or rng.random() < 0.25:
            continue
        along_y = street.depth > street.width
        length, pace = max(street.width, street.depth), float(rng.uniform(6.0, 11.0))
        for step in np.arange(0.5 * pace, length, pace):
            for side in (2.0, min(street.width, street.depth) - 2.0):
                if rng.random() < 0.7:
                    at = (side, step) if along_y else (step, side)
                    wish(street.x0 + at[0], street.y0 + at[1], 1.0, 2.2)
    for _ in range(int(0.05 * (size[0] + size[1])) + 4):  # along the rim
        edge, t = int(rng.integers(4)), float(rng.uniform(-0.45, 0.45))
        inward = 2.2 / size[edge % 2]
        spot = [t, 0.5 - inward if edge < 2 else inward - 0.5]
        x, y = spot if edge % 2 else spot[::-1]
        wish(x * size[0], y * size[1], 1.2, 2.4)
    return spots


def _tree(x: float, y: float, radius: float, ground: float, rng: np.random.Generator) -> Tree:
    """Tree with a round or, one time in four, a conical crown, 3 to 12 m high."""
    trunk_top = ground + float(rng.uniform(1.6, 2.6))
    tall = radius * float(rng.uniform(1.6, 2.6))
    turn = float(rng.uniform(0.0, 1.0))
    thick = 0.1 + 0.07 * radius
    trunk = loft([polygon(x, y, thick, 6, turn)] * 2, [ground - 0.5, trunk_top + 0.3 * tall])
    if rng.random() < 0.25:
        tip = np.array([[x, y, trunk_top + 1.5 * tall]])
        rim = [polygon(x, y, r, 9, turn) for r in (0.5 * radius, 0.85 * radius)]
        return Tree(trunk, loft(rim, [trunk_top - 0.3, trunk_top], apex=tip))
    level = np.array([0.03, 0.25, 0.5, 0.75, 0.97])
    girth = radius * np.sqrt(1.0 - (2.0 * level - 1.0) ** 2)
    rims = [polygon(x, y, float(g), 9, turn) for g in girth * rng.uniform(0.88, 1.0, 5)]
    return Tree(trunk, loft(rims, [float(trunk_top + t * tall) for t in level]))
