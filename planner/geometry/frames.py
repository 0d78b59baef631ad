"""Where the local frame lies in the world."""

from dataclasses import dataclass

from planner.geometry.arrays import Floats, read_only


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A local frame: metres, z up, axes along the grid of its CRS.

    Parameters
    ----------
    origin
        Position of the local zero in the source's coordinates, shape (3,), metres, float64.
    crs
        Coordinate reference system of the source as ``EPSG:n`` or WKT, or ``None`` if unknown.
    vertical_datum
        Name of what heights are above, or ``None`` if unknown.
    unit_metres
        Length of one unit of the source, metres.
    local_from_source
        Rotation that turned the source's axes to z up, shape (3, 3); identity in most files.
    height_unit_metres
        Length of one unit of the source's heights, metres, where it is another one.

    """

    origin: Floats
    crs: str | None = None
    vertical_datum: str | None = None
    unit_metres: float = 1.0
    local_from_source: Floats | None = None
    height_unit_metres: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", read_only(self.origin, (3,), name="origin"))
        if self.local_from_source is not None:
            turn = read_only(self.local_from_source, (3, 3), name="local_from_source")
            object.__setattr__(self, "local_from_source", turn)
