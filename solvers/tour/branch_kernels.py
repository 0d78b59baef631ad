"""Compiled 1-trees among the edges that a branch leaves; import only where used."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.tour.edge_kernels import FREE, IN, Decisions, Edges
from solvers.tour.one_tree_kernels import rounding

Array = NDArray[Any]


class Trees(NamedTuple):
    """Room for 1-trees among the edges left, and what they told."""

    weight: Array
    """Cost of each edge with the prices of its ends, (m,)."""
    order: Array
    """Edges by weight, nearly, int32 (m,)."""
    inside: Array
    """Edges of the last 1-tree, bool (m,)."""
    best: Array
    """Edges of the 1-tree with the best bound, bool (m,)."""
    share: Array
    """Share of the recent 1-trees that each edge was in, (m,)."""
    rise: Array
    """How much the bound rises at least without an edge of the best 1-tree, (m,)."""
    implied: Array
    """Edges that the bound decides: edge + 1 for in, its negative for out, int32 (m,)."""
    degree: Array
    """Edges of the last 1-tree at each place, int32 (n,)."""
    root: Array
    """Disjoint sets of places; later the way to place 0, int32 (n,)."""
    link: Array
    """Edge on the way to place 0, int32 (n,)."""
    depth: Array
    """Edges on the way to place 0, int32 (n,)."""
    prices: Array
    """Prices of the places that give the best bound, (n,)."""
    trial: Array
    """Prices tried last, (n,)."""
    drift: Array
    """Direction of the last step, (n,)."""


def new_trees(edges: Edges, prices: Array) -> Trees:
    """Room for 1-trees, starting from these prices."""
    m, n = len(edges.cost), len(prices)
    order = np.argsort(edges.cost, kind="stable").astype(np.int32)
    weight, share, rise = np.zeros((3, m))
    inside, best = np.zeros((2, m), dtype=np.bool_)
    degree, root, link, depth = np.zeros((4, n), dtype=np.int32)
    implied = np.zeros(m, dtype=np.int32)
    own, trial = prices.copy(), prices.copy()
    return Trees(
        weight, order, inside, best, share, rise, implied,
        degree, root, link, depth, own, trial, np.zeros(n),
    )  # fmt: skip


@compiled
def _sort(order: Array, weight: Array) -> None:
    """Insertion sort, since the order is nearly right; another sort where it is not."""
    moved = 0
    for k in range(1, len(order)):
        edge = order[k]
        j = k - 1
        while j >= 0 and weight[order[j]] > weight[edge]:
            order[j + 1] = order[j]
            j -= 1
            moved += 1
        order[j + 1] = edge
        if moved > 20 * len(order):
            order[:] = np.argsort(weight, kind="mergesort")
            return


@compiled
def _find(root: Array, place: int) -> int:
    while root[place] != place:
        root[place] = root[root[place]]
        place = root[place]
    return place


@compiled
def _one_tree(edges: Edges, decided: Decisions, trees: Trees, prices: Array) -> float:
    """Cheapest 1-tree that keeps to the decisions, by Kruskal; infinity if there is none.

    Less what rounding may have added.
    """
    n = len(prices)
    last = n - 1
    for edge in range(len(edges.cost)):
        trees.weight[edge] = edges.cost[edge] + prices[edges.one[edge]] + prices[edges.other[edge]]
    _sort(trees.order, trees.weight)
    trees.inside[:] = False
    trees.degree[:] = 0
    for v in range(n):
        trees.root[v] = v
    total, weights, joined, ends = -2.0 * prices.sum(), 0.0, 0, 0
    for wanted in (IN, FREE):
        for edge in trees.order:
            if decided.state[edge] != wanted:
                continue
            a, b = edges.one[edge], edges.other[edge]
            if last in (a, b):
                if ends == 2:
                    continue
                ends += 1
            else:
                if joined == n - 2:
                    if ends == 2:
                        break
                    continue
                x, y = _find(trees.root, a), _find(trees.root, b)
                if x == y:
                    continue
                trees.root[x] = y
                joined += 1
            trees.inside[edge] = True
            trees.degree[a] += 1
            trees.degree[b] += 1
            total += trees.weight[edge]
            weights += abs(trees.weight[edge])
    if joined < n - 2 or ends < 2:
        return np.inf
    return float(total - rounding(prices, trees.degree, weights))


@compiled
def ascend(
    edges: Edges,
    decided: Decisions,
    trees: Trees,
    prices: Array,
    cutoff: float,
    upper: float,
    steps: int,
) -> tuple[float, bool]:
    """Best bound after some subgradient steps, and whether its 1-tree is a tour.

    ``prices`` become those of the best bound, ``trees.best`` its 1-tree.
    """
    trees.trial[:] = prices
    trees.drift[:] = 0.0
    best, pace, stale = -np.inf, 1.0, 0
    for step in range(steps):
        bound = _one_tree(edges, decided, trees, trees.trial)
        if bound == np.inf:
            return bound, False
        norm = 0.0
        for v in range(len(prices)):
            norm += (trees.degree[v] - 2.0) ** 2
        weight = 0.15 if step > 0 else 1.0
        for edge in range(len(trees.share)):
            trees.share[edge] += weight * (trees.inside[edge] - trees.share[edge])
        if bound > best or norm == 0.0:
            best, stale = bound, 0
            prices[:] = trees.trial
            trees.best[:] = trees.inside
        else:
            stale += 1
            if stale == 5:
                pace, stale = 0.6 * pace, 0
        if best >= cutoff or norm == 0.0:
            return best, norm == 0.0
        length = pace * (upper - bound) / norm
        for v in range(len(prices)):
            trees.drift[v] = 0.7 * (trees.degree[v] - 2.0) + 0.3 * trees.drift[v]
            trees.trial[v] += length * trees.drift[v]
    return best, False


@compiled
def _hang(edges: Edges, trees: Trees) -> None:
    """Way from each place to place 0 along the best 1-tree without the last place's edges."""
    n = len(trees.prices)
    last = n - 1
    trees.link[:] = -1
    trees.depth[:] = -1
    trees.depth[0] = 0
    queue = np.empty(n, dtype=np.int32)
    queue[0] = 0
    head, tail = 0, 1
    while head < tail:
        place = queue[head]
        head += 1
        for k in range(edges.starts[place], edges.starts[place + 1]):
            edge = edges.at[k]
            if not trees.best[edge]:
                continue
            on = edges.other[edge] if edges.one[edge] == place else edges.one[edge]
            if on != last and trees.depth[on] < 0:
                trees.depth[on] = trees.depth[place] + 1
                trees.root[on] = place
                trees.link[on] = edge
                queue[tail] = on
                tail += 1


@compiled
def imply(edges: Edges, decided: Decisions, trees: Trees, bound: float, cutoff: float) -> int:
    """List the edges that no tour below ``cutoff`` can have, or can lack; how many.

    An edge outside of the best 1-tree can only come for a free edge of the circle that it
    closes there, and one inside can only be replaced by such an edge.
    """
    last = len(trees.prices) - 1
    for edge in range(len(edges.cost)):
        trees.weight[edge] = (
            edges.cost[edge] + trees.prices[edges.one[edge]] + trees.prices[edges.other[edge]]
        )
    _hang(edges, trees)
    trees.rise[:] = np.inf
    count = 0
    for edge in range(len(edges.cost)):
        if trees.best[edge] or decided.state[edge] != FREE:
            continue
        a, b = edges.one[edge], edges.other[edge]
        dearest = -np.inf
        if last in (a, b):
            for k in range(edges.starts[last], edges.starts[last + 1]):
                inner = edges.at[k]
                if trees.best[inner] and decided.state[inner] == FREE:
                    dearest = max(dearest, trees.weight[inner])
                    trees.rise[inner] = min(
                        trees.rise[inner], trees.weight[edge] - trees.weight[inner]
                    )
        else:
            while a != b:
                if trees.depth[a] < trees.depth[b]:
                    a, b = b, a
                inner = trees.link[a]
                if decided.state[inner] == FREE:
                    dearest = max(dearest, trees.weight[inner])
                    trees.rise[inner] = min(
                        trees.rise[inner], trees.weight[edge] - trees.weight[inner]
                    )
                a = trees.root[a]
        if bound + trees.weight[edge] - dearest >= cutoff:
            trees.implied[count] = -edge - 1
            count += 1
    for edge in range(len(edges.cost)):
        if trees.best[edge] and decided.state[edge] == FREE and bound + trees.rise[edge] >= cutoff:
            trees.implied[count] = edge + 1
            count += 1
    return count
