"""Free space as balls around free positions: cheap, certain, and easy to send to a process."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from planner.airspace.airspace import Airspace
from planner.airspace.candidates import SPARE
from planner.geometry.arrays import Floats


@dataclass(frozen=True, eq=False)
class FreeBalls:
    """Balls in which every point is free.

    Parameters
    ----------
    centres
        Free positions, shape (V, 3), metres.
    radii
        How far from each centre it is free at least, shape (V,), metres.

    """

    centres: Floats
    radii: Floats

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.centres)

    def __getstate__(self) -> dict[str, Any]:
        """Fields only: each process builds its own tree."""
        return {name: vars(self)[name] for name in self.__dataclass_fields__}

    def nearest(self, points: Floats) -> Floats:
        """Move points, (m, 3), into the ball of the nearest centre where they are outside."""
        away, row = self._tree.query(points)
        centre = self.centres[row]
        share = np.minimum(1.0, self.radii[row] / np.maximum(away, 1e-12))
        return np.asarray(centre + share[:, None] * (points - centre))


def free_balls(positions: Floats, airspace: Airspace | None, *, margin: float) -> FreeBalls:
    """Balls around free positions as large as clearance, zones and bounds allow.

    Clearance and zone margin change by at most a metre a metre, so that all of a ball keeps
    ``margin`` metres beyond ``d_min`` and from zones, as the flight will, and a little more.
    Without an airspace nothing but the positions themselves is known to be free.
    """
    if airspace is None:
        return FreeBalls(positions, np.zeros(len(positions)))
    low, high = airspace.bounds
    room = np.minimum(positions - low, high - positions).min(axis=1)
    room = np.minimum(room, airspace.clearance(positions) - airspace.d_min)
    room = np.minimum(room, airspace.zone_margin(positions)) - (margin + SPARE)
    return FreeBalls(positions, np.maximum(room, 0.0))
