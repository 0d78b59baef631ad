"""A bridge over a street, from wall to wall or on piers."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.town.building import Building
from planner.scene.town.layout import Layout, Rect
from planner.scene.town.solids import Footprint, Solid, box
from planner.scene.town.terrain import Relief

LOWEST_WALL = 8.0  # metres a wall must reach to carry a bridge


@dataclass(frozen=True, slots=True)
class Bridge:
    """Solids of a bridge and the rectangle of its deck, long side first."""

    parts: tuple[Solid, ...]
    deck: Footprint


class _Wall(NamedTuple):
    """Bounds of a plain body, shape (2, 2), and the height that its walls reach, metres."""

    bounds: Floats
    top: float


def skybridge(
    layout: Layout, buildings: list[Building], relief: Relief, rng: np.random.Generator
) -> Bridge | None:
    """Deck between two walls that face each other over a street, if any pair allows one.

    Both walls must reach 8 m or more and overlap on 4 m or more; 4.5 m stay free under the deck.
    """
    walls = [
        _Wall(one.body.bounds(), one.body_top)
        for one in buildings
        if one.body is not None and not one.body.slanting and one.body_top >= LOWEST_WALL
    ]
    widest = float(rng.uniform(1.5, 3.5))
    spots = [spot for street in layout.streets for spot in _spots(street, walls, widest)]
    if not spots:
        return None
    deck, roof = spots[int(rng.integers(len(spots)))]
    ground = float(relief.height(np.array([deck.at(u * deck.u, 0.0) for u in (-1, 0, 1)])).max())
    if roof < ground + 8.0:
        return None
    floor = ground + float(rng.uniform(4.5, min(roof - ground - 2.5, 14.0)))
    return Bridge(tuple(_deck(deck, floor)), deck)


def _spots(street: Rect, walls: list[_Wall], widest: float) -> Iterator[tuple[Footprint, float]]:
    """Decks from a wall on one side of a street to one on the other, and the lower wall's top."""
    along_y = street.depth > street.width  # the street runs along y, the bridge along x
    turned = [
        wall if along_y else _Wall(wall.bounds[:, ::-1], wall.top) for wall in walls
    ]  # from here on the bridge runs along the first axis
    near, far = (street.x0, street.x1) if along_y else (street.y0, street.y1)
    before = [wall for wall in turned if near - 2.5 <= wall.bounds[1, 0] <= near + 0.1]
    after = [wall for wall in turned if far - 0.1 <= wall.bounds[0, 0] <= far + 2.5]
    for p, q in product(before, after):
        low, high = max(p.bounds[0, 1], q.bounds[0, 1]), min(p.bounds[1, 1], q.bounds[1, 1])
        if high - low < 4.0:
            continue
        start, end = float(p.bounds[1, 0]), float(q.bounds[0, 0])
        x, y = 0.5 * (start + end), 0.5 * float(low + high)
        half, wide = 0.5 * (end - start) + 0.3, min(0.5 * float(high - low) - 0.5, widest)
        deck = Footprint(x, y, half, wide) if along_y else Footprint(y, x, half, wide, np.pi / 2)
        yield deck, min(p.top, q.top)


def _deck(deck: Footprint, floor: float) -> list[Solid]:
    """Slab of 0.5 m with a railing on both sides."""
    rails = [
        box(deck.part((-deck.u, deck.u), (v - 0.1, v + 0.1)), floor + 0.4, floor + 1.6)
        for v in (-deck.v + 0.1, deck.v - 0.1)
    ]
    return [box(deck, floor, floor + 0.5), *rails]


def footbridge(street: Rect, relief: Relief, rng: np.random.Generator) -> Bridge:
    """Deck of 2.6 to 6 m width on two piers across a street, 4.5 to 6 m above it."""
    along_y = street.depth > street.width
    long, wide = max(street.depth, street.width), min(street.depth, street.width)
    shift = float(rng.uniform(-0.3, 0.3)) * long
    x, y = 0.5 * (street.x0 + street.x1), 0.5 * (street.y0 + street.y1)
    half = float(rng.uniform(1.3, 3.0))
    deck = (
        Footprint(x, y + shift, 0.5 * wide - 0.3, half)
        if along_y
        else Footprint(x + shift, y, 0.5 * wide - 0.3, half, 0.5 * np.pi)
    )
    ground = relief.height(np.array([deck.at(u * deck.u, 0.0) for u in (-1, 0, 1)]))
    floor = float(ground.max() + rng.uniform(4.5, 6.0))
    piers = [
        box(
            deck.part((u, u + 1.0), (-0.8 * half, 0.8 * half)),
            float(ground.min()) - 1.0,
            floor + 0.2,
        )
        for u in (-deck.u, deck.u - 1.0)
    ]
    return Bridge((*_deck(deck, floor), *piers), deck)
