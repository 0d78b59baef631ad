"""Which samples each place, and each chosen viewpoint, really sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.config import ViewpointSettings
from planner.geometry.arrays import Floats, Ints
from planner.scene.cloud import Mesh
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import in_frustum
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints

_PAIRS = 2_000_000  # pairs looked at together: about 40 MB
_CAP_DEG = 10.0  # rays this close to the normal share a sector


@dataclass(frozen=True, slots=True, eq=False)
class VisiblePairs:
    """Unoccluded position-sample pairs as CSR over the positions.

    Parameters
    ----------
    indptr
        Start of each position's pairs, shape (V + 1,).
    sample
        Sample of each pair, ascending within a position, shape (n,).
    distance
        Metres, shape (n,).
    cosine
        Cosine of the incidence, shape (n,).
    sector
        Direction sector that the sample is seen from, shape (n,); see :func:`visible_pairs`.
    stages
        From how many positions each sample is within range and incidence; within the
        gimbal's range as well; within the GSD as well; and unoccluded, shape (4, S).

    """

    indptr: Ints
    sample: NDArray[np.int32]
    distance: NDArray[np.float32]
    cosine: NDArray[np.float32]
    sector: NDArray[np.uint8]
    stages: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.sample)

    @property
    def position(self) -> NDArray[np.int32]:
        """Position of each pair, shape (n,)."""
        return np.repeat(np.arange(len(self.indptr) - 1, dtype=np.int32), np.diff(self.indptr))

    @property
    def available(self) -> NDArray[np.int32]:
        """From how many positions each sample can be seen, shape (S,)."""
        count: NDArray[np.int32] = self.stages[3]
        return count


def visible_pairs(
    positions: Floats, samples: SurfaceSamples, caster: RayCaster, rule: SightRule
) -> VisiblePairs:
    """Find every sample that each position sees, whatever the aim.

    The direction sector of a pair tells from which side the sample is seen, so that hits in
    two sectors can triangulate: sector 0 is the cap of 10 degrees around the sample's normal,
    the others divide the azimuth around the normal evenly, from the level tangent.

    Parameters
    ----------
    positions
        Shape (V, 3), metres, local frame.
    samples
        What is to be seen.
    caster
        Surface that may be in the way.
    rule
        Limits on range, incidence, elevation and GSD.

    """
    stages = np.zeros((4, len(samples)), dtype=np.int32)
    starts = caster.lift(samples.xyz, samples.normals, radius=samples.radius)
    block = max(1, _PAIRS // max(1, len(samples)))
    parts = [
        _block(
            positions[first : first + block],
            samples,
            starts=starts,
            caster=caster,
            rule=rule,
            stages=stages,
        )
        for first in range(0, len(positions), block)
    ]
    counts = np.concatenate([np.empty(0, dtype=np.int64), *(part[0] for part in parts)])
    sample, distance, cosine, sector = (
        np.concatenate([np.empty(0, dtype=dtype), *(part[column] for part in parts)])
        for column, dtype in ((1, np.int32), (2, np.float32), (3, np.float32), (4, np.uint8))
    )
    stages[3] = np.bincount(sample, minlength=len(samples))
    indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return VisiblePairs(indptr, sample, distance, cosine, sector, stages)


def _block(
    positions: Floats,
    samples: SurfaceSamples,
    *,
    starts: NDArray[np.float32],
    caster: RayCaster,
    rule: SightRule,
    stages: NDArray[np.int32],
) -> tuple[Ints, NDArray[np.int32], NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8]]:
    """Pairs a position, sample, distance, cosine and sector of the visible pairs of a block."""
    from planner.viewpoints.pair_kernels import facing_pairs

    low, high = positions.min(axis=0) - rule.d_max, positions.max(axis=0) + rule.d_max
    rows = np.flatnonzero(((low <= samples.xyz) & (samples.xyz <= high)).all(axis=1))
    most = len(positions) * len(rows)
    indptr = np.empty(len(positions) + 1, dtype=np.int64)
    sample, sector = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.uint8)
    distance, cosine = np.empty((2, most), dtype=np.float32)
    limits = np.array(
        [
            rule.d_min,
            rule.d_max,
            np.cos(rule.max_incidence),
            rule.reach,
            np.sin(rule.low),
            np.sin(rule.high),
            np.cos(np.radians(_CAP_DEG)),
        ]
    )
    count = facing_pairs(
        *(np.ascontiguousarray(positions), samples.xyz, samples.normals),
        *(_level_tangents(samples.normals), rows, limits, rule.sectors),
        *(indptr, sample, distance, cosine, sector, stages),
    )
    owner = np.repeat(np.arange(len(positions)), np.diff(indptr))
    ends = positions.astype(np.float32)[owner]
    clear = ~caster.blocked(starts[sample[:count]], ends)
    counts = np.bincount(owner[clear], minlength=len(positions))
    return (
        counts,
        sample[:count][clear],
        distance[:count][clear],
        cosine[:count][clear],
        sector[:count][clear],
    )


def _level_tangents(normals: Floats) -> Floats:
    """Level unit tangent of each normal, x where the normal is vertical, shape (S, 2)."""
    level = np.column_stack([-normals[:, 1], normals[:, 0]])
    length = np.linalg.norm(level, axis=1)
    upright = length < 1e-6
    level[upright], length[upright] = (1.0, 0.0), 1.0
    return np.asarray(level / length[:, None])


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
    """Do the work of :func:`coverage` with a surface and limits that are already at hand.

    Photos taken at one place with several aims hit a sample once: they share no parallax.
    """
    pairs = visible_pairs(viewpoints.positions, samples, caster, rule)
    owner = pairs.position
    rays = samples.xyz[pairs.sample] - viewpoints.positions[owner]
    yaw, pitch = viewpoints.yaw_deg[owner], viewpoints.pitch_deg[owner]
    inside = in_frustum(rays, yaw, pitch, camera)
    owner, sample = owner[inside], pairs.sample[inside]
    place = np.unique(viewpoints.positions, axis=0, return_inverse=True)[1].reshape(-1)
    counts = np.bincount(owner, minlength=len(viewpoints))
    return Coverage(
        np.concatenate([[0], np.cumsum(counts)]),
        sample,
        count_distinct(sample, place[owner], len(samples)),
        count_distinct(sample, pairs.sector[inside], len(samples)),
    )


def count_distinct(element: NDArray[np.integer], label: NDArray[np.integer], size: int) -> Ints:
    """How many distinct labels each of ``size`` elements carries, shape (size,)."""
    if not len(element):
        return np.zeros(size, dtype=np.int64)
    label = label.astype(np.int64)
    unique = np.unique(element.astype(np.int64) * (label.max() + 1) + label)
    return np.bincount(unique // (label.max() + 1), minlength=size)
