"""What two photos have in common, and whether that is enough to match them."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import Coverage


@dataclass(frozen=True, slots=True)
class LinkRule:
    """What two photos must have in common to be matched.

    Parameters
    ----------
    shared_share
        Least share of the smaller view's samples that both see. On small plans, half of
        the smaller view stands in for ``shared_least`` where that is less.
    shared_least
        Least number of samples that both see.
    max_turn_deg
        Largest angle between the two view directions, degrees.
    max_scale
        Largest ratio between the median distances to what each sees.

    """

    shared_share: float = 0.3
    shared_least: int = 15
    max_turn_deg: float = 40.0
    max_scale: float = 2.0

    @classmethod
    def of(cls, settings: ViewpointSettings) -> "LinkRule":
        """Rule of the settings."""
        return cls(
            settings.link_share, settings.link_least, settings.link_turn_deg, settings.link_scale
        )


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """What each of some photos shows, and how.

    Parameters
    ----------
    shows
        Which samples each shows: scipy CSR of ones, whole numbers, shape (A, S).
    axes
        Unit view directions, shape (A, 3).
    scale
        Median distance to what each shows, over its focal length where these differ, shape
        (A,); infinite where it shows nothing.

    """

    shows: Any
    axes: Floats
    scale: Floats

    @property
    def sizes(self) -> Ints:
        """Number of samples that each shows, shape (A,)."""
        return np.asarray(np.diff(self.shows.indptr), dtype=np.int64)

    @classmethod
    def of(
        cls,
        viewpoints: Viewpoints,
        seen: Coverage,
        samples: SurfaceSamples,
        *,
        focal_px: float = 1.0,
    ) -> "Shown":
        """What viewpoints show whose samples are known already."""
        from scipy.sparse import csr_array

        ones = np.ones(len(seen.sample), dtype=np.int64)  # bool @ bool would stay bool
        shape = (len(viewpoints), len(samples))
        scale = _median_distances(viewpoints, seen, samples) / focal_px
        shows = csr_array((ones, seen.sample, seen.indptr), shape=shape)
        return cls(shows, viewpoints.directions, scale)


@dataclass(frozen=True, slots=True, eq=False)
class Likeness:
    """What photos of two groups have in common; all arrays have shape (A, B).

    Parameters
    ----------
    shared
        Samples that both show.
    smaller
        Samples that the one shows which shows fewer.
    cosine
        Of the angle between the view directions.
    ratio
        Between the coarser and the finer scale, at least 1; infinite if one shows nothing.

    """

    shared: Ints
    smaller: Ints
    cosine: Floats
    ratio: Floats

    @classmethod
    def between(cls, first: Shown, second: Shown) -> "Likeness":
        """Compare each photo of one group with each of the other."""
        coarse = np.maximum(first.scale[:, None], second.scale[None, :])
        fine = np.minimum(first.scale[:, None], second.scale[None, :])
        ratio = np.full(coarse.shape, np.inf)
        np.divide(coarse, fine, out=ratio, where=np.isfinite(coarse) & (fine > 0.0))
        return cls(
            (first.shows @ second.shows.T).toarray(),
            np.minimum(first.sizes[:, None], second.sizes[None, :]),
            first.axes @ second.axes.T,
            ratio,
        )

    @property
    def turn_deg(self) -> Floats:
        """Angles between the view directions, degrees."""
        return np.asarray(np.degrees(np.arccos(np.clip(self.cosine, -1.0, 1.0))))

    def least(self, links: LinkRule) -> Floats:
        """Samples that each pair must share."""
        few = np.minimum(links.shared_least, 0.5 * self.smaller)
        return np.asarray(np.maximum(links.shared_share * self.smaller, few))

    def matching(self, links: LinkRule) -> Bools:
        """Which pairs can be matched."""
        enough = (self.shared >= self.least(links)) & (self.shared > 0)
        alike = self.cosine >= math.cos(math.radians(links.max_turn_deg))
        return np.asarray(enough & alike & (self.ratio <= links.max_scale))

    def lack(self, links: LinkRule) -> Floats:
        """By what factor the worst condition is missed; infinite where nothing is shared."""
        shared = np.full(self.shared.shape, np.inf)
        np.divide(self.least(links), self.shared, out=shared, where=self.shared > 0)
        turned = self.turn_deg / links.max_turn_deg
        return np.asarray(np.maximum(np.maximum(shared, turned), self.ratio / links.max_scale))

    def faults(self, first: int, second: int, links: LinkRule) -> list[str]:
        """Say which conditions one pair does not meet, with their numbers."""
        ratio, shared = self.ratio[first, second], int(self.shared[first, second])
        turn = self.turn_deg[first, second]
        least = int(np.ceil(self.least(links)[first, second]))
        found = []
        if ratio > links.max_scale:
            found.append(f"scale ratio {ratio:.2f} > {links.max_scale:g}")
        if turn > links.max_turn_deg:
            found.append(f"axes {turn:.1f} > {links.max_turn_deg:g} degrees apart")
        if shared < least:
            found.append(f"{shared} < {least} samples shown by both")
        return found


def _median_distances(viewpoints: Viewpoints, seen: Coverage, samples: SurfaceSamples) -> Floats:
    """Median distance from each viewpoint to what it sees, metres; infinite if nothing."""
    medians = np.full(len(viewpoints), np.inf)
    for row, position in enumerate(viewpoints.positions):  # few: the photos of a plan
        rows = seen.sample[seen.indptr[row] : seen.indptr[row + 1]]
        if len(rows):
            medians[row] = np.median(np.linalg.norm(samples.xyz[rows] - position, axis=1))
    return medians
