"""Closed, outward-oriented solids from which a town is put together."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.geometry.arrays import Floats, Ints


class Solid(NamedTuple):
    """A watertight triangle mesh: vertices (n, 3), metres, and triangles (m, 3), outward."""

    vertices: Floats
    triangles: Ints


@dataclass(frozen=True, slots=True)
class Footprint:
    """A rectangle on the map, turned about its centre.

    Parameters
    ----------
    x, y
        Centre, metres.
    u, v
        Half lengths along its own axes, metres, above zero.
    turn
        Angle of its first axis from +x, counter-clockwise, radians.

    """

    x: float
    y: float
    u: float
    v: float
    turn: float = 0.0

    @property
    def slanting(self) -> bool:
        """Whether no side runs along a map axis."""
        return bool(abs(np.sin(2.0 * self.turn)) > 1e-9)

    def at(self, u: float, v: float) -> tuple[float, float]:
        """Map position of a point in the rectangle's own axes, metres."""
        c, s = float(np.cos(self.turn)), float(np.sin(self.turn))
        return self.x + c * u - s * v, self.y + s * u + c * v

    def corners(self) -> Floats:
        """Corners, counter-clockwise, shape (4, 2), the first edge along the first axis."""
        u, v = self.u, self.v
        return np.array([self.at(-u, -v), self.at(u, -v), self.at(u, v), self.at(-u, v)])

    def bounds(self) -> Floats:
        """Lowest and highest corner of the rectangle along the map's axes, shape (2, 2)."""
        corners = self.corners()
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    def inset(self, u: float, v: float | None = None) -> "Footprint":
        """Return it with every edge moved inwards by so many metres (outwards if negative)."""
        return Footprint(self.x, self.y, self.u - u, self.v - (u if v is None else v), self.turn)

    def part(self, u: tuple[float, float], v: tuple[float, float]) -> "Footprint":
        """Sub-rectangle between two coordinates on each of its own axes, metres."""
        x, y = self.at(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]))
        return Footprint(x, y, 0.5 * (u[1] - u[0]), 0.5 * (v[1] - v[0]), self.turn)

    def long_side_first(self) -> "Footprint":
        """Return the same rectangle with its first axis along the longer side."""
        if self.u >= self.v:
            return self
        return Footprint(self.x, self.y, self.v, self.u, self.turn + 0.5 * np.pi)


def polygon(x: float, y: float, radius: float, count: int, turn: float = 0.0) -> Floats:
    """Regular polygon, counter-clockwise, shape (count, 2), metres."""
    angle = turn + 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])


def loft(outlines: list[Floats], heights: list[float], *, apex: Floats | None = None) -> Solid:
    """Close a stack of convex outlines, lowest first, into a solid.

    Parameters
    ----------
    outlines
        Counter-clockwise convex outlines of the same number n of corners, each (n, 2), metres.
    heights
        Height of each outline, rising, metres.
    apex
        Point (3,) in which the solid ends above the last outline; a flat lid without it.

    Returns
    -------
    solid
        Sides of two triangles each, a fan as floor, a fan or a pyramid as lid.

    """
    n, levels = len(outlines[0]), len(outlines)
    vertices = np.empty((n * levels, 3))
    vertices[:, :2] = np.concatenate(outlines)
    vertices[:, 2] = np.repeat(heights, n)
    fan = _FANS.setdefault(n, _fan(n))
    faces = [fan[:, ::-1]]
    band = _BANDS.setdefault(n, _band(n))
    faces += [band + n * level for level in range(levels - 1)]
    top = n * (levels - 1)
    if apex is None:
        faces.append(fan + top)
    else:
        rim = np.arange(n) + top
        tip = np.full(n, n * levels)
        faces.append(np.column_stack([rim, np.roll(rim, -1), tip]))
        vertices = np.vstack([vertices, apex])
    return Solid(vertices, np.concatenate(faces))


def _fan(n: int) -> Ints:
    i = np.arange(1, n - 1)
    return np.column_stack([np.zeros_like(i), i, i + 1])


def _band(n: int) -> Ints:
    i = np.arange(n)
    j = (i + 1) % n
    return np.concatenate([np.column_stack([i, j, j + n]), np.column_stack([i, j + n, i + n])])


_FANS: dict[int, Ints] = {}
_BANDS: dict[int, Ints] = {}


def box(footprint: Footprint, bottom: float, top: float) -> Solid:
    """Box on a footprint between two heights, metres."""
    corners = footprint.corners()
    return loft([corners, corners], [bottom, top])


def slanted(footprint: Footprint, bottom: float, low: float, high: float) -> Solid:
    """Box whose flat roof rises along the second axis from ``low`` to ``high``, metres."""
    solid = box(footprint, bottom, low)
    solid.vertices[6:, 2] = high
    return solid


_ROOF = np.array(  # eaves 0..3, ridge 4 (over edge 3-0) and 5 (over edge 1-2)
    [[0, 1, 5], [0, 5, 4], [2, 3, 4], [2, 4, 5], [1, 2, 5], [3, 0, 4]]
)


def gabled(
    footprint: Footprint, bottom: float, eaves: float, ridge: float, *, hip: float = 0.0
) -> Solid:
    """House with a ridge along its first axis; the roof alone where ``bottom`` is ``eaves``.

    Parameters
    ----------
    footprint
        Rectangle under the eaves.
    bottom, eaves, ridge
        Heights, metres, rising (``bottom`` may equal ``eaves``).
    hip
        How far the ridge ends lie inside the end walls, metres; 0 gives gables.

    Returns
    -------
    solid
        Closed solid of 10 vertices (6 for the roof alone).

    """
    corners = footprint.corners()
    ends = [footprint.at(-footprint.u + hip, 0.0), footprint.at(footprint.u - hip, 0.0)]
    top = np.column_stack([np.vstack([corners, ends]), [eaves] * 4 + [ridge] * 2])
    floor = _fan(4)[:, ::-1]
    if bottom >= eaves:
        return Solid(top, np.concatenate([floor, _ROOF]))
    vertices = np.vstack([np.column_stack([corners, [bottom] * 4]), top])
    return Solid(vertices, np.concatenate([floor, _band(4), _ROOF + 4]))


def ring(
    outer: Floats, inner: Floats, bottom: float, top: float, *, ridge: float | None = None
) -> Solid:
    """Solid between two nested outlines: a courtyard building, or a parapet.

    Parameters
    ----------
    outer, inner
        Counter-clockwise outlines with matching corners, each (n, 2), metres.
    bottom, top
        Heights of floor and eaves, metres.
    ridge
        Height of a ridge half-way between the outlines, metres; a flat roof without it.

    Returns
    -------
    solid
        Closed solid with one hole through it.

    """
    n = len(outer)
    rims = [(outer, bottom), (outer, top), (inner, top), (inner, bottom)]
    if ridge is not None:
        rims.insert(2, (0.5 * (outer + inner), ridge))
    k = len(rims)
    vertices = np.vstack([np.column_stack([xy, np.full(n, z)]) for xy, z in rims])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    faces: list[Ints] = []
    for low in range(k):
        a, b = low * n, (low + 1) % k * n
        faces += [
            np.column_stack([a + i, a + j, b + j]),
            np.column_stack([a + i, b + j, b + i]),
        ]
    return Solid(vertices, np.concatenate(faces))
