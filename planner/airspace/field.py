"""A second opinion on clearance that shares no code with the one that proves flights.

Distances to triangles come from a tree of boxes and a closed formula instead of FCL, the side
from a lattice of those distances instead of marked cells, and raw points from a k-d tree.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.airspace.storage import read_arrays
from planner.geometry.arrays import Bools, Floats, Ints, read_only
from planner.scene.cloud import Mesh

_MOST_CELLS = 30_000_000
_LEVELS = 3
_SPREAD = {
    32: 0x1F00000000FFFF,
    16: 0x1F0000FF0000FF,
    8: 0x100F00F00F00F00F,
    4: 0x10C30C30C30C30C3,
    2: 0x1249249249249249,
}
_HALF_DIAGONAL = 0.5 * float(np.sqrt(3.0))
_STEPS = 10  # of the walk out of doubt; each about doubles the distance


class TriangleTree:
    """Exact distances to triangles, by branch and bound over a tree of boxes.

    Parameters
    ----------
    mesh
        At least one triangle; may be degenerate.

    """

    def __init__(self, mesh: Mesh) -> None:
        from planner.airspace.field_kernels import LEAF

        corners = mesh.vertices[mesh.triangles]
        self._corners = corners = corners[np.argsort(_along_curve(corners.mean(axis=1)))]
        leaves = 1 << int(np.ceil(np.log2(max(1, -(-len(corners) // LEAF)))))
        self._low = np.full((2 * leaves, 3), np.inf)
        self._high = np.full((2 * leaves, 3), -np.inf)
        first = np.arange(0, len(corners), LEAF)
        filled = slice(leaves, leaves + len(first))
        self._low[filled] = np.minimum.reduceat(corners.min(axis=1), first)
        self._high[filled] = np.maximum.reduceat(corners.max(axis=1), first)
        while leaves > 1:
            below, leaves = slice(leaves, 2 * leaves), leaves // 2
            level = slice(leaves, 2 * leaves)
            self._low[level] = self._low[below].reshape(-1, 2, 3).min(axis=1)
            self._high[level] = self._high[below].reshape(-1, 2, 3).max(axis=1)

    def distance(self, points: Floats) -> Floats:
        """Distance from each point, shape (m, 3), to the nearest triangle, shape (m,), metres."""
        from planner.airspace.field_kernels import distances

        out = np.empty(len(points))
        at = np.ascontiguousarray(points, dtype=np.float64)
        distances(at, self._corners, self._low, self._high, out)
        return out


def _along_curve(points: Floats) -> Ints:
    """Place of each point on a curve that fills space (Morton order), so that neighbours meet."""
    low = points.min(axis=0)
    width = max(float((points.max(axis=0) - low).max()), 1e-9)
    bits = (((points - low) / width) * (2**20 - 1)).astype(np.int64)
    for step in (32, 16, 8, 4, 2):  # spread the bits of each number three apart
        bits = (bits | (bits << step)) & _SPREAD[step]
    return np.asarray(bits[:, 0] | (bits[:, 1] << 1) | (bits[:, 2] << 2))


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Clearance from stored solids alone, for checking what another implementation planned.

    Parameters
    ----------
    mesh
        All triangles of the solids, local metres.
    obstacles
        Raw points, shape (P, 3), metres.
    low, high
        Corners of the space that is asked about, shape (3,), metres. Nothing beyond it is proven.
    d_min
        Clearance that matters, metres; cells are half of it.

    """

    mesh: Mesh
    obstacles: Floats
    low: Floats
    high: Floats
    d_min: float

    def __post_init__(self) -> None:
        for name, shape in (("obstacles", (None, 3)), ("low", (3,)), ("high", (3,))):
            object.__setattr__(self, name, read_only(getattr(self, name), shape, name=name))

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, NDArray[Any]], *, name: str = "airspace.npz"
    ) -> "DistanceField":
        """Build from the arrays of a stored airspace; see :func:`read_arrays` for complaints."""
        stored = read_arrays(arrays, name=name)
        return cls(stored.mesh, stored.obstacles, stored.low, stored.high, stored.d_min)

    def surface_distance(self, points: Floats) -> Floats:
        """Exact unsigned distance from points, (m, 3), to the triangles, (m,), metres."""
        return self._triangles.distance(points)

    def raw_distance(self, points: Floats) -> Floats:
        """Exact distance from points, (m, 3), to the nearest raw point, (m,), metres."""
        if not len(self.obstacles):
            return np.full(len(points), np.inf)
        return np.asarray(self._tree.query(points)[0])

    def exact_distance(self, points: Floats) -> Floats:
        """Exact unsigned distance to triangles and raw points, (m,), metres."""
        return np.minimum(self.surface_distance(points), self.raw_distance(points))

    def clearance(self, points: Floats) -> Floats:
        """Signed distance, (m,), metres: exact where proven outside, otherwise negative.

        Minus infinity for points that are not finite or outside of the space asked about.
        """
        points = np.asarray(points, dtype=np.float64)
        clearance = np.full(len(points), -np.inf)
        known = ((points >= self.low) & (points <= self.high)).all(axis=1)
        at = points[known]
        surface = self.surface_distance(at)
        signed = np.where(self._outside(at, surface), surface, -surface)
        clearance[known] = np.minimum(signed, self.raw_distance(at))
        return clearance

    @property
    def error(self) -> float:
        """Most that :meth:`lower_bound` loses against the value of a point's cell, metres."""
        return _HALF_DIAGONAL * self.lattice.cell

    def lower_bound(self, points: Floats) -> Floats:
        """Lower bound of the clearance, (m,), metres, from the lattice and the raw points.

        Distance changes by at most a metre a metre: the value at the centre of a cell less the
        way to it holds everywhere, and so does the height over all surfaces. Minus infinity where
        the lattice does not prove that a point is outside.
        """
        points = np.asarray(points, dtype=np.float64)
        known = ((points >= self.low) & (points <= self.high)).all(axis=1)
        bound = np.full(len(points), -np.inf)
        at = points[known]
        index = self.lattice.index(at)
        value = self.lattice.values[tuple(index.T)].astype(np.float64)
        value -= np.linalg.norm(at - self.lattice.centre(index), axis=1)
        value = np.maximum(value, at[:, 2] - self.mesh.vertices[:, 2].max())
        proven = self.lattice.sky[tuple(index.T)]
        bound[known] = np.where(proven, np.minimum(value, self.raw_distance(at)), -np.inf)
        return bound

    def lower_bound_along(self, a: Floats, b: Floats, *, tolerance: float = 0.05) -> Floats:
        """Lower bound of the clearance along whole segments, within ``tolerance`` of the truth.

        Parameters
        ----------
        a, b
            Ends of the segments, each (m, 3), metres.
        tolerance
            Most by which the bound may lie under the least clearance met, metres, positive.

        Returns
        -------
        bound
            Shape (m,), metres. At the ends ``c0`` and ``c1`` of a stretch of length ``L`` no
            clearance between is less than ``(c0 + c1 - L) / 2``; stretches are halved until
            that is near enough to the least value met on the segment. Minus infinity where a
            point met is not proven outside.

        """
        if not tolerance > 0.0:
            raise ValueError(f"tolerance must be positive, got {tolerance}.")
        owner = np.arange(len(a))
        ends = np.stack([self.clearance(a), self.clearance(b)], axis=1)
        seen, bound = ends.min(axis=1), np.full(len(a), np.inf)
        a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
        while len(owner):
            least = 0.5 * (ends.sum(axis=1) - np.linalg.norm(b - a, axis=1))
            done = (least >= seen[owner] - tolerance) | (seen[owner] <= 0.0)
            np.minimum.at(bound, owner[done], np.minimum(least, ends.min(axis=1))[done])
            a, b, ends, owner = a[~done], b[~done], ends[~done], owner[~done]
            middle = 0.5 * (a + b)
            value = self.clearance(middle)
            np.minimum.at(seen, owner, value)
            ends = np.concatenate(
                [np.stack([ends[:, 0], value], axis=1), np.stack([value, ends[:, 1]], axis=1)]
            )
            a, b, owner = (
                np.concatenate([a, middle]),
                np.concatenate([middle, b]),
                np.tile(owner, 2),
            )
        return np.where(seen > 0.0, bound, -np.inf)

    @cached_property
    def lattice(self) -> "Lattice":
        """Distances at the centres of cells, and which cells the sky reaches."""
        corners = self.mesh.vertices
        ends = corners.min(axis=0), corners.max(axis=0)
        low = np.r_[self.low[:2], max(self.low[2], ends[0][2])]
        high = np.r_[self.high[:2], max(low[2], ends[1][2])]
        return _lattice(self._triangles, (low, high), ends, 0.5 * self.d_min, self.d_min)

    def _outside(self, points: Floats, distance: Floats) -> Bools:
        """Which points are proven outside: steps that no surface can cross lead to the sky.

        Each step of a point in doubt goes almost as far as its nearest surface is, straight away
        from it. A point in the middle between two surfaces stays; so does one farther away than
        any doubt reaches, whose own cell is empty: it lies in a hollow.
        """
        doubt = max(self.d_min, 2.0 * self.lattice.cell)
        outside: Bools = self.lattice.sky[tuple(self.lattice.index(points).T)]
        rows = np.flatnonzero(~outside)
        at, distance = points[rows], distance[rows]
        for _ in range(_STEPS):
            going = (distance > 0.0) & (distance < doubt)
            rows, at, distance = rows[going], at[going], distance[going]
            at = at + 0.99 * distance[:, None] * self._away(at, distance)
            arrived = self.lattice.holds(at) & self.lattice.sky[tuple(self.lattice.index(at).T)]
            outside[rows[arrived]] = True
            room = self.surface_distance(at)
            going = ~arrived & (room > 1.2 * distance)
            rows, at, distance = rows[going], at[going], room[going]
        return outside

    def _away(self, points: Floats, distance: Floats) -> Floats:
        """Unit directions in which the distance to surfaces grows, shape (m, 3)."""
        step = 1e-3 * distance
        rise = [self.surface_distance(points + step[:, None] * axis) for axis in np.eye(3)]
        slope = (np.stack(rise, axis=1) - distance[:, None]) / step[:, None]
        return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9))

    @cached_property
    def _triangles(self) -> TriangleTree:
        return TriangleTree(self.mesh)

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import KDTree

        # the balanced and compact tree takes fifty times as long for places far from flat ground
        return KDTree(self.obstacles, leafsize=32, compact_nodes=False, balanced_tree=False)


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """Lower bounds of the distance to surfaces on a lattice, and the sky's cells.

    It is as high as the surfaces are: all above it is sky too, and nothing below it is.

    Parameters
    ----------
    values
        Lower bound at each cell's centre, shape (nx, ny, nz), float32, metres; exact but for
        rounding near surfaces.
    sky
        Cells without any surface that hang together with the top layer, same shape.
    origin
        Lowest corner, shape (3,), metres.
    cell
        Cell width, metres.

    """

    values: NDArray[np.float32]
    sky: Bools
    origin: Floats
    cell: float

    def holds(self, points: Floats) -> Bools:
        """Which points lie in the lattice or above it."""
        top = self.origin + np.array(self.values.shape) * self.cell
        top[2] = np.inf
        return np.asarray(((points >= self.origin) & (points < top)).all(axis=1))

    def index(self, points: Floats) -> Ints:
        """Cell of each point, clipped to the lattice, shape (m, 3)."""
        at = np.floor((points - self.origin) / self.cell).astype(np.int64)
        return np.asarray(at.clip(0, np.array(self.values.shape) - 1))

    def centre(self, index: Ints) -> Floats:
        """Centre of each cell, shape (m, 3), metres."""
        return np.asarray(self.origin + (index + 0.5) * self.cell)


def _lattice(
    triangles: TriangleTree,
    corners: tuple[Floats, Floats],
    ends: tuple[Floats, Floats],
    cell: float,
    d_min: float,
) -> Lattice:
    """Fill a lattice from coarse blocks to single cells, and flood its empty cells.

    A block is not cut further once all of it is clear by more than ``d_min`` and a cell. Beyond the
    ends of the surfaces no cell is sky, lest wide ones lead around their rim to below the ground.
    """
    from scipy.ndimage import label

    from planner.airspace.field_kernels import fill_blocks

    low, high = corners
    while np.prod(np.ceil((high - low) / cell) + 4.0) > _MOST_CELLS:
        cell *= 1.05
    origin = low - 2.0 * cell
    shape = np.ceil((high - low) / cell).astype(np.int64) + 4
    values = np.empty(tuple(shape), dtype=np.float32)
    width = 2**_LEVELS
    blocks = _steps(-(-shape // width)) * width
    while width:
        distance = triangles.distance(origin + (blocks + 0.5 * width) * cell)
        radius = _HALF_DIAGONAL * width * cell
        whole = distance - radius >= d_min + _HALF_DIAGONAL * cell
        whole |= np.full(len(blocks), width == 1)
        safe = distance[whole] * (1.0 - 1e-6) - 1e-6  # float32 holds about seven digits
        fill_blocks(values, blocks[whole], width, safe, cell)
        blocks, width = blocks[~whole], width // 2
        blocks = (blocks[:, None, :] + _steps(np.full(3, 2)) * width).reshape(-1, 3)
        blocks = blocks[(blocks < shape).all(axis=1)]
    empty = values > _HALF_DIAGONAL * cell
    for axis in range(2):
        centre = origin[axis] + (np.arange(shape[axis]) + 0.5) * cell
        out = (centre < ends[0][axis]) | (centre > ends[1][axis])
        empty[(slice(None),) * axis + (out,)] = False
    parts, _ = label(empty)
    top = np.unique(parts[:, :, -1])
    return Lattice(values, np.isin(parts, top[top > 0]), origin, cell)


def _steps(shape: Ints) -> Ints:
    """All index triples below ``shape``, (n, 3)."""
    grids = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    return np.stack(grids, axis=-1).reshape(-1, 3)
