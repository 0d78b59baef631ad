"""Which building stands on which parcel: style, room, height."""

import numpy as np

from planner.scene.town import styles
from planner.scene.town.building import Building, Site
from planner.scene.town.layout import Parcel
from planner.scene.town.solids import Footprint
from planner.scene.town.styles import Style
from planner.scene.town.terrain import Relief

LONGEST_SIDE = 48.0  # metres of one building
FOUNDATION = 1.0  # metres below the lowest ground at a wall


def build_all(
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
