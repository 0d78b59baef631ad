"""Nearest neighbours in a cloud."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.geometry.arrays import Floats, Ints

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


@dataclass(frozen=True, slots=True, eq=False)
class Neighbours:
    """A search tree over points.

    Parameters
    ----------
    tree
        SciPy's tree.

    """

    tree: "cKDTree[None]"

    @classmethod
    def of(cls, xyz: Floats) -> "Neighbours":
        """Build the tree of points, shape (N, 3)."""
        from scipy.spatial import cKDTree

        return cls(cKDTree(xyz, balanced_tree=False, compact_nodes=False))

    def nearest(self, queries: Floats, count: int) -> tuple[Floats, Ints]:
        """Distances and rows of the ``count`` nearest points of each query, shape (Q, count)."""
        distance, row = self.tree.query(queries, k=np.arange(1, count + 1))
        return np.asarray(distance), np.asarray(row, dtype=np.int64)
