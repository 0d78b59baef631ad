"""The no-fly hull as a mesh, for looking at: where the clearance is ``d_min``."""

from pathlib import Path

import numpy as np

from planner.airspace.airspace import Airspace
from planner.errors import PlannerError
from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import Mesh

FORMATS = (".ply", ".stl", ".obj", ".glb")
"""Endings of files that a hull can be saved as."""

_MOST_NODES = 1_500_000  # of the lattice: some ten seconds
_CORNERS = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)


def hull_mesh(airspace: Airspace, *, cell: float | None = None) -> Mesh:
    """Surface within which solids are nearer than ``d_min``, by naive surface nets.

    Parameters
    ----------
    airspace
        Solids; zones are no part of the hull.
    cell
        Width of the cells, metres; by default half of ``d_min``, or wider where that would be
        more than a million and a half. What is thinner than a cell may be missed.

    Returns
    -------
    mesh
        Closed but at the bounds, local metres, faces outward; for looking at, not for proofs.

    Raises
    ------
    ValueError
        If the cell is not positive.

    """
    low, high = airspace.bounds
    width = 0.5 * airspace.d_min if cell is None else cell
    if not width > 0.0:
        raise ValueError(f"cell must be positive, got {width}.")
    while cell is None and np.prod((high - low) / width + 2.0) > _MOST_NODES:
        width *= 1.05
    shape = np.ceil((high - low) / width).astype(np.int64) + 1
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    nodes = low + index.reshape(-1, 3) * width
    field = airspace.clearance_range(nodes)[0] - airspace.d_min
    vertices, triangles = surface_net(field.reshape(shape))
    return Mesh(low + vertices * width, triangles)


def save_hull(mesh: Mesh, path: str | Path) -> None:
    """Write a hull for any viewer of meshes.

    Raises
    ------
    PlannerError
        If the ending is not one of :data:`FORMATS` or the file cannot be written.

    """
    import trimesh

    if Path(path).suffix.lower() not in FORMATS:
        raise PlannerError(f"{path}: is no known mesh format; end it in {', '.join(FORMATS)}")
    try:
        trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(str(path))
    except OSError as error:
        raise PlannerError(f"{path}: cannot be written ({error.strerror}); check it") from None


def surface_net(field: Floats) -> tuple[Floats, Ints]:
    """Surface between negative and other values on a lattice.

    Each cell that the surface passes has one vertex, in the middle of where the edges of the
    cell cross it; each crossed edge has a face between the four cells around it (Gibson, 1998,
    doi:10.1007/BFb0056277).

    Parameters
    ----------
    field
        Shape (nx, ny, nz).

    Returns
    -------
    vertices, triangles
        Shapes (n, 3), in steps of the lattice, and (m, 3); faces point to values from 0.

    """
    inside = field < 0.0
    size = np.array(field.shape) - 1
    count = np.zeros(size, dtype=np.int64)
    for corner in _CORNERS:
        count += _part(inside, corner, size)
    cells = np.argwhere((count > 0) & (count < len(_CORNERS)))
    number = np.full(size, -1, dtype=np.int64)
    number[tuple(cells.T)] = np.arange(len(cells))
    quads = [_faces(inside, number, axis) for axis in range(3)]
    corners = np.concatenate(quads) if quads else np.zeros((0, 4), dtype=np.int64)
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return _centres(field, inside, cells), triangles


def _part(values: Bools, corner: Ints, size: Ints) -> Bools:
    """Values at one corner of every cell."""
    i, j, k = corner.tolist()
    return values[i : i + size[0], j : j + size[1], k : k + size[2]]


def _centres(field: Floats, inside: Bools, cells: Ints) -> Floats:
    """Mean of the places where the twelve edges of each cell cross the surface, (n, 3)."""
    total, crossings = np.zeros((len(cells), 3)), np.zeros((len(cells), 1))
    for axis in range(3):
        step = np.eye(3, dtype=np.int64)[axis]
        for corner in _CORNERS[_CORNERS[:, axis] == 0]:
            one, other = tuple((cells + corner).T), tuple((cells + corner + step).T)
            crossed = inside[one] != inside[other]
            rise = np.where(crossed, field[other] - field[one], 1.0)
            at = cells + corner + np.where(crossed, -field[one] / rise, 0.0)[:, None] * step
            total += np.where(crossed[:, None], at, 0.0)
            crossings += crossed[:, None]
    return np.asarray(total / crossings)


def _faces(inside: Bools, number: Ints, axis: int) -> Ints:
    """Vertices around each crossed edge along an axis, (n, 4), seen from outside."""
    along = np.moveaxis(inside, axis, 0)
    around = np.moveaxis(number, axis, 0)
    rises = along[:-1, 1:-1, 1:-1] != along[1:, 1:-1, 1:-1]
    i, j, k = np.nonzero(rises)
    quads = np.stack([around[i, j + a, k + b] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1)
    leaves = along[i, j + 1, k + 1]  # the edge goes from inside to outside
    turned = leaves if axis != 1 else ~leaves  # moving the second axis first mirrors space
    return np.where(turned[:, None], quads, quads[:, ::-1])
