"""What photos that are moved see from a place, and how it adds up."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Samples that places see, place by place.

    Parameters
    ----------
    owner
        Place of each row, shape (n,), ascending.
    sample
        Its sample, shape (n,).
    sight
        Unit ray from sample to place, nearness 1 - l / d_ref, and cosine, shape (n, 5).

    """

    owner: Ints
    sample: NDArray[np.int32]
    sight: Floats

    def rows(self, keep: Bools | Ints | slice) -> "Seen":
        """Some of the rows."""
        return Seen(self.owner[keep], self.sample[keep], self.sight[keep])


@dataclass(frozen=True, slots=True, eq=False)
class Hunger:
    """Which samples are wanted from which place.

    Parameters
    ----------
    flags
        Which samples each member wants, shape (B, S).
    rows
        Those that any of them wants, ascending, shape (n,).
    member
        Member that each place is for, shape (m,).

    """

    flags: Bools
    rows: Ints
    member: Ints


@dataclass(frozen=True, eq=False)
class Eye:
    """Sees samples from places, whatever the aim.

    Parameters
    ----------
    samples, caster, rule
        What is to be seen, what may be in the way, and what counts.
    reference
        Distance at which a view is worth nothing, metres.

    """

    samples: SurfaceSamples
    caster: RayCaster
    rule: SightRule
    reference: float

    @cached_property
    def _starts(self) -> NDArray[np.float32]:
        samples = self.samples
        return self.caster.lift(samples.xyz, samples.normals, radius=samples.radius)

    def see(self, places: Floats, hunger: Hunger | None = None) -> Seen:
        """Look from places, (m, 3), at all samples, or at what is wanted from each."""
        from planner.viewpoints.pair_kernels import facing_pairs

        samples, rule = self.samples, self.rule
        rows = np.arange(len(samples)) if hunger is None else hunger.rows
        size, most = len(samples), len(places) * len(rows)
        indptr = np.empty(len(places) + 1, dtype=np.int64)
        sample, sector = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.uint8)
        distance, cosine = np.empty((2, most), dtype=np.float32)
        low, high = np.sin(rule.low), np.sin(rule.high)
        least = np.cos(rule.max_incidence)
        limits = np.array([rule.d_min, rule.d_max, least, rule.reach, low, high, 0.0])
        tangents, stages = np.zeros((size, 2)), np.zeros((4, size), dtype=np.int32)
        count = facing_pairs(
            *(np.array(places), samples.xyz, samples.normals, tangents, rows, limits, 1),
            *(indptr, sample, distance, cosine, sector, stages),
        )
        owner = np.repeat(np.arange(len(places)), np.diff(indptr))
        keep = np.arange(count)
        if hunger is not None:
            keep = np.flatnonzero(hunger.flags[hunger.member[owner], sample[:count]])
        ends = places.astype(np.float32)[owner[keep]]
        keep = keep[~self.caster.blocked(self._starts[sample[keep]], ends)]
        owner, sample = owner[keep], sample[keep]
        length = distance[keep].astype(np.float64)[:, None]
        rays = (places[owner] - samples.xyz[sample]) / length
        return Seen(
            owner, sample, np.hstack([rays, 1.0 - length / self.reference, cosine[keep, None]])
        )


@dataclass(frozen=True, eq=False)
class Album:
    """What all views see, sample by sample.

    Parameters
    ----------
    starts
        First row of each sample, shape (S + 1,).
    owner
        View of each row, shape (n,).
    sight
        As in :class:`Seen`, shape (n, 5).

    """

    starts: Ints
    owner: Ints
    sight: Floats

    @classmethod
    def of(cls, seen: Seen, size: int) -> "Album":
        """Sort what views see by the samples, of which there are ``size``."""
        from planner.viewpoints.move_kernels import by_sample

        return cls(*by_sample(seen.sample, seen.owner, seen.sight, size))
