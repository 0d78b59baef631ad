"""Streets and parcels: a rectangle cut by streets, then by alleys and party walls."""

from dataclasses import dataclass, replace

import numpy as np

SMALLEST_SIDE = 5.5  # metres; below it no building would be a building


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle along the axes, metres."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def width(self) -> float:
        """Length along x, metres."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """Length along y, metres."""
        return self.y1 - self.y0

    @property
    def area(self) -> float:
        """Square metres."""
        return self.width * self.depth

    @property
    def short(self) -> float:
        """Length of the shorter side, metres."""
        return min(self.width, self.depth)

    def mirrored(self, over_x: bool, over_y: bool) -> "Rect":
        """Return it with its x changed in sign, its y, or both."""
        x = (-self.x1, -self.x0) if over_x else (self.x0, self.x1)
        y = (-self.y1, -self.y0) if over_y else (self.y0, self.y1)
        return Rect(x[0], y[0], x[1], y[1])

    def cut(self, at: float, gap: float) -> tuple["Rect", "Rect", "Rect"]:
        """Cut across the longer side at a share of it: the parts, and the strip between."""
        if self.width >= self.depth:
            x = self.x0 + at * (self.width - gap)
            return (
                replace(self, x1=x),
                replace(self, x0=x + gap),
                replace(self, x0=x, x1=x + gap),
            )
        y = self.y0 + at * (self.depth - gap)
        return (
            replace(self, y1=y),
            replace(self, y0=y + gap),
            replace(self, y0=y, y1=y + gap),
        )


@dataclass(frozen=True, slots=True)
class Parcel:
    """Room for one building. ``attached`` parcels share a party wall with a neighbour."""

    rect: Rect
    attached: bool = False
    park: bool = False


@dataclass(frozen=True, slots=True)
class Layout:
    """Parcels, parks included, and the streets between them, the main street first."""

    parcels: tuple[Parcel, ...]
    streets: tuple[Rect, ...]


def lay_out(size: tuple[float, float], buildings: int, rng: np.random.Generator) -> Layout:
    """Cut a place into parcels for so many buildings.

    Streets of 7 to 14 m cut it into quarters; alleys of 1.5 to 5 m and party walls cut those,
    the larger ones more often. One large parcel is spared for a courtyard, and one in three
    blocks keeps a park.

    Parameters
    ----------
    size
        Lengths along x and y, metres; the place is centred on the origin.
    buildings
        Parcels that are not parks.
    rng
        Source of chance.

    Returns
    -------
    layout
        Parcels that do not overlap and keep 4 m or more from the rim.

    Raises
    ------
    ValueError
        If so many buildings do not fit.

    """
    park = buildings >= 5 and rng.random() < 0.35
    for streets in (None, 1):
        layout = _try(size, buildings + int(park), streets, rng)
        if layout is not None:
            break
    else:
        raise ValueError(f"{buildings} buildings do not fit on {size[0]} x {size[1]} m.")
    parcels = list(layout.parcels)
    if park:
        at = int(rng.integers(1, len(parcels)))
        parcels[at] = replace(parcels[at], park=True)
    over_x, over_y = rng.random(2) < 0.5  # cuts favour the low corner; mirrors do not
    return Layout(
        tuple(replace(one, rect=one.rect.mirrored(over_x, over_y)) for one in parcels),
        tuple(street.mirrored(over_x, over_y) for street in layout.streets),
    )


def _try(
    size: tuple[float, float], wanted: int, most: int | None, rng: np.random.Generator
) -> Layout | None:
    """Cut a place into so many parcels with at most so many streets, or say that it cannot be."""
    rim = float(rng.uniform(4.0, 7.0)) if most is None else 4.0
    x, y = 0.5 * size[0] - rim, 0.5 * size[1] - rim
    quarters, streets = _quarters(Rect(-x, -y, x, y), wanted, most, rng)
    parcels = [Parcel(quarter) for quarter in quarters]
    spared = _spare(parcels, rng) if wanted >= 4 else []
    while len(parcels) + len(spared) < wanted:
        if not _cut_one(parcels, rng):
            if not spared:
                return None
            parcels.append(spared.pop())
    return Layout(tuple(spared + parcels), tuple(streets))


def _quarters(
    whole: Rect, parcels: int, most: int | None, rng: np.random.Generator
) -> tuple[list[Rect], list[Rect]]:
    """Cut by streets until a quarter has some 900 to 2,500 square metres."""
    wanted = int(np.clip(whole.area / rng.uniform(900.0, 2500.0), 2, max(2, parcels // 2)))
    widest = float(rng.uniform(8.0, 14.0))
    if most is not None:
        wanted, widest = min(wanted, most + 1), 7.0
    quarters, streets = [whole], list[Rect]()
    while len(quarters) < min(wanted, parcels):
        at = int(np.argmax([quarter.area for quarter in quarters]))
        street = widest if not streets else float(rng.uniform(7.0, widest))
        for share in (float(rng.uniform(0.36, 0.64)), 0.5):
            one, other, strip = quarters[at].cut(share, street)
            if min(one.short, other.short) >= SMALLEST_SIDE:
                break
        else:
            break
        quarters[at : at + 1] = [one, other]
        streets.append(strip)
    return quarters, streets


def _spare(parcels: list[Parcel], rng: np.random.Generator) -> list[Parcel]:
    """Take out one parcel of 20 to 32 m sides for a courtyard, if there is one to be had."""
    at = int(np.argmax([parcel.rect.short for parcel in parcels]))
    rect = parcels[at].rect
    if rect.short < 18.0:
        return []
    long = max(rect.width, rect.depth)
    alley, side = float(rng.uniform(2.0, 5.0)), float(rng.uniform(20.0, 32.0))
    if long < side + alley + 8.0:
        return [parcels.pop(at)]
    one, other, _ = rect.cut(side / (long - alley), alley)
    parcels[at] = Parcel(other)
    return [Parcel(one)]


def _cut_one(parcels: list[Parcel], rng: np.random.Generator) -> bool:
    """Cut one parcel in two, a large one likely; tell whether there was one to cut."""
    chance = rng.lognormal(0.0, 0.5, len(parcels))
    order = np.argsort([-p.rect.area * c for p, c in zip(parcels, chance, strict=True)])
    alley = 0.0 if rng.random() < 0.35 else float(rng.uniform(1.5, 5.0))
    share = float(rng.uniform(0.38, 0.62))
    for gap, at_share in ((alley, share), (1.5, 0.5), (0.0, 0.5)):
        for at in order:
            one, other, _ = parcels[at].rect.cut(at_share, gap)
            if min(one.short, other.short) >= SMALLEST_SIDE:
                attached = parcels[at].attached or gap == 0.0
                parcels[at : at + 1] = [Parcel(one, attached), Parcel(other, attached)]
                return True
    return False
