"""What order and flight need to know of an airspace."""

from typing import Protocol

from planner.geometry.arrays import Floats


class Space(Protocol):
    """Solids, zones and bounds, with the queries that choose ways and that prove them."""

    @property
    def d_min(self) -> float:
        """Wanted distance to solids, metres."""

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner of the space that is considered, each (3,)."""

    def clearance(self, points: Floats) -> Floats:
        """Signed distance to solids, shape (m,), metres, exact outside."""

    def clearance_range(self, points: Floats) -> tuple[Floats, Floats]:
        """Lowest and highest value that the clearance may have, each (m,), metres; cheap."""

    def zone_margin(self, points: Floats) -> Floats:
        """Signed distance to zones beyond what is kept, (m,), metres, infinite without any."""

    def capsule_clearance_at_least(self, a: Floats, b: Floats, radius: float) -> bool:
        """Whether no solid lies within ``radius`` of the segment, exact."""

    def zone_margin_at_least(self, a: Floats, b: Floats, margin: float) -> bool:
        """Whether the zone margin along the whole segment is proven to be so much."""
