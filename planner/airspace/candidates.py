"""Where photos may be taken from: centres of voxels that are free and near enough (3.3.1)."""

from dataclasses import dataclass

import numpy as np

from planner.airspace.airspace import Airspace
from planner.config import FLIGHT_MARGIN
from planner.geometry.arrays import Floats, Ints, read_only
from planner.scene.scene import Box

SPARE = 3e-3
"""Metres kept beyond the flight's margin: more than rounding and measuring anew can cost."""

_MOST_VOXELS = 4_000_000  # in the whole box, free or not
_FIRST_LOOK = 20_000  # voxels of the coarse lattice that the free volume is guessed from
_LEVELS = 3  # blocks of 8 x 8 x 8 voxels are decided at once where possible


@dataclass(frozen=True, slots=True, eq=False)
class CandidateGrid:
    """Free places on a regular lattice.

    Parameters
    ----------
    positions
        Shape (V, 3), metres, local frame, ordered along the box's axes.
    voxel
        Distance between neighbours along the box's axes, metres.

    """

    positions: Floats
    voxel: float

    def __post_init__(self) -> None:
        positions = read_only(self.positions, (None, 3), name="positions")
        object.__setattr__(self, "positions", positions)

    def __len__(self) -> int:
        return len(self.positions)


def candidate_positions(
    airspace: Airspace, *, box: Box, voxel: float, limit: int, margin: float = FLIGHT_MARGIN
) -> CandidateGrid:
    """Find free voxel centres in the grown box that are within ``d_max`` of a point of the scene.

    The level ground that is assumed beyond the scene is nothing to photograph, so it does not
    count; if there are no points at all, solids do.

    Parameters
    ----------
    airspace
        Says what is free.
    box
        The scene's box; it is grown by ``d_max``, and the lattice follows its axes.
    voxel
        Wanted voxel width, metres.
    limit
        Most positions; if more would be found, the voxels get wider until they fit.
    margin
        What the flight keeps beyond ``d_min``, and from zones, metres.

    Returns
    -------
    grid
        Positions and the voxel width that was used. There may be none.

    Raises
    ------
    ValueError
        If the voxel or the limit is not positive.

    """
    if not voxel > 0.0 or limit < 1:
        raise ValueError(f"voxel and limit must be positive, got {voxel} and {limit}.")
    size = box.size + 2.0 * airspace.d_max
    coarse = float(np.cbrt(np.prod(size) / _FIRST_LOOK))
    if coarse > voxel:  # guess the free volume first, rather than count what will not be kept
        volume = len(_free_centres(airspace, box, size, coarse, margin)) * coarse**3
        voxel = max(voxel, 0.9 * float(np.cbrt(volume / limit)))
    voxel = max(voxel, float(np.cbrt(np.prod(size) / max(_MOST_VOXELS, limit))))
    while True:
        positions = _free_centres(airspace, box, size, voxel, margin)
        if len(positions) <= limit:
            return CandidateGrid(positions, voxel)
        voxel *= max(1.02, float(np.cbrt(len(positions) / limit)))


def _free_centres(
    airspace: Airspace, box: Box, size: Floats, voxel: float, margin: float
) -> Floats:
    """All free voxel centres near enough to solids, shape (V, 3).

    Clearance changes by at most a metre a metre, so that one value decides a whole block of
    voxels if it is far enough from both limits; blocks in doubt are cut in eight.
    """
    shape = np.maximum(np.floor(size / voxel), 1.0).astype(np.int64)
    spare = margin + SPARE
    corner, least = -0.5 * shape * voxel, airspace.d_min + spare
    found: list[Ints] = []
    width = 2**_LEVELS
    blocks = _lattice(-(-shape // width)) * width
    while len(blocks):
        local = corner + (blocks + 0.5 * width) * voxel
        at = box.centre + local @ box.axes
        low, high = airspace.clearance_range(at)
        away = airspace.obstacle_distance(at) if len(airspace.obstacles) else high
        radius = 0.5 * np.sqrt(3.0) * (width - 1) * voxel  # to the outermost centres
        some = (high + radius >= least) & (away - radius <= airspace.d_max)
        every = (low - radius >= least) & (away + radius <= airspace.d_max)
        found.append(_voxels(blocks[every], width))
        blocks, width = blocks[some & ~every], width // 2
        blocks = _split(blocks, width) if width else blocks[:0]
    index = np.concatenate(found)
    index = index[(index < shape).all(axis=1)]
    index = index[np.lexsort(index.T[::-1])]
    positions = box.centre + (corner + (index + 0.5) * voxel) @ box.axes
    within = (positions >= airspace.low) & (positions <= airspace.high)
    positions = positions[within.all(axis=1)]
    return np.asarray(positions[airspace.zone_margin(positions) >= spare])


def _lattice(shape: Ints) -> Ints:
    """All index triples below ``shape``, (n, 3)."""
    return np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1).reshape(
        -1, 3
    )


def _voxels(blocks: Ints, width: int) -> Ints:
    """Index triples of all voxels of blocks that start at ``blocks`` (n, 3)."""
    inner = _lattice(np.full(3, width))
    return (blocks[:, None, :] + inner).reshape(-1, 3)


def _split(blocks: Ints, width: int) -> Ints:
    """The eight blocks of ``width`` voxels in each block of twice that."""
    return (blocks[:, None, :] + _lattice(np.full(3, 2)) * width).reshape(-1, 3)
