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
    alike: Bools | None = None,
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
        From how many free positions each sample is within range and incidence, unoccluded as
        well, within the gimbal's range as well, and within the GSD as well, shape (4, S).
    low
        Which samples have a reconstructability below what was wanted, shape (S,).
    alike
        Which of those would have enough if their rays met at better angles, shape (S,).
    zoned
        Which samples would be seen but for a zone, the ceiling or the geofence, shape (S,);
        read only where no free position sees the sample.

    Returns
    -------
    codes
        A :class:`Reason` each, shape (S,): the first of these stages that no position
        passes; else ``TOO_FEW_VIEWS``, or ``PARALLAX`` where there are views enough but their
        directions are too few or too much alike.

    """
    facing, clear, tilted, sharp = stages
    none = np.zeros(len(hits), dtype=np.bool_)
    low = none if low is None else low
    alike = none if alike is None else alike
    enough = sectors >= demand.sectors
    conditions = [
        (hits >= demand.hits) & enough & ~low,
        (sharp == 0) & (none if zoned is None else zoned),
        facing == 0,
        clear == 0,
        tilted == 0,
        sharp == 0,
        (hits < demand.hits) | (enough & ~alike),
    ]
    codes = [
        Reason.COVERED,
        Reason.ZONE,
        Reason.NO_FREE_POSITION,
        Reason.OCCLUDED,
        Reason.GIMBAL,
        Reason.GSD,
        Reason.TOO_FEW_VIEWS,
    ]
    return np.select(conditions, codes, default=Reason.PARALLAX).astype(np.uint8)
