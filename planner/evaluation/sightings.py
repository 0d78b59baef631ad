"""What photos show of samples, by fresh rays."""

import math
from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import in_frustum
from planner.viewpoints.pairs import visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, pair_sums
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints

FACING = math.radians(70.0)
"""Incidence up to which photos match well."""
USEFUL = (math.radians(5.0), math.radians(30.0))
"""Angles between two rays that match well."""


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Every time that a photo shows a sample within 85 degrees of its normal.

    Parameters
    ----------
    size
        Number of samples.
    sample
        Sample of each sighting, shape (n,).
    rays
        Unit rays from sample to camera, shape (n, 3).
    distance
        Metres, shape (n,).
    cosine
        Cosine of the incidence, shape (n,).

    """

    size: int
    sample: Ints
    rays: Floats
    distance: Floats
    cosine: Floats

    @classmethod
    def of(
        cls,
        viewpoints: Viewpoints,
        samples: SurfaceSamples,
        caster: RayCaster,
        camera: Camera,
        *,
        reference: float,
    ) -> "Sightings":
        """Cast fresh rays from each photo to all in its picture, up to ``reference`` metres."""
        rule = SightRule(d_min=0.0, d_max=reference, max_incidence=GRAZING, sectors=1)
        pairs = visible_pairs(viewpoints.positions, samples, caster, rule)
        owner, sample = pairs.position, pairs.sample.astype(np.int64)
        rays = viewpoints.positions[owner] - samples.xyz[sample]
        inside = in_frustum(-rays, viewpoints.yaw_deg[owner], viewpoints.pitch_deg[owner], camera)
        sample, rays = sample[inside], rays[inside]
        distance = np.linalg.norm(rays, axis=1)
        rays /= distance[:, None]
        cosine = np.einsum("ij,ij->i", rays, samples.normals[sample])
        return cls(len(samples), sample, rays, distance, cosine)

    def facing(self) -> "Sightings":
        """Sightings within 70 degrees of the normal."""
        rows = self.cosine >= math.cos(FACING)
        return Sightings(
            self.size,
            self.sample[rows],
            rays=self.rays[rows],
            distance=self.distance[rows],
            cosine=self.cosine[rows],
        )

    def reconstructability(self, reference: float) -> Floats:
        """Benchmark heuristic h of each sample, by the exact formula, shape (size,)."""
        return pair_sums(
            self.sample,
            self.rays,
            self.distance,
            self.cosine,
            size=self.size,
            reference=reference,
        )

    def matchable(self) -> Bools:
        """Tell which samples have three facing photos, two of them 5 to 30 degrees apart."""
        near = self.facing()
        order = np.argsort(near.sample, kind="stable")
        sample, rays = near.sample[order], near.rays[order]
        count = np.bincount(sample, minlength=self.size)
        least, most = math.cos(USEFUL[1]), math.cos(USEFUL[0])
        found = np.zeros(self.size, dtype=np.bool_)
        for apart in range(1, int(count.max(initial=0))):  # sightings of a sample are neighbours
            first = np.flatnonzero(sample[apart:] == sample[:-apart])
            dot = np.einsum("ij,ij->i", rays[first], rays[first + apart])
            found[sample[first[(least <= dot) & (dot <= most)]]] = True
        return np.asarray(found & (count >= 3))

    def nearest(self) -> tuple[Floats, Floats]:
        """Distance of the nearest facing photo of each sample, and that over its cosine.

        Returns
        -------
        distance, stretched
            Metres, shape (size,); infinite where no photo faces the sample. The latter over the
            focal length in pixels is the ground sample distance.

        """
        near = self.facing()
        order = np.lexsort((near.distance, near.sample))
        sample, first = np.unique(near.sample[order], return_index=True)
        rows = order[first]
        distance, stretched = np.full((2, self.size), np.inf)
        distance[sample] = near.distance[rows]
        stretched[sample] = near.distance[rows] / near.cosine[rows]
        return distance, stretched
