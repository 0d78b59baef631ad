"""How open to the sky the space around a scene is, on an occupancy grid.

The sign of a normal never comes from a mesh's winding or from ray parity: city models are polygon
soups and scans are open sheets. It comes from which side of the surface sees more of the sky.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Floats
from planner.scene.scene import Ground

_MOST_CELLS = 4_000_000
_RIM = 3  # free cells around the points, and above them
_ELEVATIONS = ((0.0, 0.5), (25.0, 1.0), (55.0, 1.0))  # degrees, weight
_AZIMUTHS = 8
_REACH = (1.0, 1.6)  # cells from a point to where its two sides are judged


@dataclass(frozen=True, slots=True, eq=False)
class SkyGrid:
    """Openness of each cell around a scene.

    Parameters
    ----------
    openness
        Weighted share of directions in which the cell sees the sky, shape (nx, ny, nz), in
        [0, 1]; 0 where it is occupied.
    outside
        Which cells a flood from the sky reaches through free cells, shape (nx, ny, nz).
    origin
        Lowest corner, shape (3,), metres.
    cell
        Cell width, metres.

    """

    openness: NDArray[np.float32]
    outside: Bools
    origin: Floats
    cell: float

    def sides(self, xyz: Floats, normals: Floats) -> tuple[Floats, Bools]:
        """Judge the two sides of each point.

        Parameters
        ----------
        xyz, normals
            Points and unit normals of either sign, shape (N, 3).

        Returns
        -------
        lead
            Openness in front (along the normal) less that behind, shape (N,), in [-1, 1].
        hidden
            Whether neither side can be reached from the sky, shape (N,).

        """
        front, front_reached = self._side(xyz, normals)
        back, back_reached = self._side(xyz, -normals)
        return front - back, ~(front_reached | back_reached)

    def _side(self, xyz: Floats, normals: Floats) -> tuple[Floats, Bools]:
        """Openness in front of each point, and whether a way from the sky leads there."""
        openness = np.zeros(len(xyz))
        reached = np.zeros(len(xyz), dtype=bool)
        for reach in _REACH:
            index = self._index(xyz + reach * self.cell * normals)
            openness += self.openness[index] / len(_REACH)
            reached |= self.outside[index]
        return openness, reached

    def _index(self, xyz: Floats) -> tuple[np.ndarray, ...]:
        index = np.floor((xyz - self.origin) / self.cell).astype(np.int64)
        index = index.clip(0, np.array(self.openness.shape) - 1)
        return index[:, 0], index[:, 1], index[:, 2]


def sky_grid(xyz: Floats, cell: float, ground: Ground | None = None) -> SkyGrid:
    """Cast parallel rays in many directions through the occupancy grid of a cloud.

    Parameters
    ----------
    xyz
        Points, shape (N, 3), N >= 1, metres, local frame.
    cell
        Wanted cell width, metres; coarsened where the grid would not fit in memory. About twice
        the distance between points closes the surface.
    ground
        Terrain; all below it counts as occupied.

    Returns
    -------
    grid
        Openness of each cell.

    """
    from scipy.ndimage import label

    low, span = xyz.min(axis=0), np.ptp(xyz, axis=0)
    cell = max(cell, finest_cell(span))
    shape = np.floor(span / cell).astype(np.int64) + 1 + 2 * _RIM
    origin = low - _RIM * cell
    free = np.ones(shape, dtype=bool)
    free[tuple(np.floor((xyz - origin) / cell).astype(np.int64).T)] = False
    if ground is not None:
        free &= _above_ground(ground, origin, cell, free.shape)
    lit = np.zeros(free.shape, dtype=np.float32)
    total = 0.0
    for direction, weight in _directions():
        lit += np.float32(weight) * _lit(free, direction)
        total += weight
    labels, _ = label(free)
    return SkyGrid((lit / total).astype(np.float32), labels == labels[0, 0, -1], origin, cell)


def finest_cell(span: Floats) -> float:
    """Least cell width, metres, at which a grid over ``span``, shape (3,), fits in memory."""
    cell = max(float(np.cbrt(np.prod(span) / _MOST_CELLS)), 1e-9 + 1e-6 * float(span.max()))
    while np.prod(span / cell + 2 * _RIM + 1) > _MOST_CELLS:
        cell *= 1.02
    return cell


def _directions() -> list[tuple[Floats, float]]:
    """Directions towards the sky, with weights."""
    found = [(np.array([0.0, 0.0, 1.0]), 1.0)]
    for elevation, weight in _ELEVATIONS:
        up, level = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
        turns = np.arange(_AZIMUTHS) * (2.0 * np.pi / _AZIMUTHS) + 0.2  # off the grid's axes
        found += [(np.array([level * np.cos(a), level * np.sin(a), up]), weight) for a in turns]
    return found


def _above_ground(ground: Ground, origin: Floats, cell: float, shape: tuple[int, ...]) -> Bools:
    """Which cells have their centre above the terrain."""
    x, y, z = (origin[axis] + (np.arange(shape[axis]) + 0.5) * cell for axis in range(3))
    across = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    terrain = ground.height(across).reshape(len(x), len(y))
    return np.asarray(z[None, None, :] > terrain[:, :, None])


def _lit(free: Bools, direction: Floats) -> Bools:
    """Which cells are free along a ray from them in one direction, to the rim of the grid."""
    major = int(np.argmax(np.abs(direction)))
    minors = [axis for axis in range(3) if axis != major]
    step = direction / abs(direction[major])
    layers = np.moveaxis(free, major, 0)
    lit = np.empty(layers.shape, dtype=bool)
    order = range(len(layers))
    rank = order if step[major] < 0 else order[::-1]
    above = np.ones(layers.shape[1:], dtype=bool)
    done = np.zeros(2)
    for turn, layer in enumerate(rank):
        wanted = np.rint(turn * step[minors])
        lit[layer] = layers[layer] & _shifted(above, (wanted - done).astype(np.int64).tolist())
        above, done = lit[layer], wanted
    return np.moveaxis(lit, 0, major)


def _shifted(plane: Bools, by: list[int]) -> Bools:
    """``plane[i + by[0], j + by[1]]``, true beyond the rim; ``by`` in -1..1."""
    if by == [0, 0]:
        return plane
    moved = np.ones_like(plane)
    into = tuple(slice(max(0, -b), n - max(0, b)) for b, n in zip(by, plane.shape, strict=True))
    from_ = tuple(slice(max(0, b), n + min(0, b)) for b, n in zip(by, plane.shape, strict=True))
    moved[into] = plane[from_]
    return moved
