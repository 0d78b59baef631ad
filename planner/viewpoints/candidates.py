"""Poses among which viewpoints are chosen, and what each sees."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.geometry.angles import yaw_pitch
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.demand import Demand
from planner.viewpoints.frustum import camera_axes, in_frustum, picture_bounds
from planner.viewpoints.pairs import VisiblePairs, count_sectors
from planner.viewpoints.viewpoints import Viewpoints

_WEIGHT_UNITS = 2.0**30  # of the heaviest sample


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Poses at free positions, with what they see as CSR over the poses.

    Parameters
    ----------
    positions
        Free positions, shape (V, 3), metres, local frame.
    pairs
        What each position sees whatever the aim.
    owner
        Position of each candidate, shape (K,), ascending.
    yaw_deg, pitch_deg
        Aim of each candidate, degrees, shape (K,).
    indptr
        Start of each candidate's hits, shape (K + 1,).
    pair
        Row in ``pairs`` of each hit, shape (nnz,); samples ascend within a candidate.

    """

    positions: Floats
    pairs: VisiblePairs
    owner: Ints
    yaw_deg: Floats
    pitch_deg: Floats
    indptr: Ints
    pair: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.owner)

    @property
    def sample(self) -> NDArray[np.int32]:
        """Sample of each hit, shape (nnz,)."""
        return self.pairs.sample[self.pair]

    def row(self, candidate: int) -> NDArray[np.int32]:
        """Rows in ``pairs`` that one candidate hits."""
        return self.pair[self.indptr[candidate] : self.indptr[candidate + 1]]

    def viewpoints(self, chosen: Ints, samples: SurfaceSamples, *, kind: str) -> Viewpoints:
        """Viewpoints of the chosen candidates; the target is the sample nearest the axis."""
        positions = self.positions[self.owner[chosen]]
        yaw, pitch = self.yaw_deg[chosen], self.pitch_deg[chosen]
        forward = camera_axes(yaw, pitch)[..., 2, :]
        targets = np.full(len(chosen), -1)
        for number, candidate in enumerate(chosen):  # few: the viewpoints of a plan
            seen = self.pairs.sample[self.row(candidate)]
            if len(seen):
                rays = samples.xyz[seen] - positions[number]
                along = rays @ forward[number] / np.linalg.norm(rays, axis=1)
                targets[number] = seen[np.argmax(along)]
        return Viewpoints(positions, yaw, pitch, (kind,) * len(chosen), targets)


def aim_directions(count: int, camera: Camera) -> tuple[Floats, Floats]:
    """Yaw and pitch, degrees, of quasi-uniform directions within the gimbal's range.

    A Fibonacci lattice on the part of the sphere that the gimbal reaches; its lowest
    direction is moved onto the lower limit, which is nadir for most cameras.
    """
    low, high = (math.sin(math.radians(p)) for p in (camera.pitch_min_deg, camera.pitch_max_deg))
    rank = np.arange(count)
    rise = low + (rank + 0.5) / count * (high - low)
    pitch: Floats = np.degrees(np.arcsin(rise.clip(-1.0, 1.0)))
    pitch[0] = camera.pitch_min_deg
    golden = 180.0 * (3.0 - math.sqrt(5.0))
    yaw: Floats = 180.0 - (rank.astype(np.float64) * golden) % 360.0
    return yaw, pitch


def generate_candidates(
    positions: Floats,
    pairs: VisiblePairs,
    samples: SurfaceSamples,
    camera: Camera,
    *,
    aims: int,
    directions: int,
    weights: Floats,
) -> Candidates:
    """Give each position its best aims, chosen greedily by the weight newly seen.

    Parameters
    ----------
    positions, pairs, samples, camera
        Where photos may be taken, and what each place sees.
    aims
        Most aims a position; fewer where they see nothing new.
    directions
        Size of the set of directions to choose from, at most 64.
    weights
        Worth of seeing each sample, positive, shape (S,).

    """
    from planner.viewpoints.aim_kernels import best_aims, list_pairs

    yaw, pitch = aim_directions(directions, camera)
    whole = np.rint(weights * (_WEIGHT_UNITS / weights.max(initial=1.0))).astype(np.int64)
    chosen = np.empty((len(positions), aims), dtype=np.int16)
    sizes = np.empty((len(positions), aims), dtype=np.int64)
    masks = np.empty(len(pairs), dtype=np.uint64)
    best_aims(
        *(np.array(positions), samples.xyz, pairs.indptr, pairs.sample),
        *(camera_axes(yaw, pitch), np.array(picture_bounds(camera)), whole),
        *(chosen, sizes, masks),
    )
    owner, turn = np.nonzero(chosen >= 0)
    aim = chosen[owner, turn]
    indptr = np.concatenate([[0], np.cumsum(sizes[owner, turn])])
    pair = np.empty(indptr[-1], dtype=np.int32)
    list_pairs(pairs.indptr, masks, owner, aim, pair)
    return Candidates(positions, pairs, owner, yaw[aim], pitch[aim], indptr, pair)


def add_direct_aims(
    candidates: Candidates, samples: SurfaceSamples, camera: Camera, demand: Demand
) -> Candidates:
    """Aim straight at samples whose demand the candidates miss though the positions allow it.

    Parameters
    ----------
    candidates
        What there is.
    samples, camera
        As in :func:`generate_candidates`.
    demand
        From how many places and sectors each sample is wanted, where the positions allow.

    Returns
    -------
    candidates
        The same with poses added at the end, the most frontal ones first.

    """
    pairs = candidates.pairs
    held = np.zeros(len(pairs), dtype=np.bool_)
    held[candidates.pair] = True
    reachable = demand.clipped(pairs.available, pairs.sides)
    frontal = most_frontal(pairs, held, reachable.hits)
    spare = np.union1d(frontal, _new_sides(pairs, held, reachable.sectors))
    if not len(spare):
        return candidates
    owner = np.searchsorted(pairs.indptr, spare, side="right") - 1
    yaw, pitch = direct_aim(candidates.positions[owner], samples.xyz[pairs.sample[spare]], camera)
    return add_poses(candidates, samples, camera, owner=owner, yaw_deg=yaw, pitch_deg=pitch)


def add_poses(
    candidates: Candidates,
    samples: SurfaceSamples,
    camera: Camera,
    *,
    owner: Ints,
    yaw_deg: Floats,
    pitch_deg: Floats,
) -> Candidates:
    """Append poses at given positions with given aims, each of shape (n,)."""
    pairs = candidates.pairs
    rows = []
    for place, turn, tilt in zip(owner, yaw_deg, pitch_deg, strict=True):  # few
        at = np.arange(pairs.indptr[place], pairs.indptr[place + 1])
        rays = samples.xyz[pairs.sample[at]] - candidates.positions[place]
        rows.append(at[in_frustum(rays, turn, tilt, camera)].astype(np.int32))
    return Candidates(
        candidates.positions,
        pairs,
        np.concatenate([candidates.owner, owner]),
        np.concatenate([candidates.yaw_deg, yaw_deg]),
        np.concatenate([candidates.pitch_deg, pitch_deg]),
        np.concatenate([candidates.indptr, candidates.indptr[-1] + np.cumsum([*map(len, rows)])]),
        np.concatenate([candidates.pair, *rows]),
    )


def most_frontal(pairs: VisiblePairs, held: Bools, want: Ints) -> Ints:
    """Unheld pairs to hold so that each sample is held from as many places as wanted."""
    lack = want - np.bincount(pairs.sample[held], minlength=len(want))
    spare = np.flatnonzero((lack > 0)[pairs.sample] & ~held)
    spare = spare[np.lexsort((spare, -pairs.cosine[spare], pairs.sample[spare]))]
    rank = np.arange(len(spare)) - np.searchsorted(pairs.sample[spare], pairs.sample[spare])
    return spare[rank < lack[pairs.sample[spare]]]


def _new_sides(pairs: VisiblePairs, held: Bools, want: Ints) -> Ints:
    """The most frontal unheld pair of each new side of samples that lack sides."""
    lack = want - count_sectors(pairs.sample[held], pairs.sector[held], len(want))
    spare = np.flatnonzero((lack > 0)[pairs.sample] & ~held)
    side = pairs.sample[spare].astype(np.int64) * 256 + pairs.sector[spare]
    order = np.lexsort((spare, -pairs.cosine[spare], side))
    return spare[order][np.unique(side[order], return_index=True)[1]]


def direct_aim(positions: Floats, points: Floats, camera: Camera) -> tuple[Floats, Floats]:
    """Yaw and pitch that look at each point, the pitch as far as the gimbal goes."""
    yaw, pitch = yaw_pitch(points - positions)
    return yaw, pitch.clip(camera.pitch_min_deg, camera.pitch_max_deg)
