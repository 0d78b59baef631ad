"""Fewer positions, as evenly spread as a lattice can be."""

import itertools

import numpy as np

from planner.geometry.arrays import Floats, Ints


def thin_lattice(positions: Floats, *, spacing: float, limit: int) -> Ints:
    """Rows of the positions on the sublattice that leaves about ``limit`` of them.

    Of all sublattices ``x + a y + b z = 0 (mod k)`` of the grid the one whose nearest points are
    farthest apart is kept, which is the densest packing that the grid allows.

    Parameters
    ----------
    positions
        Points of a cubic grid, shape (V, 3), metres.
    spacing
        Edge of the grid, metres.
    limit
        How many rows are enough.

    Returns
    -------
    rows
        Ascending, shape (n,); all if there are not more than ``limit``.

    """
    if len(positions) <= limit:
        return np.arange(len(positions))
    index = np.rint((positions - positions.min(axis=0)) / spacing).astype(np.int64)
    factor = round(len(positions) / limit)
    turned = index @ np.array(_widest(factor))
    return np.flatnonzero(turned % factor == 0)


def _widest(factor: int) -> tuple[int, int, int]:
    """Row (1, a, b) of the sublattice of index ``factor`` with the longest shortest vector."""
    near = np.array([v for v in itertools.product(range(-4, 5), repeat=3) if any(v)])
    lengths = (near**2).sum(axis=1)
    best, widest = (1, 0, 0), -1
    for a, b in itertools.product(range(factor), repeat=2):
        inside = (near @ np.array([1, a, b])) % factor == 0
        shortest = int(lengths[inside].min(initial=99))
        if shortest > widest:
            best, widest = (1, a, b), shortest
    return best
