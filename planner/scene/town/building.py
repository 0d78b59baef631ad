"""A building: its site, its solids, and what its triangles are called."""

from dataclasses import dataclass, field
from enum import IntEnum

from planner.scene.town.solids import Footprint, Solid


class Kind(IntEnum):
    """What a triangle of the town belongs to."""

    GROUND = 0
    STREET = 1
    COURTYARD = 2
    UNDER_BRIDGE = 3
    BUILDING = 4
    BALCONY = 5
    BRIDGE = 6
    TRUNK = 7
    CROWN = 8


@dataclass(frozen=True, slots=True)
class Site:
    """Where and how high to build.

    Parameters
    ----------
    room
        Rectangle that no part of the building may leave.
    bottom
        Height of the foundations, below the ground all around, metres.
    ground
        Height that the building's own height counts from, metres.
    height
        Height of the highest part above ``ground``, metres.
    attached
        Whether a party wall is shared, so that walls stand on the parcel's rim.

    """

    room: Footprint
    bottom: float
    ground: float
    height: float
    attached: bool = False

    @property
    def top(self) -> float:
        """Height of the highest part, metres."""
        return self.ground + self.height


@dataclass(slots=True)
class Building:
    """Solids of one building, and what a bridge or a tree has to know of it.

    Parameters
    ----------
    room
        Rectangle that no part leaves.
    parts
        Closed solids and their kinds.
    body
        Plain walls that reach from the ground to ``body_top``, metres, if it has such.
    court
        Open courtyard inside, if it has one.

    """

    room: Footprint
    parts: list[tuple[Solid, Kind]] = field(default_factory=list)
    body: Footprint | None = None
    body_top: float = 0.0
    court: Footprint | None = None

    def add(self, *solids: Solid, kind: Kind = Kind.BUILDING) -> None:
        """Add solids of one kind."""
        self.parts += [(solid, kind) for solid in solids]
