"""Space that the first flight has not looked through, as solids."""

from dataclasses import dataclass

import numpy as np

from planner.airspace.occupancy import Occupancy
from planner.airspace.terrain import Terrain
from planner.geometry.arrays import Bools, Bytes, Floats, Ints
from planner.scene.cloud import Mesh

_CELLS_A_D_MIN = 2.0
_MOST_CELLS = 6_000_000
_AZIMUTHS = 16
_RING_DEG = 15.0  # widest step between rings of directions
_TURN_DEG = 9.0  # of each ring against the one before, and of the first off the axes
_SQRT3 = float(np.sqrt(3.0))


@dataclass(frozen=True, slots=True)
class _Grid:
    """Cells that cover the space in which flight is considered."""

    origin: Floats
    cell: float
    shape: tuple[int, int, int]


def unknown_space(
    solids: Mesh,
    data: Floats,
    obstacles: Floats,
    sky: Occupancy,
    *,
    ground: Terrain,
    bounds: tuple[Floats, Floats],
    d_min: float,
    seen_within_deg: float,
) -> Mesh:
    """Closed faces around all space that no line of sight of the first flight has passed.

    A scan says what is solid, and that lines of sight to its points were free. Where its cameras
    were is seldom kept, so a line counts if it comes down from the open sky, no farther from the
    vertical than the first flight looked, touches nothing on its way and ends at something that
    raw points lie on. A cell is seen if such a line leads through its centre; a cell that holds a
    surface is known if a neighbour is seen. What is left of the sky is unknown: behind and
    under what was scanned, over holes, and outside of the scanned place.

    Parameters
    ----------
    solids
        Triangles that block lines: surface, terrain, curtains, local metres.
    data
        Raw points that lines may end at, shape (N, 3), metres.
    obstacles
        Points that block lines, shape (P, 3), metres.
    sky
        What the open sky reaches through gaps; nothing else needs to be closed.
    ground
        Terrain.
    bounds
        Lowest and highest corner of the space in which flight is considered, each (3,), metres.
    d_min
        Wanted clearance, metres; cells are half of it, wider where that is too many.
    seen_within_deg
        Largest angle between a line and the vertical, degrees, in (0, 90).

    Returns
    -------
    faces
        Rectangles, two triangles each, that face out of the unknown; none if all is known.

    """
    from scipy.ndimage import binary_dilation

    from planner.airspace import sight_kernels as sight

    grid = _grid_over(bounds, d_min)
    flags = _marked(grid, solids, data, obstacles)
    flags |= sight.OPAQUE * _buried(grid, ground)
    sight.mark_seen(flags, _ways(seen_within_deg))
    seen, around = flags & sight.SEEN > 0, np.ones((3, 3, 3), dtype=np.bool_)
    known = seen
    if grid.cell * _SQRT3 <= d_min:  # else there is room beside a surface within its cell
        known = seen | ((flags & sight.OPAQUE > 0) & binary_dilation(seen, around))
    unknown = _with_sky(grid, ~known, sky, ground)
    vertices, triangles = _faces(unknown)
    return Mesh(grid.origin + vertices * grid.cell, triangles)


def _grid_over(bounds: tuple[Floats, Floats], d_min: float) -> _Grid:
    low, high = bounds
    cell = d_min / _CELLS_A_D_MIN
    while np.prod(np.ceil((high - low) / cell)) > _MOST_CELLS:
        cell *= 1.05
    nx, ny, nz = (int(n) for n in np.ceil((high - low) / cell))
    return _Grid(low, cell, (nx, ny, nz))


def _marked(grid: _Grid, solids: Mesh, data: Floats, obstacles: Floats) -> Bytes:
    """Flags of the cells: what lines cannot pass, and where they may end."""
    from scipy.ndimage import binary_dilation

    from planner.airspace import sight_kernels as sight
    from planner.airspace import voxel_kernels as voxels

    touched, held = np.zeros(grid.shape, dtype=np.uint8), np.zeros(grid.shape, dtype=np.uint8)
    for rows in np.array_split(solids.triangles, max(1, len(solids) // 200_000)):
        voxels.mark_triangles(touched, (solids.vertices[rows] - grid.origin) / grid.cell)
    voxels.mark_points(touched, (obstacles - grid.origin) / grid.cell)
    voxels.mark_points(held, (data - grid.origin) / grid.cell)
    near_data = binary_dilation(held > 0, np.ones((3, 3, 3), dtype=np.bool_))
    opaque = touched & voxels.SHELL > 0
    return np.asarray(opaque * sight.OPAQUE + near_data * sight.DATA, dtype=np.uint8)


def _buried(grid: _Grid, ground: Terrain) -> Bools:
    """Cells whose centre lies more than a cell under the terrain."""
    x, y, z = (grid.origin[a] + (np.arange(grid.shape[a]) + 0.5) * grid.cell for a in range(3))
    at = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    heights = ground.height(at).reshape(len(x), len(y), 1)
    return np.asarray(z < heights - grid.cell)


def _ways(widest_deg: float) -> Floats:
    """Directions up to so many degrees from the vertical, largest component 1, shape (W, 3)."""
    rings = int(np.ceil(widest_deg / _RING_DEG))
    ways = [np.array([0.0, 0.0, 1.0])]
    for ring in range(1, rings + 1):
        tilt = np.radians(widest_deg * ring / rings)
        turns = np.radians(360.0 * np.arange(_AZIMUTHS) / _AZIMUTHS + _TURN_DEG * ring)
        ways += [
            np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
            for turn in turns
        ]
    return np.stack([way / np.abs(way).max() for way in ways])


def _with_sky(grid: _Grid, cells: Bools, sky: Occupancy, ground: Terrain) -> Bools:
    """Those cells that hold anything of the sky, by probes no farther apart than its cells."""
    found = np.zeros(grid.shape, dtype=np.bool_)
    probes = int(np.ceil(grid.cell / sky.cell))
    steps = (np.arange(probes) + 0.5) / probes
    inner = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    for slab in range(grid.shape[0]):
        rows = np.argwhere(cells[slab])
        index = np.column_stack([np.full(len(rows), slab), rows])
        at = (grid.origin + (index[:, None] + inner) * grid.cell).reshape(-1, 3)
        open_, within = sky.is_sky(at)
        open_ |= ~within & (at[:, 2] > ground.height(at))
        found[tuple(index.T)] = open_.reshape(len(index), -1).any(axis=1)
    return found


def _faces(cells: Bools) -> tuple[Floats, Ints]:
    """Closed surface of a set of cells, faces outward, those in a row joined; in cells."""
    padded = np.pad(cells, 1)
    corners = [np.zeros((0, 4, 3))]
    for axis in range(3):
        along = 0 if axis == 2 else 2  # walls are joined upwards, floors along x
        across = 3 - axis - along
        last = np.moveaxis(padded, (axis, across, along), (0, 1, 2))
        for sign, faces in ((1, last[:-1] & ~last[1:]), (-1, last[1:] & ~last[:-1])):
            ends = np.diff(faces.astype(np.int8), axis=2)
            start, stop = np.argwhere(ends == 1), np.argwhere(ends == -1)
            quads = np.empty((len(start), 4, 3))
            quads[:, :, axis] = start[:, [0]]
            quads[:, :, across] = start[:, [1]] - 1 + np.array([0, 1, 1, 0])
            begin, end = start[:, 2], stop[:, 2]
            quads[:, :, along] = np.stack([begin, begin, end, end], axis=1)
            right = (across - axis) % 3 == 1  # across, along and axis are right-handed
            corners.append(quads if (sign > 0) == right else quads[:, ::-1])
    quads = np.concatenate(corners)
    first = 4 * np.arange(len(quads))[:, None]
    triangles = np.concatenate([first + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    return quads.reshape(-1, 3), triangles
