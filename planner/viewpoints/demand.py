"""How many photos, from how many sides, each sample wants."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.config import ViewpointSettings
from planner.geometry.arrays import Floats, Ints
from planner.surface.samples import SurfaceSamples


@dataclass(frozen=True, slots=True, eq=False)
class Demand:
    """Photos wanted of each sample.

    Parameters
    ----------
    hits
        From how many distinct places, shape (S,).
    sectors
        From how many distinct direction sectors, shape (S,).

    """

    hits: Ints
    sectors: Ints

    def clipped(self, hits: NDArray[np.integer], sectors: NDArray[np.integer]) -> "Demand":
        """As much of the demand as so many places and sectors, shape (S,) each, can give."""
        return Demand(np.minimum(self.hits, hits), np.minimum(self.sectors, sectors))


def view_demand(quality: Floats, settings: ViewpointSettings) -> Demand:
    """Wanted photos of each sample by preset ``cover``.

    Parameters
    ----------
    quality
        Quality of the prior around each sample, shape (S,), in [0, 1]; 0 is worst.
    settings
        ``hits`` and ``sectors`` for all; the worst ``low_quality_share`` get
        ``extra_hits`` more, or none if all are equally good.

    """
    hits = np.full(len(quality), settings.hits, dtype=np.int64)
    if len(quality) and settings.low_quality_share > 0.0:
        limit = np.quantile(quality, settings.low_quality_share)
        hits[(quality <= limit) & (quality < quality.max())] += settings.extra_hits
    return Demand(hits, np.full(len(quality), settings.sectors, dtype=np.int64))


def sharp_demand(available: NDArray[np.integer], settings: ViewpointSettings) -> Demand:
    """Wanted photos where reconstructability is the objective: a few sharp ones.

    Parameters
    ----------
    available
        From how many positions each sample can be seen sharply, shape (S,).
    settings
        ``sharp_views`` of the ``sharp_share`` of those that any position sees sharply: of those
        that most positions do, the first ones on ties. Samples that no position sees sharply
        want them as well, in vain.

    """
    wanted = np.full(len(available), settings.sharp_views, dtype=np.int64)
    can = int(np.count_nonzero(available))
    easiest = np.argsort(-available.astype(np.int64), kind="stable")[:can]
    wanted[easiest[math.ceil(settings.sharp_share * can - 1e-9) :]] = 0
    return Demand(wanted, np.zeros_like(wanted))


def even_demand(samples: SurfaceSamples, settings: ViewpointSettings) -> Demand:
    """Wanted photos by preset ``paper``: as many as marks, from any side."""
    wanted = np.full(len(samples), settings.marks, dtype=np.int64)
    return Demand(wanted, np.zeros_like(wanted))
