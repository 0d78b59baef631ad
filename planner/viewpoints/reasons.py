"""Why a sample is covered, or why not."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Bytes, Ints
from planner.viewpoints.demand import Demand


class Reason(IntEnum):
    """What became of a sample; the values are the codes in the files."""

    COVERED = 0
    TOO_FEW_VIEWS = 1
    PARALLAX = 2
    GSD = 3
    OCCLUDED = 4
    NO_FREE_POSITION = 5
    GIMBAL = 6
    ZONE = 7

    @property
    def label(self) -> str:
        """Name in files and reports, such as ``too-few-views``."""
        return self.name.lower().replace("_", "-")


REASONS: tuple[str, ...] = tuple(reason.label for reason in Reason)
"""Names by code."""


def explain(
    hits: Ints,
    sectors: Ints,
    demand: Demand,
    stages: NDArray[np.int32],
    *,
    low: Bools | None = None,
    zoned: Bools | None = None,
) -> Bytes:
    """Say of each sample whether it is covered, and if not, what stands in the way first.

    Parameters
    ----------
    hits, sectors
        From how many places and sectors each sample is seen, shape (S,).
    demand
        What was wanted.
    stages
        From how many free positions each sample is within range and incidence, within the
        gimbal's range as well, within the GSD as well, and unoccluded, shape (4, S).
    low
        Which samples have a reconstructability below what was wanted, shape (S,).
    zoned
        Which samples would be seen but for a zone, the ceiling or the geofence, shape (S,);
        read only where no free position sees the sample.

    Returns
    -------
    codes
        A :class:`Reason` each, shape (S,): the first of these stages that no position
        passes; else ``TOO_FEW_VIEWS``, or ``PARALLAX`` where only the sectors are lacking.
        Too low a reconstructability is for lack of views where there are sectors enough.

    """
    facing, tilted, sharp, visible = stages
    enough = sectors >= demand.sectors
    low = np.zeros(len(hits), dtype=np.bool_) if low is None else low
    zoned = np.zeros(len(hits), dtype=np.bool_) if zoned is None else zoned
    conditions = [
        (hits >= demand.hits) & enough & ~low,
        (visible == 0) & zoned,
        facing == 0,
        tilted == 0,
        sharp == 0,
        visible == 0,
        (hits < demand.hits) | enough,
    ]
    codes = [
        Reason.COVERED,
        Reason.ZONE,
        Reason.NO_FREE_POSITION,
        Reason.GIMBAL,
        Reason.GSD,
        Reason.OCCLUDED,
        Reason.TOO_FEW_VIEWS,
    ]
    return np.select(conditions, codes, default=Reason.PARALLAX).astype(np.uint8)
