"""Put ground, buildings, bridge and trees together into one labelled mesh."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bytes, Ints
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground
from planner.scene.town.bridges import Bridge, footbridge, skybridge
from planner.scene.town.building import Building, Kind
from planner.scene.town.layout import lay_out
from planner.scene.town.plots import build_all
from planner.scene.town.solids import Footprint, Solid
from planner.scene.town.terrain import height_grid, random_relief, rotation, sheet
from planner.scene.town.trees import Yards, plant


@dataclass(frozen=True, slots=True, eq=False)
class Town:
    """A labelled mesh of a made-up place.

    Parameters
    ----------
    mesh
        Ground sheet and closed solids.
    kinds
        What each triangle is, shape (T,), codes of :class:`Kind`.
    parts
        Closed solid that each triangle belongs to, shape (T,); 0 is the ground, an open sheet.
    buildings
        Building that each triangle belongs to, shape (T,); -1 where none.
    ground
        Height of the terrain, metres.
    turn
        Angle of the streets' first axis from +x, counter-clockwise, radians.

    """

    mesh: Mesh
    kinds: Bytes
    parts: Ints
    buildings: Ints
    ground: Ground
    turn: float


def build_town(
    rng: np.random.Generator,
    *,
    size: tuple[float, float],
    buildings: int,
    heights: tuple[float, float],
    relief: float,
    turn: float,
    bridge: bool,
    trees: bool,
) -> Town:
    """Build a place; the arguments are those of ``synthetic_block``, none left open."""
    terrain = random_relief(relief, rng)
    layout = lay_out(size, buildings, rng)
    parcels = [parcel for parcel in layout.parcels if not parcel.park]
    built = build_all(parcels, terrain, heights, rng)
    span: Bridge | None = None
    if bridge and layout.streets:
        span = skybridge(layout, built, terrain, rng) if rng.random() < 0.6 else None
        span = span or footbridge(layout.streets[0], terrain, rng)
    courts = [one.court for one in built if one.court is not None]
    deck = None if span is None else span.deck
    if deck is not None:
        _clear_balconies(built, deck)
    grown = []
    if trees:
        rooms = [one.room for one in built]
        yards = Yards(rooms, courts, [] if deck is None else [deck], size)
        grown = plant(layout, yards, terrain, rng)

    marks = [(np.array([[s.x0, s.y0], [s.x1, s.y1]]), Kind.STREET) for s in layout.streets]
    marks += [(court.bounds(), Kind.COURTYARD) for court in courts]
    marks += [(span.deck.bounds(), Kind.UNDER_BRIDGE)] if span else []
    solids: list[tuple[Solid, Kind, int]] = []
    for number, one in enumerate(built):
        solids += [(solid, kind, number) for solid, kind in one.parts]
    solids += [(solid, Kind.BRIDGE, -1) for solid in (span.parts if span else ())]
    for tree in grown:
        solids += [(tree.trunk, Kind.TRUNK, -1), (tree.crown, Kind.CROWN, -1)]
    floor, floor_kinds = sheet(size, terrain, marks)
    return _assemble(floor, floor_kinds, solids, height_grid(size, terrain, turn), turn)


def _clear_balconies(built: list[Building], deck: Footprint) -> None:
    """Take away the balconies above and below a bridge."""
    low, high = deck.bounds()
    for one in built:
        one.parts = [
            (solid, kind)
            for solid, kind in one.parts
            if kind is not Kind.BALCONY
            or (solid.vertices[:, :2].max(axis=0) < low).any()
            or (solid.vertices[:, :2].min(axis=0) > high).any()
        ]


def _assemble(
    floor: Solid,
    floor_kinds: Bytes,
    solids: list[tuple[Solid, Kind, int]],
    ground: Ground,
    turn: float,
) -> Town:
    """Stack all triangles, turn them, and label them."""
    everything = [floor, *(solid for solid, _, _ in solids)]
    counts = [len(solid.triangles) for solid in everything]
    first = np.cumsum([0, *(len(solid.vertices) for solid in everything)])
    vertices = np.concatenate([solid.vertices for solid in everything])
    vertices[:, :2] = vertices[:, :2] @ rotation(turn).T
    triangles = np.concatenate(
        [solid.triangles + start for solid, start in zip(everything, first, strict=False)]
    )
    kinds = np.repeat(np.array([kind for _, kind, _ in solids], dtype=np.uint8), counts[1:])
    numbers = np.array([-1, *(number for _, _, number in solids)], dtype=np.int64)
    return Town(
        Mesh(vertices, triangles),
        np.concatenate([floor_kinds, kinds]),
        np.repeat(np.arange(len(everything)), counts),
        np.repeat(numbers, counts),
        ground,
        turn,
    )
