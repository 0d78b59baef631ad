"""The settings of a zone: an upright prism, and what makes its outline one."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, Self

from pydantic import Field, model_validator

from planner.settings import Metres, Settings

if TYPE_CHECKING:
    from planner.geometry.arrays import Floats

_Corner = tuple[float, float]

_PAIRS = 500_000  # of sides that are looked at together


def _crossing(corners: Sequence[_Corner]) -> tuple[int, int] | None:
    """First two sides of a polygon that cross at a point inside of both, or ``None``."""
    import numpy as np

    start = np.array(corners, dtype=np.float64)
    end = np.roll(start, -1, axis=0)
    lows, highs = np.minimum(start, end).T, np.maximum(start, end).T
    rows = max(1, _PAIRS // len(start))
    with np.errstate(over="ignore", invalid="ignore"):
        for first in range(0, len(start), rows):
            some = slice(first, first + rows)
            near = np.True_
            for low, high in zip(lows, highs, strict=True):
                near = near & (low[some, None] <= high[first:]) & (high[some, None] >= low[first:])
            i, j = first + np.array(np.nonzero(np.triu(near, 1)))
            apart = _turn(start[i], end[i], start[j]) * _turn(start[i], end[i], end[j]) < 0.0
            apart &= _turn(start[j], end[j], start[i]) * _turn(start[j], end[j], end[i]) < 0.0
            if apart.any():
                pair = int(np.argmax(apart))
                return int(i[pair]), int(j[pair])
    return None


def _turn(a: "Floats", b: "Floats", c: "Floats") -> "Floats":
    """Twice the signed areas of triangles with these corners, shape (n, 2) each."""
    (x, y), (u, v) = (b - a).T, (c - a).T
    twice: Floats = x * v - y * u
    return twice


class ZoneSettings(Settings):
    """An upright prism in which, or outside of which, flight is forbidden."""

    kind: Literal["keep_out", "keep_in"] = "keep_out"
    """Whether the inside is forbidden or the outside."""
    polygon: tuple[_Corner, ...] = Field(min_length=3)
    """Corners x and y of its outline, in order, no side crossing another."""
    bottom: Metres | None = None
    """Its lowest height; unset: it reaches down without end."""
    top: Metres | None = None
    """Its greatest height; unset: it reaches up without end."""
    name: str = ""
    """What it is called in findings and pictures."""
    crs: str = Field(default="local", min_length=1)
    """What the corners are: ``local`` metres, coordinates of the ``source``, or any reference
    system such as ``EPSG:4326``, with x as easting or longitude."""
    heights: Literal["local", "source", "ground"] = "local"
    """What bottom and top are above: the local zero, that of the source, or the ground."""

    @model_validator(mode="after")
    def _is_a_prism(self) -> Self:
        """Refuse what would forbid nothing, or something else than it seems to."""
        if self.bottom is not None and self.top is not None and self.bottom >= self.top:
            raise ValueError(
                f"bottom {self.bottom} is not below top {self.top}; raise top or lower bottom"
            )
        sides = list(zip(self.polygon, (*self.polygon[1:], self.polygon[0]), strict=True))
        area = sum(a[0] * b[1] - b[0] * a[1] for a, b in sides)
        if abs(area) < (1e-6 if self.crs in {"local", "source"} else 1e-14):
            raise ValueError("the polygon has no area; give corners that are not in a line")
        crossing = _crossing(self.polygon)
        if crossing is not None:
            first, second = (sides[side] for side in crossing)
            raise ValueError(
                f"sides {first} and {second} of the polygon cross; give its corners in order"
            )
        return self
