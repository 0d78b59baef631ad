"""Which samples each place sees, whatever the aim of its camera."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import camera_axes, picture_bounds
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule

_PAIRS = 2_000_000  # pairs looked at together: about 40 MB


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
        gimbal's range as well; within the GSD as well; and seen, shape (4, S).

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

    @property
    def sides(self) -> Ints:
        """From how many direction sectors each sample can be seen, shape (S,)."""
        return count_sectors(self.sample, self.sector, self.stages.shape[1])


@dataclass(frozen=True, slots=True, eq=False)
class Aims:
    """The one picture that is taken at each position.

    Parameters
    ----------
    yaw_deg, pitch_deg
        Degrees, shape (V,).
    camera
        Size of the pictures.

    """

    yaw_deg: Floats
    pitch_deg: Floats
    camera: Camera

    def part(self, rows: slice) -> "Aims":
        """Pictures of some positions."""
        return Aims(self.yaw_deg[rows], self.pitch_deg[rows], self.camera)

    def inside(
        self, positions: Floats, samples: Floats, indptr: Ints, sample: NDArray[np.int32]
    ) -> Bools:
        """Tell which pairs, CSR over the positions, are in the picture."""
        from planner.viewpoints.pair_kernels import in_pictures

        axes = np.ascontiguousarray(camera_axes(self.yaw_deg, self.pitch_deg))
        found = np.empty(len(sample), dtype=np.bool_)
        bounds = np.array(picture_bounds(self.camera))
        in_pictures(positions, samples, indptr, sample, axes, bounds, found)
        return found


def visible_pairs(
    positions: Floats,
    samples: SurfaceSamples,
    caster: RayCaster,
    rule: SightRule,
    aims: Aims | None = None,
) -> VisiblePairs:
    """Find every sample that each position sees, whatever the aim or in one picture.

    The direction sector of a pair tells from which side the sample is seen, so that hits in
    two sectors can triangulate. The sectors cut the cone of allowed incidence into equal solid
    angles: sector 0 is the cap around the sample's normal, where the azimuth would say little;
    the others divide the azimuth around the normal, from the level tangent. The cap of 8
    sectors within 70 degrees reaches to 23 degrees.

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
    aims
        Pictures outside of which nothing is seen; no rays are cast there.

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
            aims=None if aims is None else aims.part(slice(first, first + block)),
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
    aims: Aims | None,
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
            rule.cap,
        ]
    )
    positions = np.array(positions)  # one type: one compilation
    count = facing_pairs(
        positions,
        samples.xyz,
        samples.normals,
        _level_tangents(samples.normals),
        rows,
        limits,
        rule.sectors,
        indptr,
        sample,
        distance,
        cosine,
        sector,
        stages,
    )
    owner, keep = np.repeat(np.arange(len(positions)), np.diff(indptr)), np.arange(count)
    if aims is not None:
        keep = np.flatnonzero(aims.inside(positions, samples.xyz, indptr, sample[:count]))
    ends = positions.astype(np.float32)[owner[keep]]
    keep = keep[~caster.blocked(starts[sample[keep]], ends)]
    counts = np.bincount(owner[keep], minlength=len(positions))
    return counts, sample[keep], distance[keep], cosine[keep], sector[keep]


def _level_tangents(normals: Floats) -> Floats:
    """Level unit tangent of each normal, x where the normal is vertical, shape (S, 2)."""
    level = np.column_stack([-normals[:, 1], normals[:, 0]])
    length = np.linalg.norm(level, axis=1)
    upright = length < 1e-6
    level[upright], length[upright] = (1.0, 0.0), 1.0
    return np.asarray(level / length[:, None])


def count_sectors(sample: NDArray[np.int32], sector: NDArray[np.uint8], size: int) -> Ints:
    """How many distinct sectors each of ``size`` samples is seen from, shape (size,)."""
    seen = np.zeros((size, int(sector.max(initial=0)) + 1), dtype=np.bool_)
    seen[sample, sector] = True
    count: Ints = np.count_nonzero(seen, axis=1).astype(np.int64)
    return count
