"""Which side of the surfaces is the open sky: a flood fill on a grid of cells."""

from dataclasses import dataclass

import numpy as np

from planner.airspace.terrain import Terrain
from planner.geometry.arrays import Bools, Bytes, Floats, Ints, read_only
from planner.scene.cloud import Mesh

_CELLS_A_D_MIN = 4.0
_AROUND = 3  # cells of air kept around everything
_SQRT3 = float(np.sqrt(3.0))


@dataclass(frozen=True, slots=True, eq=False)
class Occupancy:
    """Cells that the open sky reaches through cells that no surface touches.

    A sky cell is proven to be outside of solids. Other cells are solid, touch a surface or a
    point, or lie within ``reach`` cells of one; for those the side is decided by
    :meth:`planner.airspace.airspace.Airspace.clearance`.

    Parameters
    ----------
    bits
        Eight cells a byte along z, lowest bit first, shape (nx, ny, ceil(nz / 8)); 1 is sky.
    shape
        Number of cells (nx, ny, nz).
    origin
        Lowest corner of the grid, shape (3,), metres, local frame.
    cell
        Cell width, metres.
    reach
        Cells by which surfaces were thickened, which closes holes narrower than
        ``2 * reach + 1`` cells.
    under_roofs, most_cells
        How the grid was made.

    """

    bits: Bytes
    shape: tuple[int, int, int]
    origin: Floats
    cell: float
    reach: int
    under_roofs: bool
    most_cells: int

    def __post_init__(self) -> None:
        nx, ny, nz = self.shape
        packed = (nx, ny, (nz + 7) // 8)
        bits = read_only(self.bits, packed, name="bits", dtype=np.uint8)
        object.__setattr__(self, "bits", bits)
        object.__setattr__(self, "origin", read_only(self.origin, (3,), name="origin"))

    @property
    def blur(self) -> float:
        """Distance from surfaces and points beyond which a cell outside of solids is sky."""
        return (self.reach + 1) * _SQRT3 * self.cell

    def is_sky(self, points: Floats) -> tuple[Bools, Bools]:
        """Tell which points, shape (N, 3), lie in sky cells, and which in the grid at all."""
        index = np.floor((points - self.origin) / self.cell)
        within = np.asarray(((index >= 0) & (index < self.shape)).all(axis=1))
        i, j, k = np.where(within[:, None], index, 0).astype(np.int64).T
        bit = (self.bits[i, j, k >> 3] >> (k & 7).astype(np.uint8)) & 1
        return within & (bit == 1), within

    def mask(self) -> Bools:
        """Sky as a boolean grid, shape (nx, ny, nz); for drawing and for small grids."""
        bits = np.unpackbits(self.bits, axis=2, count=self.shape[2], bitorder="little")
        return bits.astype(bool)

    def centres(self, axis: int) -> Floats:
        """Coordinates of the cells' centres along an axis, metres."""
        steps = np.arange(self.shape[axis]) + 0.5
        return np.asarray(self.origin[axis] + steps * self.cell)


def occupancy(
    surface: Mesh,
    ground: Terrain,
    points: Floats,
    *,
    d_min: float,
    under_roofs: bool,
    most_cells: int,
) -> tuple[Occupancy, Mesh]:
    """Flood the air around surfaces; also return curtains around what is filled under roofs.

    Every cell that a triangle or a point touches is shell; cells under the terrain are earth.
    With ``under_roofs``, cells under a surface that faces up are filled down to the next surface
    that faces down or to the terrain, so that a roof whose walls nobody has seen is a building
    and not a canopy, while what is under a bridge with an underside stays open. This only ever
    adds solids. As no surface bounds such a filling sideways, curtains do.

    All these cells are thickened by ``reach`` cells, the most that keeps every place with a
    clearance of ``d_min`` open, and air floods the rest from the top and the sides.

    Parameters
    ----------
    surface
        Surface triangles; may be open, broken and of mixed orientation.
    ground
        Terrain; everything under it is solid.
    points
        Raw points of the scene, shape (N, 3), metres; they close the shell too.
    d_min
        Wanted clearance, metres; cells are a quarter of it.
    under_roofs
        Whether to fill under surfaces that face up.
    most_cells
        Largest number of cells (bytes while it is made); beyond it cells get wider. Sky is still
        proven then, but narrow places are taken for solid.

    Returns
    -------
    occupancy, curtains
        Grid of the sky, and vertical triangles around the filling.

    """
    from planner.airspace import voxel_kernels as kernels

    box = _extent(surface, ground)
    cell = _cell_width(box, d_min / _CELLS_A_D_MIN, most_cells)
    origin = box[0] - _AROUND * cell
    shape = tuple(int(n) for n in np.ceil((box[1] - box[0]) / cell) + 2 * _AROUND)
    flags = np.zeros(shape, dtype=np.uint8)

    sheet = ground.mesh(origin[:2], origin[:2] + np.array(shape[:2]) * cell)
    for mesh in (surface, sheet):
        for rows in np.array_split(mesh.triangles, max(1, len(mesh) // 200_000)):
            kernels.mark_triangles(flags, (mesh.vertices[rows] - origin) / cell)
    kernels.mark_points(flags, (points - origin) / cell)
    kernels.fill_columns(flags, _column_heights(ground, origin, cell, flags.shape), under_roofs)
    curtains = _curtains(flags, origin, cell)
    np.bitwise_and(flags, ~(kernels.UP | kernels.DOWN), out=flags)
    reach = 1 if 2.0 * _SQRT3 * cell < d_min else 0
    kernels.close_near(flags, reach)
    kernels.flood(flags)
    bits = np.packbits(flags & kernels.SKY, axis=2, bitorder="little")
    size = (shape[0], shape[1], shape[2])
    return Occupancy(bits, size, origin, cell, reach, under_roofs, most_cells), curtains


def _extent(surface: Mesh, ground: Terrain) -> Floats:
    """Lowest and highest corner of surface and terrain, shape (2, 3), metres.

    Raw points do not count: a bird far up must not make the cells wide.
    """
    rim = np.stack(
        [np.r_[ground.origin, ground.corners.min()], np.r_[ground.high, ground.corners.max()]]
    )
    used = surface.vertices[np.unique(surface.triangles)]
    low = np.min([a.min(axis=0) for a in (rim, used) if len(a)], axis=0)
    high = np.max([a.max(axis=0) for a in (rim, used) if len(a)], axis=0)
    return np.stack([np.r_[low[:2], ground.corners.min()], high])  # all below terrain is solid


def _cell_width(box: Floats, wanted: float, most_cells: int) -> float:
    """Wanted cell width, or the least wider one with which the grid is small enough."""
    cell = wanted
    while np.prod(np.ceil((box[1] - box[0]) / cell) + 2 * _AROUND) > most_cells:
        cell *= 1.05
    return cell


def _column_heights(ground: Terrain, origin: Floats, cell: float, shape: tuple[int, ...]) -> Floats:
    """Terrain under the centre of each column, shape (nx, ny), in cells above the origin."""
    x, y = ((np.arange(n) + 0.5) * cell + o for n, o in zip(shape[:2], origin[:2], strict=True))
    at = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(((ground.height(at) - origin[2]) / cell).reshape(shape[:2]))


def _curtains(flags: Bytes, origin: Floats, cell: float) -> Mesh:
    """Vertical rectangles, two triangles each, between filled cells and air beside them."""
    from planner.airspace.voxel_kernels import curtain_runs

    quads = []
    for axis in (0, 1):
        runs: Ints = np.empty((curtain_runs(flags, axis, np.empty((0, 4), np.int64)), 4), np.int64)
        curtain_runs(flags, axis, runs)
        a = runs[:, [0, 1, 2]]
        side = np.array([0, 1, 0]) if axis == 0 else np.array([1, 0, 0])
        tall = (runs[:, 3] - runs[:, 2])[:, None] * np.array([0, 0, 1])
        quads.append(np.stack([a, a + side, a + side + tall, a + tall], axis=1))
    corners = np.concatenate(quads).reshape(-1, 3)
    first = 4 * np.arange(len(corners) // 4)[:, None]
    triangles = np.concatenate([first + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    return Mesh(origin + corners * cell, triangles)
