"""Which places a move may join a place to."""

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import Floats


def nearest_lists(costs: Floats, count: int) -> NDArray[np.int32]:
    """The ``count`` cheapest neighbours of each place, cheapest first, shape (n, count)."""
    apart = costs.copy()
    np.fill_diagonal(apart, np.inf)
    near = np.argpartition(apart, count - 1, axis=1)[:, :count]
    return _by_cost(apart, near)


def likely_lists(costs: Floats, prices: Floats, count: int, likely: int) -> NDArray[np.int32]:
    """Neighbours by how little a 1-tree rises with them, filled up by the cheapest ones.

    Cheapest neighbours alone never lead out of a crowd of places; these do (Helsgaun, 2000,
    doi:10.1016/S0377-2217(99)00284-2).

    Parameters
    ----------
    costs
        Symmetric, shape (n, n), n >= 4.
    prices
        Prices of the places from the ascent of Held and Karp, shape (n,).
    count
        Neighbours a place, at most n - 1.
    likely
        How many of them to take by the 1-tree, at most ``count``.

    Returns
    -------
    lists
        Cheapest first, shape (n, count).

    """
    from solvers.tour.one_tree_kernels import new_one_tree, one_tree, spare

    tree = new_one_tree(len(costs))
    one_tree(costs, prices, tree)
    rank = spare(costs, prices, tree)
    np.fill_diagonal(rank, np.inf)
    first = np.argpartition(rank, likely - 1, axis=1)[:, :likely]
    apart = costs.copy()
    np.fill_diagonal(apart, np.inf)
    np.copyto(rank, apart)
    np.put_along_axis(rank, first, -1.0, axis=1)  # these come before all others
    return _by_cost(apart, np.argpartition(rank, count - 1, axis=1)[:, :count])


def _by_cost(costs: Floats, lists: NDArray[np.intp]) -> NDArray[np.int32]:
    lists.sort(axis=1)  # so that the stable sort by cost leaves ties at the lowest index
    order = np.argsort(np.take_along_axis(costs, lists, axis=1), axis=1, kind="stable")
    return np.take_along_axis(lists, order, axis=1).astype(np.int32)
