"""Walls that nobody saw: under a roof's edge the building goes on.

A nadir flight sees roofs and streets but few facades. Left to itself the Poisson surface joins both
by a waist that lies inside of the building, so that facades would be photographed where they are
not, and flown through where they are. Points of plain vertical walls, from each free roof edge down
to what lies before it, keep the surface in place.
"""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import PointCloud
from planner.scene.scene import Ground
from planner.surface.oriented import normals_of

_STEPS = 4  # cells of R/2 that are looked at before and behind an edge
_DIRECTIONS = 16
_STRAIGHT = 0.35  # least length of the mean open direction: an edge, not a spike
_DOWNWARD = -0.5  # vertical part of the normal of an underside
_ENOUGH = 2  # cells that must agree
_ALIKE = 0.5  # cosine within which directions are averaged: not around a corner


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Points where a roof ends in the open.

    Parameters
    ----------
    xyz
        Outermost point of each stretch of R/2 of an edge, shape (E, 3), metres.
    outward
        Level unit direction away from the roof, shape (E, 2).
    foot
        Height of what lies before the edge, shape (E,), metres.

    """

    xyz: Floats
    outward: Floats
    foot: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """A grid of cells of R/2 over the cloud: what is highest and lowest in each.

    ``lowest`` is -inf where a point faces down: what is below was seen through.
    """

    of_point: Ints
    low: Floats
    highest: Floats
    lowest: Floats


def stand_walls(cloud: PointCloud, ground: Ground, *, radius: float) -> PointCloud:
    """Return points of walls under the roof edges, where nothing was measured.

    Parameters
    ----------
    cloud
        Thinned cloud, about R/4 apart, metres.
    ground
        Terrain, the foot of a wall where nothing before it was measured.
    radius
        Poisson-disk radius R: a step lower than R is no wall, metres.

    Returns
    -------
    walls
        Points with level outward normals, R/2 apart, none within R/2 of a measured one.

    """
    from scipy.spatial import cKDTree

    edges = roof_edges(cloud, ground, radius=radius)
    spacing = 0.5 * radius
    count = np.maximum(np.floor((edges.xyz[:, 2] - edges.foot) / spacing).astype(np.int64), 0)
    edge = np.repeat(np.arange(len(count)), count)
    rank = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    xyz = edges.xyz[edge] - np.outer((rank + 0.5) * spacing, [0.0, 0.0, 1.0])
    normals = np.column_stack([edges.outward[edge], np.zeros(len(edge))])
    if len(xyz) == 0:
        return PointCloud(xyz, normals)
    unseen = np.isinf(cKDTree(cloud.xyz).query(xyz, distance_upper_bound=spacing)[0])
    return PointCloud(xyz[unseen], normals[unseen])


def roof_edges(cloud: PointCloud, ground: Ground, *, radius: float) -> Edges:
    """Find where the highest surface ends with a drop of more than R.

    On a grid of R/2, a cell is an edge towards a direction if all within 2 R that way is more than
    R lower. It must go on as a roof behind, and nothing may have been seen under that roof, neither
    something low nor its own underside: a bridge or a tree that was seen through has no walls.

    Parameters
    ----------
    cloud
        Thinned cloud with normals, metres.
    ground
        Terrain, the foot where nothing before an edge was measured.
    radius
        Poisson-disk radius R, metres.

    Returns
    -------
    edges
        One a cell.

    """
    columns = _columns(cloud, 0.5 * radius)
    place = np.argwhere(np.isfinite(columns.highest))
    height = _look(columns.highest, place, np.zeros(2))
    outward, foot = _open_side(columns.highest, place, height - radius)
    centre = columns.low + (place + 0.5) * 0.5 * radius
    foot = np.where(np.isfinite(foot), foot, ground.height(centre))
    length = np.linalg.norm(outward, axis=1)
    outward = outward / np.where(length > 0.0, length, 1.0)[:, None]
    edge = (length > _STRAIGHT) & (height - foot > radius)
    edge &= _roof_behind(columns.highest, place, height - radius, outward)
    edge &= ~_seen_under(columns.lowest, place, 0.5 * (height + foot), outward)
    rows = _outermost(cloud.xyz, columns, place[edge], height[edge] - 0.5 * radius, outward[edge])
    return Edges(cloud.xyz[rows], _agreed(cloud.xyz[rows], outward[edge], radius), foot[edge])


def _columns(cloud: PointCloud, cell: float) -> _Columns:
    low = cloud.xyz[:, :2].min(axis=0) - (_STEPS + 1) * cell
    column = np.floor((cloud.xyz[:, :2] - low) / cell).astype(np.int64)
    shape = tuple(column.max(axis=0) + _STEPS + 2)
    highest, lowest = np.full(shape, -np.inf), np.full(shape, np.inf)
    np.maximum.at(highest, (column[:, 0], column[:, 1]), cloud.xyz[:, 2])
    height = np.where(normals_of(cloud)[:, 2] < _DOWNWARD, -np.inf, cloud.xyz[:, 2])
    np.minimum.at(lowest, (column[:, 0], column[:, 1]), height)
    return _Columns(column, low, highest, lowest)


def _open_side(highest: Floats, place: Ints, below: Floats) -> tuple[Floats, Floats]:
    """Mean direction in which all lies lower than ``below``, and the greatest height there."""
    total, foot = np.zeros((len(place), 2)), np.full(len(place), -np.inf)
    for angle in np.arange(_DIRECTIONS) * (2.0 * np.pi / _DIRECTIONS):
        direction = np.array([np.cos(angle), np.sin(angle)])
        steps = range(1, _STEPS + 1)
        ahead = np.column_stack([_look(highest, place, direction * k) for k in steps])
        free = (ahead < below[:, None]).all(axis=1)
        total[free] += direction
        foot[free] = np.maximum(foot[free], ahead[free].max(axis=1))
    # a straight edge is open over half a turn, whose directions add up to this many
    return total / (_DIRECTIONS / np.pi), foot


def _roof_behind(highest: Floats, place: Ints, above: Floats, outward: Floats) -> Bools:
    """Tell behind which edges the roof goes on, shape (n,)."""
    steps = range(1, _STEPS + 1)
    roof = [_look(highest, place, -outward * k) > above for k in steps]
    return np.asarray(np.sum(roof, axis=0) >= _ENOUGH)


def _seen_under(lowest: Floats, place: Ints, below: Floats, outward: Floats) -> Bools:
    """Tell under which roofs something was seen, shape (n,)."""
    steps = range(2, _STEPS + 1)  # the next cell may hold points of the wall itself
    seen = [_look(lowest, place, -outward * k) < below for k in steps]
    return np.asarray(np.sum(seen, axis=0) >= _ENOUGH)


def _agreed(xyz: Floats, outward: Floats, radius: float) -> Floats:
    """Mean direction of the edges around each: the grid knows only so many."""
    from scipy.spatial import cKDTree

    tree = cKDTree(xyz)
    pairs = tree.sparse_distance_matrix(tree, 1.5 * radius, output_type="ndarray")
    row, other = pairs["i"], pairs["j"]
    alike = np.einsum("pc,pc->p", outward[row], outward[other]) > _ALIKE
    row, other = row[alike], other[alike]
    mean = np.column_stack(
        [np.bincount(row, outward[other, axis], minlength=len(xyz)) for axis in range(2)]
    )
    return np.asarray(mean / np.linalg.norm(mean, axis=1, keepdims=True))


def _look(grid: Floats, place: Ints, offset: Floats) -> Floats:
    """Value of the cell at an offset, in cells, from each place; the rim is empty."""
    index = (place + np.rint(offset).astype(np.int64)).clip(0, np.array(grid.shape) - 1)
    return np.asarray(grid[index[:, 0], index[:, 1]])


def _outermost(xyz: Floats, columns: _Columns, place: Ints, above: Floats, outward: Floats) -> Ints:
    """Row of the point of each edge cell that lies farthest out, of those higher than ``above``."""
    owner = np.full(columns.highest.shape, -1, np.int64)
    owner[place[:, 0], place[:, 1]] = np.arange(len(place))
    edge = owner[columns.of_point[:, 0], columns.of_point[:, 1]]
    rows = np.flatnonzero(edge >= 0)
    rows = rows[xyz[rows, 2] > above[edge[rows]]]
    along = np.einsum("nc,nc->n", xyz[rows, :2], outward[edge[rows]])
    order = np.lexsort((-along, edge[rows]))
    _, first = np.unique(edge[rows][order], return_index=True)
    return np.asarray(rows[order[first]])
