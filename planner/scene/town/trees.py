"""Trees in parks, yards and gardens, along streets and round the rim."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.town.layout import Layout
from planner.scene.town.solids import Footprint, Solid, loft, polygon
from planner.scene.town.terrain import Relief

CLEAR = 0.3  # metres between a crown and a wall
SMALLEST = 0.8  # metres, radius of a crown

Spot = tuple[float, float, float]  # x, y and wished radius, metres


@dataclass(frozen=True, slots=True)
class Tree:
    """Trunk and crown of one tree."""

    trunk: Solid
    crown: Solid


@dataclass(frozen=True, slots=True)
class Yards:
    """Where a tree has room.

    Parameters
    ----------
    rooms
        Rectangles that hold a building each.
    courts
        Open courtyards within some of them.
    decks
        Decks of bridges.
    size
        Lengths of the whole place, centred on the origin, metres.

    """

    rooms: list[Footprint]
    courts: list[Footprint]
    decks: list[Footprint]
    size: tuple[float, float]

    def space(self, xy: Floats) -> Floats:
        """Distance of points (n, 2) to the nearest wall, deck or rim, metres; 0 inside a house."""
        rim = 0.5 * np.array(self.size) - np.abs(xy)
        space = np.minimum(rim.min(axis=1), _gaps(self.rooms, xy))
        for court in self.courts:
            low, high = court.bounds()
            within = np.minimum(xy - low, high - xy).min(axis=1)
            space = np.where(within > 0.0, within, space)
        return np.asarray(np.minimum(space, _gaps(self.decks, xy)))


def _gaps(boxes: list[Footprint], xy: Floats) -> Floats:
    """Distance of each point to the nearest of the boxes' bounds, metres; inf without any."""
    if not boxes:
        return np.full(len(xy), np.inf)
    bounds = np.array([one.bounds() for one in boxes])
    beyond = np.maximum(bounds[:, 0] - xy[:, None], xy[:, None] - bounds[:, 1])
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=2).min(axis=1))


def plant(layout: Layout, yards: Yards, relief: Relief, rng: np.random.Generator) -> list[Tree]:
    """Plant what fits of the wished-for trees, each crown clear of walls and of other crowns."""
    spots = np.array(list(_spots(layout, yards, rng)))
    radii = np.minimum(spots[:, 2], yards.space(spots[:, :2]) - CLEAR)
    placed = np.zeros((0, 3))
    for x, y, radius in np.column_stack([spots[:, :2], radii])[radii >= SMALLEST]:
        apart = np.hypot(placed[:, 0] - x, placed[:, 1] - y)
        if (apart >= 0.85 * (radius + placed[:, 2])).all():
            placed = np.vstack([placed, [x, y, radius]])
    ground = relief.height(placed[:, :2])
    return [_tree((x, y, r), float(z), rng) for (x, y, r), z in zip(placed, ground, strict=True)]


def _spots(layout: Layout, yards: Yards, rng: np.random.Generator) -> Iterator[Spot]:
    """Wished-for places and crown radii."""
    for parcel in layout.parcels:
        if parcel.park:
            rect = parcel.rect
            for _ in range(int(np.clip(rect.area / 20.0, 4, 60))):
                x, y = rng.uniform(rect.x0, rect.x1), rng.uniform(rect.y0, rect.y1)
                yield x, y, rng.uniform(1.5, 3.5)
    for court in yards.courts:
        for _ in range(int(rng.integers(1, 5))):
            u, v = rng.uniform(-0.6, 0.6, 2)
            yield *court.at(u * court.u, v * court.v), rng.uniform(1.2, 2.8)
    yield from _rows(layout, rng)
    half = 0.5 * np.array(yards.size)
    for _ in range(int(4.0 * half.prod() / 90.0)):  # gardens, gaps and the rim
        x, y = rng.uniform(-half, half)
        yield x, y, rng.uniform(1.0, 2.6)


def _rows(layout: Layout, rng: np.random.Generator) -> Iterator[Spot]:
    """Rows along both sides of most streets that are wide enough."""
    for street in layout.streets:
        wide = min(street.width, street.depth)
        if wide < 8.0 or rng.random() < 0.25:
            continue
        along_y = street.depth > street.width
        pace = float(rng.uniform(6.0, 11.0))
        for step in np.arange(0.5 * pace, max(street.width, street.depth), pace):
            for side in (2.0, wide - 2.0):
                if rng.random() < 0.7:
                    dx, dy = (side, step) if along_y else (step, side)
                    yield street.x0 + dx, street.y0 + dy, rng.uniform(1.0, 2.2)


def _tree(spot: Spot, ground: float, rng: np.random.Generator) -> Tree:
    """Tree with a round or, one time in four, a conical crown, 3 to 12 m high."""
    x, y, radius = spot
    trunk_top = ground + float(rng.uniform(1.6, 2.6))
    tall = radius * float(rng.uniform(1.5, 2.2))
    turn = float(rng.uniform(0.0, 1.0))
    thick = 0.1 + 0.07 * radius
    trunk = loft([polygon(x, y, thick, 6, turn)] * 2, [ground - 0.5, trunk_top + 0.3 * tall])
    if rng.random() < 0.25:
        tip = np.array([[x, y, trunk_top + 1.5 * tall]])
        rim = [polygon(x, y, r, 9, turn) for r in (0.5 * radius, 0.85 * radius)]
        return Tree(trunk, loft(rim, [trunk_top - 0.3, trunk_top], apex=tip))
    level = np.array([0.03, 0.2, 0.45, 0.75, 0.96])
    girth = radius * np.sqrt(1.0 - (2.0 * level - 1.0) ** 2) * rng.uniform(0.88, 1.0, 5)
    rims = [polygon(x, y, float(g), 9, turn) for g in girth]
    return Tree(trunk, loft(rims, [float(trunk_top + t * tall) for t in level]))
