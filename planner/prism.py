"""The settings of a zone: an upright prism, and what makes its outline one."""

from typing import Literal, Self

from pydantic import Field, model_validator

from planner.settings import Metres, Settings

_Corner = tuple[float, float]


def _turn(a: _Corner, b: _Corner, c: _Corner) -> float:
    """Twice the signed area of a triangle."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _cross(a: _Corner, b: _Corner, c: _Corner, d: _Corner) -> bool:
    """Whether segments ab and cd cross at a point inside of both."""
    apart = _turn(a, b, c) * _turn(a, b, d), _turn(c, d, a) * _turn(c, d, b)
    return apart[0] < 0.0 and apart[1] < 0.0


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
        for i, first in enumerate(sides):
            for second in sides[i + 2 : len(sides) - (i == 0)]:
                if _cross(*first, *second):
                    raise ValueError(
                        f"sides {first} and {second} of the polygon cross; "
                        "give its corners in order"
                    )
        return self
