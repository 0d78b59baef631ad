"""Preset ``paper``: local then global viewpoints with scanned marks (paper section 3.3.2)."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Floats
from planner.surface.samples import ScoredSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import direct_aim
from planner.viewpoints.confidence import pair_confidence
from planner.viewpoints.marks import ScanJob, Scanner, scan_cluster
from planner.viewpoints.pairs import visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints

_GRAZING = math.radians(89.0)  # the paper sets no limit but the fall of Eq. 7


def paper_viewpoints(
    positions: Floats,
    samples: ScoredSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    settings: ViewpointSettings,
    d_min: float,
    d_max: float,
    voxel: float,
    map: Callable[..., Any] = map,  # noqa: A002 - it is a map
) -> Viewpoints:
    """Choose local viewpoints for low-quality samples, then global ones for all.

    Clusters are scanned on their own, by ``map``. What they chose is then joined in the order
    of the clusters, the local viewpoints of all first: a position that an earlier cluster
    took, or a global one adjacent to it, is left out. At last one scan over all samples fills
    what is still short of marks. So neither the number of workers nor their order matters.

    Parameters
    ----------
    positions
        Free positions, shape (V, 3), metres, local frame.
    samples, caster, camera
        What is to be seen, what may be in the way, and with what.
    settings
        ``score_threshold``, ``local_views``, ``marks`` and ``exclusion_voxels``.
    d_min, d_max
        Of Eq. 6, metres.
    voxel
        Spacing of the positions, metres.
    map
        Runs :func:`~planner.viewpoints.marks.scan_cluster` over the clusters.

    Returns
    -------
    viewpoints
        The local ones first. Each aims at its target.

    """
    lengths = {"d_min": d_min, "d_max": d_max, "voxel": voxel}
    job = _job(positions, samples, caster, camera, settings=settings, **lengths)
    scanner = Scanner(job)
    parts = list(map(scan_cluster, _split(job, samples.cluster)))
    for kind in ("local", "global"):
        for part in parts:
            scanner.accept([view for view in part if view.kind == kind])
    chosen = scanner.fill()
    places = np.array([view.place for view in chosen], dtype=np.int64)
    targets = np.array([view.target for view in chosen], dtype=np.int64)
    yaw, pitch = direct_aim(positions[places], samples.xyz[targets], camera)
    kinds = tuple(view.kind for view in chosen)
    return Viewpoints(positions[places], yaw, pitch, kinds, targets)


def _job(
    positions: Floats,
    samples: ScoredSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    settings: ViewpointSettings,
    d_min: float,
    d_max: float,
    voxel: float,
) -> ScanJob:
    """Confidence (Eq. 8) of every pair, by sample."""
    from scipy.sparse import csr_array

    rule = SightRule(
        d_min=d_min,
        d_max=d_max,
        max_incidence=_GRAZING,
        low=math.radians(camera.pitch_min_deg),
        high=min(0.0, math.radians(camera.pitch_max_deg)),
    )
    pairs = visible_pairs(positions, samples, caster, rule)
    confidence = pair_confidence(
        pairs.distance,
        pairs.cosine,
        d_min=d_min,
        d_max=d_max,
        max_angle=math.radians(settings.confidence_angle_deg),
    )
    shape = (len(positions), len(samples))
    by_sample = csr_array((confidence, pairs.sample, pairs.indptr), shape=shape).tocsc()
    return ScanJob(
        positions=positions,
        xyz=samples.xyz,
        quality=samples.quality,
        indptr=by_sample.indptr.astype(np.int64),
        place=by_sample.indices.astype(np.int32),
        confidence=by_sample.data,
        spread=math.sin(0.5 * min(camera.horizontal_fov, camera.vertical_fov)),
        adjacency=settings.exclusion_voxels * voxel,
        threshold=settings.score_threshold,
        marks=settings.marks,
        each=settings.local_views == "each",
    )


def _split(job: ScanJob, cluster: np.ndarray) -> Iterator[ScanJob]:
    """One job a cluster, in order."""
    for key in np.unique(cluster):
        yield job.part(np.flatnonzero(cluster == key))
