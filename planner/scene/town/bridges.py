"""A bridge over a street, from wall to wall or on piers."""

from dataclasses import dataclass

import numpy as np

from planner.scene.town.buildings import Building
from planner.scene.town.layout import Layout, Rect
from planner.scene.town.relief import Relief
from planner.scene.town.solids import Footprint, Solid, box


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
    if a.body is None or b.body is None or a is b or a.body.slanting or b.body.slanting:
        return None
    along_y = street.depth > street.width  # the street runs along y, the bridge along x
    p, q = a.body.bounds(), b.body.bounds()
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
