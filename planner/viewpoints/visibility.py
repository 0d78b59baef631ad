"""What a set of chosen viewpoints really sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.config import ViewpointSettings
from planner.geometry.arrays import Ints
from planner.scene.cloud import Mesh
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.pairs import Aims, visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """What a set of viewpoints sees.

    Parameters
    ----------
    indptr, sample
        Samples that each viewpoint sees, CSR over the viewpoints.
    hits
        From how many distinct places each sample is seen, shape (S,).
    sectors
        From how many distinct direction sectors each sample is seen, shape (S,).

    """

    indptr: Ints
    sample: NDArray[np.int32]
    hits: Ints
    sectors: Ints


def coverage(
    viewpoints: Viewpoints,
    mesh: Mesh,
    samples: SurfaceSamples,
    camera: Camera,
    *,
    settings: ViewpointSettings,
    d_min: float,
    d_max: float,
    gsd: float,
) -> Coverage:
    """Cast fresh rays from any final set of viewpoints and count what they see.

    Parameters
    ----------
    viewpoints
        Any set of viewpoints, such as what is left after some were dropped.
    mesh
        Surface that may be in the way.
    samples
        What is to be seen.
    camera
        Decides what lies in each picture.
    settings, d_min, d_max, gsd
        Limits of a useful view; distances and ground sample distance in metres.

    """
    rule = SightRule.of(camera, settings, d_min=d_min, d_max=d_max, gsd=gsd)
    return count_views(viewpoints, samples, RayCaster(mesh), camera, rule)


def count_views(
    viewpoints: Viewpoints,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    rule: SightRule,
) -> Coverage:
    """Count as :func:`coverage` does, with a surface and limits that are already at hand.

    Photos taken at one place with several aims hit a sample once: they share no parallax.
    """
    aims = Aims(viewpoints.yaw_deg, viewpoints.pitch_deg, camera)
    pairs = visible_pairs(viewpoints.positions, samples, caster, rule, aims)
    owner, sample = pairs.position, pairs.sample
    place = np.unique(viewpoints.positions, axis=0, return_inverse=True)[1].reshape(-1)
    seen = np.unique(sample.astype(np.int64) * max(1, len(viewpoints)) + place[owner])
    return Coverage(
        pairs.indptr,
        sample,
        np.bincount(seen // max(1, len(viewpoints)), minlength=len(samples)),
        pairs.sides,
    )
