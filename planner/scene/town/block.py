"""Put ground, buildings, bridge and trees together into one labelled mesh."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bytes, Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground
from planner.scene.town import buildings as styles
from planner.scene.town.bridges import Bridge, footbridge, skybridge
from planner.scene.town.buildings import Building, Kind, Site, Style
from planner.scene.town.layout import Layout, Parcel, lay_out
from planner.scene.town.relief import Relief, random_relief
from planner.scene.town.solids import Footprint, Solid
from planner.scene.town.trees import Yards, plant

GROUND_CELL = 2.5  # metres
MERGE = 0.01  # metres below which two grid lines are one
LONGEST_SIDE = 48.0  # metres of one building
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
    if deck is not None:
        _clear_balconies(built, deck)
    grown = []
    if trees:
        rooms = [one.room for one in built]
        yards = Yards(rooms, courts, [] if deck is None else [deck], size)
        grown = plant(layout, yards, terrain, rng)

    sheet, sheet_kinds = _ground(size, terrain, layout, courts, deck)
    solids: list[tuple[Solid, Kind, int]] = []
    for number, one in enumerate(built):
        solids += [(solid, kind, number) for solid, kind in one.parts]
    solids += [(solid, Kind.BRIDGE, -1) for solid in (span.parts if span else ())]
    for tree in grown:
        solids += [(tree.trunk, Kind.TRUNK, -1), (tree.crown, Kind.CROWN, -1)]
    return _assemble(sheet, sheet_kinds, solids, _terrain(size, terrain, turn), turn)


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
        room = _room(parcel, style, rng)
        ground = terrain.height(np.vstack([room.corners(), [[room.x, room.y]]]))
        height = _height(style, 2.0 * min(room.u, room.v), urban, heights, rng=rng)
        bottom = float(ground.min()) - FOUNDATION
        built.append(style(Site(room, bottom, float(ground.mean()), height, parcel.attached), rng))
    return built


def _room(parcel: Parcel, style: Style, rng: np.random.Generator) -> Footprint:
    """Part of a parcel to build on: all of it, less a garden, or turned a little in it."""
    rect = parcel.rect
    x, y = 0.5 * (rect.x0 + rect.x1), 0.5 * (rect.y0 + rect.y1)
    u, v = 0.5 * rect.width, 0.5 * rect.depth
    if parcel.attached:
        return Footprint(x, y, u, v).inset(-0.02)
    if style in _GARDENS:
        garden = min(float(rng.uniform(0.0, 2.5)), 0.15 * rect.short)
        u, v = u - garden, v - garden
    spare = (max(u - LONGEST_SIDE / 2, 0.0), max(v - LONGEST_SIDE / 2, 0.0))
    x += float(rng.uniform(-1.0, 1.0)) * spare[0]
    y += float(rng.uniform(-1.0, 1.0)) * spare[1]
    u, v = u - spare[0], v - spare[1]
    if style in _GARDENS and min(u, v) > 5.0 and rng.random() < 0.4:
        turn = float(rng.uniform(-0.4, 0.4))
        c, s = np.cos(turn), abs(np.sin(turn))
        shrink = float(min(u / (u * c + v * s), v / (u * s + v * c)))
        return Footprint(x, y, u * shrink, v * shrink, turn)
    return Footprint(x, y, u, v)


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
    free = [at for at in by_side if not parcels[at].attached and chosen[at] is None]
    if free and styles.flats in chosen and parcels[chosen.index(styles.flats)].attached:
        chosen[free[0]] = styles.flats  # so that some stand free and have balconies
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
    styles.house: (4.0, 12.0),
    styles.terrace: (5.0, 14.0),
    styles.wings: (6.0, 12.0),
    styles.flats: (8.0, 26.0),
    styles.setback: (12.0, 36.0),
    styles.tower: (18.0, 40.0),
    styles.courtyard: (9.0, 22.0),
    styles.cantilever: (7.0, 18.0),
    styles.church: (18.0, 38.0),
}
_GARDENS = (styles.house, styles.wings, styles.church, styles.setback)
_SLENDER = (styles.setback, styles.tower, styles.church)


def _height(
    style: Style,
    side: float,
    urban: float,
    heights: tuple[float, float],
    *,
    rng: np.random.Generator,
) -> float:
    """Height of the style, higher in town, in proportion to the short side, within limits."""
    low, high = _HEIGHTS[style]
    share = float(rng.beta(1.0 + urban, 2.0 - urban))
    slender = 4.0 if style in _SLENDER else 2.5
    return float(np.clip(min(low + share * (high - low), slender * side), *heights))


def _ground(
    size: tuple[float, float],
    terrain: Relief,
    layout: Layout,
    courts: list[Footprint],
    deck: Footprint | None,
) -> tuple[Solid, Bytes]:
    """Triangulated grid over the whole place, and what each triangle is."""
    marks: list[tuple[Floats, Kind]] = [
        (np.array([[s.x0, s.y0], [s.x1, s.y1]]), Kind.STREET) for s in layout.streets
    ]
    marks += [(court.bounds(), Kind.COURTYARD) for court in courts]
    if deck is not None:
        marks.append((deck.bounds(), Kind.UNDER_BRIDGE))
    edges = np.concatenate([np.zeros((0, 2)), *(bounds for bounds, _ in marks)])
    x, y = (_lines(0.5 * length, edges[:, axis]) for axis, length in enumerate(size))
    nx, ny = len(x) - 1, len(y) - 1
    xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices = np.column_stack([xy, terrain.height(xy)])
    a = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    b, c, d = a + ny + 1, a + ny + 2, a + 1
    triangles = np.stack([np.column_stack([a, b, c]), np.column_stack([a, c, d])], axis=1)
    triangles = triangles.reshape(-1, 3)
    centre = xy[triangles].mean(axis=1)
    kinds = np.full(len(triangles), Kind.GROUND, dtype=np.uint8)
    for (low, high), kind in marks:
        kinds[((centre >= low) & (centre <= high)).all(axis=1)] = kind
    return Solid(vertices, triangles), kinds


def _lines(half: float, edges: Floats) -> Floats:
    """Grid lines from -half to half through all edges, at most a cell apart."""
    inside = edges[np.abs(edges) < half - MERGE]
    stops = np.unique(np.concatenate([[-half, half], inside]))
    stops = stops[np.append(np.diff(stops) > MERGE, True)]
    stops[0] = -half
    counts = np.ceil(np.diff(stops) / GROUND_CELL).astype(int)
    pieces = [
        np.linspace(a, b, count, endpoint=False)
        for a, b, count in zip(stops[:-1], stops[1:], counts, strict=True)
    ]
    return np.append(np.concatenate(pieces), half)


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
