"""Where flight is forbidden for other reasons than solids: prisms and a ceiling."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.config import ZoneSettings
from planner.geometry.arrays import Bools, Floats, read_only
from planner.scene.scene import Ground

_BLOCK = 2_000_000  # point-edge pairs at once
_FINEST = 1e-3  # metres: stretches shorter than that are not split any more


@dataclass(frozen=True, slots=True, eq=False)
class Prism:
    """An upright prism that forbids its inside (``keep_out``) or its outside (``keep_in``).

    Parameters
    ----------
    kind
        Which side is forbidden.
    polygon
        Corners of the outline in order, either way round, shape (K, 2), metres, local frame.
    bottom, top
        Heights, metres, local frame; infinite where there is no end.
    name
        What the user calls it.

    """

    kind: Literal["keep_out", "keep_in"]
    polygon: Floats
    bottom: float = -np.inf
    top: float = np.inf
    name: str = ""

    def __post_init__(self) -> None:
        polygon = read_only(self.polygon, (None, 2), name="polygon")
        if len(polygon) < 3 or not np.isfinite(polygon).all() or not self.bottom < self.top:
            raise ValueError(
                f"zone {self.name!r} needs three finite corners and bottom < top, "
                f"got {len(polygon)} corners, {self.bottom} and {self.top}."
            )
        object.__setattr__(self, "polygon", polygon)

    def margin(self, points: Floats) -> Floats:
        """Signed distance to the prism's surface, shape (N,), metres; negative is forbidden."""
        outside = _to_prism(points, self.polygon, self.bottom, self.top)
        return outside if self.kind == "keep_out" else -outside


@dataclass(frozen=True, slots=True, eq=False)
class Ceiling:
    """A highest height above the terrain, with a margin that is a distance in space.

    The terrain that counts is a continuous surface, never above the stepped ground, that rises
    by at most ``steepest`` a metre: next to a cliff the ceiling is that of the lower side.

    Parameters
    ----------
    above_ground
        Highest flight above the terrain under the aircraft, metres.
    corners
        Height of the terrain that counts at the cells' corners, shape (nx + 1, ny + 1), metres.
    origin
        Position x, y of the first corner, shape (2,), metres.
    cell
        Distance between corners, metres.

    """

    above_ground: float
    corners: Floats
    origin: Floats
    cell: float

    def __post_init__(self) -> None:
        corners = read_only(self.corners, (None, None), name="corners")
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "origin", read_only(self.origin, (2,), name="origin"))

    def height(self, points: Floats) -> Floats:
        """Height of the ceiling over each point, shape (N,), metres."""
        last = np.array(self.corners.shape) - 1
        at = ((points[:, :2] - self.origin) / self.cell).clip(0.0, last)
        i, j = np.minimum(at.astype(np.int64), last - 1).T
        u, v = at[:, 0] - i, at[:, 1] - j
        near = (1.0 - v) * self.corners[i, j] + v * self.corners[i, j + 1]
        far = (1.0 - v) * self.corners[i + 1, j] + v * self.corners[i + 1, j + 1]
        return np.asarray((1.0 - u) * near + u * far + self.above_ground)

    @property
    def stretch(self) -> float:
        """How far under the steepest ceiling a place must be, metres, to be one metre off it."""
        steps = [np.abs(np.diff(self.corners, axis=axis)).max() / self.cell for axis in (0, 1)]
        return float(np.sqrt(1.0 + steps[0] ** 2 + steps[1] ** 2))

    def margin(self, points: Floats) -> Floats:
        """Lower bound of the signed distance to the ceiling; exact over level terrain."""
        return np.asarray((self.height(points) - points[:, 2]) / self.stretch)


@dataclass(frozen=True, slots=True, eq=False)
class Zones:
    """All prisms and the ceiling.

    Parameters
    ----------
    prisms
        In the order of the settings.
    ceiling
        ``None`` where there is none.
    kept
        Distance that is kept from all of them, metres, not negative.

    """

    prisms: tuple[Prism, ...] = ()
    ceiling: Ceiling | None = None
    kept: float = 0.0

    def distance(self, points: Floats) -> Floats:
        """Signed distance of points, shape (N, 3), to all zones, metres; negative is inside.

        Changes by at most a metre a metre, so that it bounds itself around each point; infinite
        without any zone.
        """
        distance = np.full(len(points), np.inf)
        for prism in self.prisms:
            distance = np.minimum(distance, prism.margin(points))
        if self.ceiling is not None:
            distance = np.minimum(distance, self.ceiling.margin(points))
        return distance

    def margin(self, points: Floats) -> Floats:
        """The same beyond what is kept, metres; negative is forbidden."""
        return self.distance(points) - self.kept

    def margin_at_least(self, a: Floats, b: Floats, margin: float) -> bool:
        """Prove that the margin along the whole segment ``ab`` is at least ``margin`` metres.

        Stretches are halved until the margin at the middle covers each. What is not proven at a
        millimetre is refused.
        """
        if not self.prisms and self.ceiling is None:
            return True
        length = float(np.linalg.norm(b - a))
        middles, half = np.array([0.5]), 0.5  # in shares of the segment
        while len(middles):
            spare = self.margin(a + middles[:, None] * (b - a)) - margin
            if (spare < 0.0).any():
                return False
            middles = middles[spare < half * length]
            if len(middles) and half * length < _FINEST:
                return False
            half *= 0.5
            middles = np.concatenate([middles - half, middles + half])
        return True


def zones(
    settings: Sequence[ZoneSettings], ceiling: float | None, ground: Ground, *, kept: float = 0.0
) -> Zones:
    """Zones as the settings give them.

    Parameters
    ----------
    settings
        Prisms in local metres.
    ceiling
        Highest flight above the terrain, metres, or ``None``.
    ground
        Terrain that the ceiling is above.
    kept
        Distance that is kept from zones and ceiling, metres.

    Returns
    -------
    zones
        Ready to be asked.

    """
    prisms = tuple(
        Prism(
            zone.kind,
            np.array(zone.polygon),
            -np.inf if zone.bottom is None else zone.bottom,
            np.inf if zone.top is None else zone.top,
            zone.name,
        )
        for zone in settings
    )
    return Zones(prisms, None if ceiling is None else ceiling_over(ground, ceiling), kept)


def ceiling_over(ground: Ground, above_ground: float, *, steepest: float = 0.5) -> Ceiling:
    """Ceiling above a terrain, lowered where the terrain is steeper than ``steepest``.

    Parameters
    ----------
    ground
        Terrain heights by cell.
    above_ground
        Highest flight above it, metres.
    steepest
        Largest rise of the terrain that counts, metres a metre, along each axis.

    Returns
    -------
    ceiling
        Nowhere higher than ``ground.height + above_ground``.

    """
    wide = np.pad(ground.heights, 1, mode="edge")
    corners = np.minimum(
        np.minimum(wide[:-1, :-1], wide[1:, :-1]), np.minimum(wide[:-1, 1:], wide[1:, 1:])
    )
    for axis in (0, 1):  # lower envelope of cones; rises along the axes add up, so one by one
        ramp = steepest * ground.cell * np.arange(corners.shape[axis])
        ramp = ramp[:, None] if axis == 0 else ramp
        forth = np.minimum.accumulate(corners - ramp, axis=axis) + ramp
        back = np.flip(np.minimum.accumulate(np.flip(corners + ramp, axis), axis=axis), axis) - ramp
        corners = np.minimum(forth, back)
    return Ceiling(above_ground, corners, ground.origin, ground.cell)


def _to_prism(points: Floats, polygon: Floats, bottom: float, top: float) -> Floats:
    """Signed distance from points to an upright prism, negative inside; exact."""
    beside = signed_distance_to_polygon(points[:, :2], polygon)
    over = np.maximum(bottom - points[:, 2], points[:, 2] - top)
    inside = np.minimum(np.maximum(beside, over), 0.0)
    return np.asarray(inside + np.hypot(beside.clip(0.0), over.clip(0.0)))


def signed_distance_to_polygon(xy: Floats, polygon: Floats) -> Floats:
    """Distance from points to a polygon's outline, negative inside by the even-odd rule.

    Parameters
    ----------
    xy
        Shape (N, 2), metres.
    polygon
        Corners in order, shape (K, 2), metres.

    Returns
    -------
    distance
        Shape (N,), metres.

    """
    distance, inside = np.empty(len(xy)), np.zeros(len(xy), dtype=bool)
    step = max(1, _BLOCK // len(polygon))
    for first in range(0, len(xy), step):
        rows = slice(first, first + step)
        distance[rows], inside[rows] = _to_outline(xy[rows], polygon)
    return np.where(inside, -distance, distance)


def _to_outline(xy: Floats, polygon: Floats) -> tuple[Floats, Bools]:
    """Unsigned distance to the outline and whether a ray along x crosses it an odd number."""
    start, edge = polygon, np.roll(polygon, -1, axis=0) - polygon
    away = xy[:, None, :] - start  # (N, K, 2)
    length2 = np.maximum((edge**2).sum(axis=1), np.finfo(float).tiny)
    share = ((away * edge).sum(axis=2) / length2).clip(0.0, 1.0)
    distance = np.linalg.norm(away - share[:, :, None] * edge, axis=2).min(axis=1)
    low, high = start[:, 1], start[:, 1] + edge[:, 1]
    y = xy[:, 1:2]
    between = (low <= y) != (high <= y)
    rise = np.where(edge[:, 1] == 0.0, 1.0, edge[:, 1])
    crossing = start[:, 0] + (y - low) / rise * edge[:, 0]
    odd = (between & (xy[:, 0:1] < crossing)).sum(axis=1) % 2 == 1
    return distance, odd
