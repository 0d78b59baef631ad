"""Poses to choose from by what pairs of them see, wherever they come from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import Candidates
from planner.viewpoints.frustum import camera_axes
from planner.viewpoints.pairs import Aims, visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints


@dataclass(frozen=True, slots=True, eq=False)
class Pool:
    """Poses with what each sees, as CSR over the poses.

    Parameters
    ----------
    positions
        Shape (K, 3), metres, local frame.
    yaw_deg, pitch_deg
        Aims, degrees, shape (K,).
    indptr
        Start of each pose's hits, shape (K + 1,).
    sample
        Sample of each hit, ascending within a pose, shape (n,).
    distance, cosine
        Metres, and cosine of the incidence, of each hit, shape (n,).

    """

    positions: Floats
    yaw_deg: Floats
    pitch_deg: Floats
    indptr: Ints
    sample: NDArray[np.int32]
    distance: NDArray[np.float32]
    cosine: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.yaw_deg)

    @classmethod
    def of(cls, candidates: Candidates) -> "Pool":
        """Poses at positions with several aims each."""
        pairs, hit = candidates.pairs, candidates.pair
        return cls(
            candidates.positions[candidates.owner],
            candidates.yaw_deg,
            candidates.pitch_deg,
            candidates.indptr,
            *(pairs.sample[hit], pairs.distance[hit], pairs.cosine[hit]),
        )

    @classmethod
    def at(
        cls,
        positions: Floats,
        yaw_deg: Floats,
        pitch_deg: Floats,
        *,
        samples: SurfaceSamples,
        caster: RayCaster,
        camera: Camera,
        rule: SightRule,
    ) -> "Pool":
        """Any poses, by fresh rays.

        Parameters
        ----------
        positions, yaw_deg, pitch_deg
            The poses; shapes (K, 3), (K,) and (K,).
        samples, caster, camera, rule
            What may be seen, what may be in the way, the field of view, and what counts.

        """
        aims = Aims(yaw_deg, pitch_deg, camera)
        pairs = visible_pairs(positions, samples, caster, rule, aims)
        hits = (pairs.indptr, pairs.sample, pairs.distance, pairs.cosine)
        return cls(positions, yaw_deg, pitch_deg, *hits)

    def take(self, rows: Ints) -> "Pool":
        """Poses of these rows, in this order."""
        sizes = np.diff(self.indptr)[rows]
        indptr = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        hit = np.repeat(self.indptr[rows] - indptr[:-1], sizes) + np.arange(indptr[-1])
        return Pool(
            *(self.positions[rows], self.yaw_deg[rows], self.pitch_deg[rows], indptr),
            *(self.sample[hit], self.distance[hit], self.cosine[hit]),
        )

    def joined(self, others: "Pool") -> "Pool":
        """These poses, then the others."""
        return Pool(
            np.concatenate([self.positions, others.positions]),
            np.concatenate([self.yaw_deg, others.yaw_deg]),
            np.concatenate([self.pitch_deg, others.pitch_deg]),
            np.concatenate([self.indptr, self.indptr[-1] + others.indptr[1:]]),
            np.concatenate([self.sample, others.sample]),
            np.concatenate([self.distance, others.distance]),
            np.concatenate([self.cosine, others.cosine]),
        )

    def beside(self, others: "Pool", first: int) -> "Pool":
        """The same poses with the hits of others too, whose samples are counted from ``first``."""
        owner = np.repeat(np.arange(len(self)), np.diff(self.indptr))
        more = np.repeat(np.arange(len(self)), np.diff(others.indptr))
        order = np.argsort(np.concatenate([owner, more]), kind="stable")
        sample = np.concatenate([self.sample, others.sample + np.int32(first)])
        return Pool(
            *(self.positions, self.yaw_deg, self.pitch_deg, self.indptr + others.indptr),
            sample[order],
            np.concatenate([self.distance, others.distance])[order],
            np.concatenate([self.cosine, others.cosine])[order],
        )

    def rays(self, samples: SurfaceSamples) -> NDArray[np.float32]:
        """Unit vectors from sample to camera of each hit, shape (n, 3)."""
        from planner.viewpoints.pair_kernels import unit_rays

        rays = np.empty((len(self.sample), 3), dtype=np.float32)
        unit_rays(np.array(self.positions), samples.xyz, self.indptr, self.sample, rays)
        return rays

    def viewpoints(self, chosen: Ints, samples: SurfaceSamples, *, kind: str) -> Viewpoints:
        """Viewpoints of chosen rows; the target of each is the sample nearest its axis."""
        part = self.take(chosen)
        forward = camera_axes(part.yaw_deg, part.pitch_deg)[..., 2, :]
        targets = np.full(len(chosen), -1)
        for row in np.flatnonzero(np.diff(part.indptr)):  # few: the viewpoints of a plan
            seen = part.sample[part.indptr[row] : part.indptr[row + 1]]
            rays = samples.xyz[seen] - part.positions[row]
            targets[row] = seen[np.argmax(rays @ forward[row] / np.linalg.norm(rays, axis=1))]
        names = (kind,) * len(chosen)
        return Viewpoints(part.positions, part.yaw_deg, part.pitch_deg, names, targets)
