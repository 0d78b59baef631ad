"""What of a Poisson surface to believe: where it was measured, and what spans the holes between."""

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.sampling import triangle_normals
from planner.scene.scene import Ground

_FARTHEST = 3.0  # times the distance at which a surface is far: no hole is believed beyond
_BRIDGED = 1.5  # radii around each point that count as covered while the footprint is closed
_MARGIN = 0.5  # radii of them that stay


def trim(mesh: Mesh, points: Floats, ground: Ground, *, radius: float, distance: float) -> Mesh:
    """Drop what Poisson reconstruction invents, and keep what it fills.

    Kept is what lies within ``distance`` of a point, and what lies farther but is enclosed by such
    surface: holes in the ground and bare facades. Dropped are the skirts outside of the points' own
    footprint or below the ground, whatever is far and open, and crumbs smaller than one sample.

    Parameters
    ----------
    mesh
        Poisson surface, metres.
    points
        What was measured, shape (N, 3), metres.
    ground
        Terrain; R below it and R away from all points nothing is believed.
    radius
        Poisson-disk radius R, metres.
    distance
        From where on a surface is far from all points, metres.

    Returns
    -------
    mesh
        The triangles all of whose vertices are kept, in their order.

    """
    from scipy.spatial import cKDTree

    near = np.asarray(cKDTree(points).query(mesh.vertices)[0])
    inside = in_footprint(mesh.vertices, points, radius)
    above = mesh.vertices[:, 2] > ground.height(mesh.vertices) - radius
    inside &= above | (near <= radius)
    believed: Bools = inside & ((near <= distance) | _enclosed(mesh, near, inside, distance))
    kept = select_triangles(mesh, np.asarray(believed[mesh.triangles].all(axis=1)))
    return drop_crumbs(kept, smallest=np.pi * radius**2)


def in_footprint(at: Floats, points: Floats, radius: float) -> Bools:
    """Tell what lies above or below the ground that the points cover, holes in it included.

    The footprint reaches R/2 beyond the points; gaps of up to 3 R between them are bridged.

    Parameters
    ----------
    at
        Positions, shape (M, 3), metres.
    points
        What was measured, shape (N, 3), metres.
    radius
        Poisson-disk radius R, metres.

    Returns
    -------
    inside
        Shape (M,).

    """
    from scipy.ndimage import binary_fill_holes, distance_transform_edt

    cell = 0.25 * radius
    rim = int(np.ceil((_BRIDGED + 1.0) * radius / cell))
    low = points[:, :2].min(axis=0) - rim * cell
    column = np.floor((points[:, :2] - low) / cell).astype(np.int64)
    empty = np.ones(column.max(axis=0) + rim + 1, dtype=bool)
    empty[column[:, 0], column[:, 1]] = False
    grown = binary_fill_holes(distance_transform_edt(empty) * cell <= _BRIDGED * radius)
    covered = distance_transform_edt(grown) * cell > (_BRIDGED - _MARGIN) * radius
    column = np.floor((at[:, :2] - low) / cell).astype(np.int64)
    within = ((column >= 0) & (column < covered.shape)).all(axis=1)
    inside = np.zeros(len(at), dtype=bool)
    inside[within] = covered[column[within, 0], column[within, 1]]
    return inside


def _enclosed(mesh: Mesh, near: Floats, inside: Bools, distance: float) -> Bools:
    """Tell which vertices are far but in a patch that near surface encloses, shape (N,)."""
    edges, uses = _edges(mesh)
    far = near > distance
    patch = _components(len(far), edges[far[edges].all(axis=1)])
    open_ = ~inside | (near > _FARTHEST * distance)
    open_[edges[uses == 1]] = True  # the rim of the octree
    bordered = np.zeros(len(far), dtype=bool)
    bordered[edges[far[edges].sum(axis=1) == 1]] = True
    refused = np.bincount(patch, open_ & far) > 0
    anchored = np.bincount(patch, bordered & far) > 0
    return np.asarray(far & ~refused[patch] & anchored[patch])


def drop_crumbs(mesh: Mesh, *, smallest: float) -> Mesh:
    """Return the mesh without connected pieces of less than ``smallest`` square metres."""
    piece = _components(len(mesh.vertices), _edges(mesh)[0])[mesh.triangles[:, 0]]
    area = np.bincount(piece, triangle_normals(mesh)[1])
    return select_triangles(mesh, area[piece] >= smallest)


def select_triangles(mesh: Mesh, keep: Bools) -> Mesh:
    """Return the mesh of the chosen triangles (a mask), without unused vertices."""
    triangles = mesh.triangles[keep]
    used, inverse = np.unique(triangles, return_inverse=True)
    return Mesh(mesh.vertices[used], inverse.reshape(-1, 3))


def _edges(mesh: Mesh) -> tuple[Ints, Ints]:
    """Undirected edges, shape (E, 2), and how many triangles use each, shape (E,)."""
    count = len(mesh.vertices)
    pairs = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    keys, uses = np.unique(pairs[:, 0] * count + pairs[:, 1], return_counts=True)
    return np.column_stack([keys // max(count, 1), keys % max(count, 1)]), uses


def _components(count: int, edges: Ints) -> Ints:
    """Connected component of each of ``count`` vertices."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
