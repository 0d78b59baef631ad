"""Put ground, buildings, bridge and trees together into one labelled mesh."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bytes, Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground
from planner.scene.town import buildings as styles
from planner.scene.town.buildings import Building, Kind, Site, Style
from planner.scene.town.layout import Layout, Parcel, Rect, lay_out
from planner.scene.town.relief import Relief, random_relief
from planner.scene.town.solids import Footprint, Solid
from planner.scene.town.street import Bridge, footbridge, plant, skybridge

GROUND_CELL = 2.5  # metres
FOUNDATION = 1.0  # metres below the lowest ground at a wall


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
    built = _build(parcels, terrain, heights, rng)
    span: Bridge | None = None
    if bridge and layout.streets:
        span = skybridge(layout, built, terrain, rng) if rng.random() < 0.6 else None
        span = span or footbridge(layout.streets[0], terrain, rng)
    courts = [one.court for one in built if one.court is not None]
    deck = None if span is None else span.deck
    grown = []
    if trees:
        grown = plant(layout, courts=courts, deck=deck, relief=terrain, size=size, rng=rng)

    sheet, sheet_kinds = _ground(size, terrain, layout, courts, deck)
    solids: list[tuple[Solid, Kind, int]] = []
    for number, one in enumerate(built):
        solids += [(solid, kind, number) for solid, kind in one.parts]
    solids += [(solid, Kind.BRIDGE, -1) for solid in (span.parts if span else ())]
    for tree in grown:
        solids += [(tree.trunk, Kind.TRUNK, -1), (tree.crown, Kind.CROWN, -1)]
    return _assemble(sheet, sheet_kinds, solids, _terrain(size, terrain, turn), turn)


def _build(
    parcels: list[Parcel],
    terrain: Relief,
    heights: tuple[float, float],
    rng: np.random.Generator,
) -> list[Building]:
    """Choose a style and a height for each parcel, the wanted styles first, and build."""
    urban = float(rng.uniform(0.0, 1.0))
    chosen = _choose(parcels, urban, rng)
    built = []
    for parcel, style in zip(parcels, chosen, strict=True):
        rect = parcel.rect
        room = Footprint(
            0.5 * (rect.x0 + rect.x1), 0.5 * (rect.y0 + rect.y1), 0.5 * rect.width, 0.5 * rect.depth
        )
        if parcel.attached:
            room = room.inset(-0.02)
        elif style in (styles.house, styles.wings, styles.church, styles.setback):
            room = room.inset(min(float(rng.uniform(0.0, 2.5)), 0.15 * rect.short))
        ground = terrain.height(np.vstack([room.corners(), [[room.x, room.y]]]))
        height = _height(style, rect, urban, heights, rng)
        site = Site(
            room, float(ground.min()) - FOUNDATION, float(ground.mean()), height, parcel.attached
        )
        built.append(style(site, rng))
    return built


def _choose(parcels: list[Parcel], urban: float, rng: np.random.Generator) -> list[Style]:
    """One style a parcel; each style that must not be missing takes the parcel it fits best."""
    chosen: list[Style | None] = [None] * len(parcels)
    by_side = np.argsort([-parcel.rect.short for parcel in parcels], kind="stable")
    wanted: list[Style] = [
        styles.courtyard,
        styles.setback,
        styles.tower,
        styles.flats,
        styles.house,
    ]
    if rng.random() < 0.5:
        wanted.insert(3, styles.cantilever)
    if rng.random() < 0.3:
        wanted.insert(4, styles.church)
    for style, at in zip(wanted, by_side, strict=False):
        chosen[at] = style
    return [
        style or _random_style(parcel, urban, rng)
        for style, parcel in zip(chosen, parcels, strict=True)
    ]


def _random_style(parcel: Parcel, urban: float, rng: np.random.Generator) -> Style:
    side = parcel.rect.short
    if parcel.attached and side < 14.0:
        return styles.house if rng.random() > urban else styles.terrace
    options: list[tuple[Style, float]] = [
        (styles.house, 1.2 - urban),
        (styles.wings, 1.0 - urban if side > 9.0 else 0.0),
        (styles.flats, 0.3 + urban),
        (styles.setback, urban if side > 9.0 else 0.0),
        (styles.tower, 0.7 * urban if side > 9.0 else 0.0),
        (styles.cantilever, 0.3 if side > 9.0 else 0.0),
        (styles.courtyard, 0.6 if side > 18.0 else 0.0),
        (styles.terrace, 0.2),
    ]
    weights = np.array([weight for _, weight in options])
    return options[int(rng.choice(len(options), p=weights / weights.sum()))][0]


_HEIGHTS: dict[Style, tuple[float, float]] = {
    styles.house: (5.5, 12.0),
    styles.terrace: (5.0, 14.0),
    styles.wings: (6.0, 12.0),
    styles.flats: (8.0, 26.0),
    styles.setback: (12.0, 36.0),
    styles.tower: (18.0, 40.0),
    styles.courtyard: (9.0, 22.0),
    styles.cantilever: (7.0, 18.0),
    styles.church: (18.0, 38.0),
}


def _height(
    style: Style,
    rect: Rect,
    urban: float,
    heights: tuple[float, float],
    rng: np.random.Generator,
) -> float:
    """Height of the style, higher in town, at most five times the short side, within limits."""
    low, high = _HEIGHTS[style]
    share = float(rng.beta(1.0 + urban, 2.0 - urban))
    height = min(low + share * (high - low), 5.0 * rect.short)
    return float(np.clip(height, *heights))


def _ground(
    size: tuple[float, float],
    terrain: Relief,
    layout: Layout,
    courts: list[Footprint],
    deck: Footprint | None,
) -> tuple[Solid, Bytes]:
    """Triangulated grid over the whole place, and what each triangle is."""
    nx, ny = (max(2, int(np.ceil(length / GROUND_CELL))) for length in size)
    x = np.linspace(-0.5 * size[0], 0.5 * size[0], nx + 1)
    y = np.linspace(-0.5 * size[1], 0.5 * size[1], ny + 1)
    xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices = np.column_stack([xy, terrain.height(xy)])
    a = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    b, c, d = a + ny + 1, a + ny + 2, a + 1
    triangles = np.stack([np.column_stack([a, b, c]), np.column_stack([a, c, d])], axis=1)
    triangles = triangles.reshape(-1, 3)
    centre = xy[triangles].mean(axis=1)
    kinds = np.full(len(triangles), Kind.GROUND, dtype=np.uint8)
    marks: list[tuple[Floats, Kind]] = [
        (np.array([[s.x0, s.y0], [s.x1, s.y1]]), Kind.STREET) for s in layout.streets
    ]
    marks += [(court.corners()[[0, 2]], Kind.COURTYARD) for court in courts]
    if deck is not None:
        corners = deck.corners()
        marks.append((np.array([corners.min(axis=0), corners.max(axis=0)]), Kind.UNDER_BRIDGE))
    for (low, high), kind in marks:
        kinds[((centre >= low) & (centre <= high)).all(axis=1)] = kind
    return Solid(vertices, triangles), kinds


def _terrain(size: tuple[float, float], terrain: Relief, turn: float) -> Ground:
    """Terrain heights on a grid along x and y over the turned place, cells of 1 m."""
    c, s = abs(np.cos(turn)), abs(np.sin(turn))
    half = 0.5 * np.array([c * size[0] + s * size[1], s * size[0] + c * size[1]])
    count = np.ceil(2.0 * half).astype(int) + 1
    centres = [np.arange(n) + 0.5 - h for n, h in zip(count, half, strict=True)]
    xy = np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1)
    return Ground(terrain.height(xy @ _turned(-turn).T), -half, 1.0)


def _turned(turn: float) -> Floats:
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s], [s, c]])


def _assemble(
    sheet: Solid,
    sheet_kinds: Bytes,
    solids: list[tuple[Solid, Kind, int]],
    ground: Ground,
    turn: float,
) -> Town:
    """Stack all triangles, turn them, and label them."""
    everything = [sheet, *(solid for solid, _, _ in solids)]
    counts = [len(solid.triangles) for solid in everything]
    first = np.cumsum([0, *(len(solid.vertices) for solid in everything)])
    vertices = np.concatenate([solid.vertices for solid in everything])
    vertices[:, :2] = vertices[:, :2] @ _turned(turn).T
    triangles = np.concatenate(
        [solid.triangles + start for solid, start in zip(everything, first, strict=False)]
    )
    kinds = np.repeat(np.array([kind for _, kind, _ in solids], dtype=np.uint8), counts[1:])
    numbers = np.array([-1, *(number for _, _, number in solids)], dtype=np.int64)
    return Town(
        Mesh(vertices, triangles),
        np.concatenate([sheet_kinds, kinds]),
        np.repeat(np.arange(len(everything)), counts),
        np.repeat(numbers, counts),
        ground,
        turn,
    )
