"""Compiled 1-trees on full cost matrices; import only where used.

A 1-tree is a spanning tree on all places but the last, and two edges at the last. A tour is
one, so the cheapest 1-tree is no dearer than the cheapest tour, and prices on the places
that every tour pays twice raise it (Held and Karp, 1970, doi:10.1287/opre.18.6.1138).
"""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]

_EPSILON = 2.0**-52  # of a float


class OneTree(NamedTuple):
    """The cheapest 1-tree found last, and room to find the next."""

    parent: Array
    """Next place on the way to place 0, int32 (n,); the last place's two in [n - 1] and [0]."""
    degree: Array
    """Edges at each place, int32 (n,)."""
    reach: Array
    """Cheapest cost from the tree to each place, without that place's price, (n,)."""
    rest: Array
    """Places not yet in the tree, int32 (n,)."""
    joined: Array
    """Places in the order in which they joined the tree, int32 (n,)."""


def new_one_tree(n: int) -> OneTree:
    """Room for 1-trees on n places."""
    whole = [np.zeros(n, dtype=np.int32) for _ in range(4)]
    return OneTree(whole[0], whole[1], np.zeros(n), whole[2], whole[3])


@compiled
def rounding(prices: Array, degree: Array, weights: float) -> float:
    """Most that rounding may have added to the sum of a 1-tree less all prices twice.

    ``weights`` is the sum of its edges' absolute costs with prices. Twice the usual bound for
    sums of n + 8 numbers, and the slips in comparing edges, whose terms are up to four prices.
    """
    n = len(prices)
    size, largest = weights, 0.0
    for v in range(n):
        price = abs(prices[v])
        size += 2.0 * (degree[v] + 1.0) * price
        largest = max(largest, price)
    return float(_EPSILON * ((n + 8.0) * size + 8.0 * n * largest))


@compiled
def one_tree(costs: Array, prices: Array, tree: OneTree) -> float:
    """Cheapest 1-tree with prices added at both ends of each edge; its cost less all prices twice.

    Less what rounding may have added, too. Prim's algorithm, n^2 steps.
    """
    parent, degree, reach, rest, joined = tree
    last = len(costs) - 1
    degree[:] = 0
    left = last - 1
    for k in range(left):
        rest[k] = k + 1
        reach[k + 1] = costs[0, k + 1] + prices[0]
        parent[k + 1] = 0
    joined[0] = 0
    total, weights = 0.0, 0.0
    while left > 0:
        at, place = 0, rest[0]
        least = reach[place] + prices[place]
        for k in range(1, left):
            v = rest[k]
            cost = reach[v] + prices[v]
            if cost < least:
                at, place, least = k, v, cost
        total += least
        weights += abs(least)
        degree[place] += 1
        degree[parent[place]] += 1
        joined[last - left] = place
        left -= 1
        rest[at] = rest[left]
        row, price = costs[place], prices[place]
        for k in range(left):
            v = rest[k]
            cost = row[v] + price
            if cost < reach[v]:
                reach[v] = cost
                parent[v] = place
    first, second = -1, -1
    for v in range(last):
        cost = costs[last, v] + prices[v]
        if first < 0 or cost < costs[last, first] + prices[first]:
            first, second = v, first
        elif second < 0 or cost < costs[last, second] + prices[second]:
            second = v
    degree[last] = 2
    degree[first] += 1
    degree[second] += 1
    parent[last], parent[0] = first, second
    for v in (first, second):
        cost = costs[last, v] + prices[v] + prices[last]
        total += cost
        weights += abs(cost)
    return float(total - 2.0 * prices.sum() - rounding(prices, degree, weights))


@compiled
def ascend(
    costs: Array,
    prices: Array,
    trial: Array,
    drift: Array,
    pace: Array,
    upper: float,
    steps: int,
    tree: OneTree,
) -> float:
    """Raise the bound by subgradient steps; may be called again to go on.

    The step is Polyak's, aimed at ``upper``; its direction is smoothed as by Volgenant and
    Jonker (1982, doi:10.1016/0377-2217(82)90015-7), and its length shrinks when the bound
    stays.

    Parameters
    ----------
    costs
        Symmetric, shape (n, n), n >= 3.
    prices
        Best prices so far, replaced by better ones, shape (n,).
    trial, drift
        Prices tried last and direction of the last step, shape (n,).
    pace
        Share of the full step, steps without gain, best bound so far, shape (3,); begin with
        2, 0 and minus infinity. The share is 0 once nothing is left to gain.
    upper
        Cost of some tour.
    steps
        Most steps.
    tree
        Room to work.

    Returns
    -------
    bound
        The best so far; at most the cost of any tour.

    """
    for _ in range(steps):
        if pace[0] <= 0.0:
            break
        bound = one_tree(costs, trial, tree)
        if bound > pace[2]:
            pace[1], pace[2] = 0.0, bound
            prices[:] = trial
        else:
            pace[1] += 1.0
            if pace[1] >= 10.0:
                pace[0], pace[1] = 0.7 * pace[0], 0.0
        norm = 0.0
        for v in range(len(prices)):
            norm += (tree.degree[v] - 2.0) ** 2
        if norm == 0.0 or pace[0] < 1e-4 or pace[2] >= upper:
            pace[0] = 0.0
            break
        step = pace[0] * (upper - bound) / norm
        for v in range(len(prices)):
            drift[v] = 0.7 * (tree.degree[v] - 2.0) + 0.3 * drift[v]
            trial[v] += step * drift[v]
    return float(pace[2])


@compiled
def spare(costs: Array, prices: Array, tree: OneTree) -> Array:
    """How much the cheapest 1-tree rises if an edge must be in it, shape (n, n).

    Known as alpha (Helsgaun, 2000, doi:10.1016/S0377-2217(99)00284-2). Zero for the edges of
    the tree, and on the diagonal. ``tree`` must be the cheapest for ``prices``.
    """
    parent, joined = tree.parent, tree.joined
    last = len(costs) - 1
    rise = np.zeros_like(costs)  # first: the dearest edge between two places on the tree
    for j in range(1, last):
        v = joined[j]
        up = parent[v]
        edge = costs[v, up] + prices[v] + prices[up]
        for k in range(j):
            u = joined[k]
            dearest = edge if u == up else max(edge, rise[up, u])
            rise[v, u] = dearest
            rise[u, v] = dearest
    for u in range(last):
        for v in range(u):
            gap = max(0.0, costs[u, v] + prices[u] + prices[v] - rise[u, v])
            rise[u, v] = gap
            rise[v, u] = gap
    second = parent[0]
    for v in range(last):
        gap = costs[last, v] + prices[v] - costs[last, second] - prices[second]
        rise[last, v] = max(0.0, gap)
        rise[v, last] = max(0.0, gap)
    return rise
