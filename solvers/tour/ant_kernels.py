"""Compiled walks of ants; import only where a solver runs."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]


@compiled
def walk(pull: Array, orders: Array, end: int, rng: np.random.Generator) -> None:
    """Have every ant visit all places, drawn to each by its pull.

    Parameters
    ----------
    pull
        Weight of the step from row to column, at least 0, shape (n, n).
    orders
        Column 0 holds where each ant begins; the rest is filled, int64 (ants, n).
    end
        Place to visit last, or -1.
    rng
        All chance.

    """
    ants, n = orders.shape
    free = np.empty(n, dtype=np.int64)
    for ant in range(ants):
        place = orders[ant, 0]
        left = 0
        for v in range(n):
            if v not in (place, end):
                free[left] = v
                left += 1
        for k in range(1, n):
            if left == 0:
                orders[ant, k] = end
                break
            row = pull[place]
            total = 0.0
            for j in range(left):
                total += row[free[j]]
            mark = total * rng.random()
            at = 0
            while at < left - 1:
                mark -= row[free[at]]
                if mark < 0.0:
                    break
                at += 1
            if total <= 0.0:
                at = int(rng.random() * left)
            place = free[at]
            orders[ant, k] = place
            left -= 1
            free[at] = free[left]


@compiled
def lengths(costs: Array, orders: Array, closed: bool) -> Array:
    """Cost of each order, shape (ants,)."""
    ants, n = orders.shape
    total = np.zeros(ants)
    for ant in range(ants):
        for k in range(n - 1):
            total[ant] += costs[orders[ant, k], orders[ant, k + 1]]
        if closed:
            total[ant] += costs[orders[ant, n - 1], orders[ant, 0]]
    return total


@compiled
def deposit(trail: Array, order: Array, amount: float, closed: bool, both_ways: bool) -> None:
    """Lay so much trail on each leg of an order."""
    n = len(order)
    for k in range(n if closed else n - 1):
        a, b = order[k], order[(k + 1) % n]
        trail[a, b] += amount
        if both_ways:
            trail[b, a] += amount
