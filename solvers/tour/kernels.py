"""Compiled local search on closed symmetric tours; import only where a solver runs."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]


@compiled
def _reverse(tour: Array, position: Array, i: int, j: int) -> None:
    """Reverse the stretch from position ``i`` on to ``j``, or what is left of the tour."""
    n = len(tour)
    inside = (j - i) % n + 1
    if 2 * inside > n:  # the rest gives the same closed tour and is shorter
        i, j = (j + 1) % n, (i - 1) % n
        inside = n - inside
    for _ in range(inside // 2):
        a, b = tour[i], tour[j]
        tour[i], tour[j] = b, a
        position[b], position[a] = i, j
        i = i + 1 if i + 1 < n else 0
        j = j - 1 if j > 0 else n - 1


@compiled
def _two_opt(costs: Array, near: Array, tour: Array, position: Array, a: int, least: float) -> int:
    """Try to swap an edge at ``a`` for a shorter one; the far place, or -1."""
    n = len(tour)
    for ahead in (True, False):
        b = tour[(position[a] + 1) % n] if ahead else tour[position[a] - 1]
        for c in near[a]:
            saved = costs[a, b] - costs[a, c]
            if saved <= least:
                break
            d = tour[(position[c] + 1) % n] if ahead else tour[position[c] - 1]
            if c == b or d == a:
                continue
            if saved + costs[c, d] - costs[b, d] > least:
                if ahead:  # ... a b ... c d ... becomes ... a c ... b d ...
                    _reverse(tour, position, position[b], position[c])
                else:  # ... d c ... b a ... becomes ... d b ... c a ...
                    _reverse(tour, position, position[c], position[b])
                return int(c)
    return -1


@compiled
def _or_opt(costs: Array, near: Array, tour: Array, position: Array, a: int, least: float) -> int:
    """Try to move a stretch of up to three that ends at ``a`` next to a neighbour of ``a``.

    Three reversals do the move. Returns the place moved to, or -1.
    """
    n = len(tour)
    for length in range(1, 4):
        if n < length + 3:
            return -1
        for ahead in (True, False):
            step = 1 if ahead else -1
            z = tour[(position[a] + step * (length - 1)) % n]
            before = tour[(position[a] - step) % n]
            after = tour[(position[z] + step) % n]
            removed = costs[before, a] + costs[z, after] - costs[before, after]
            if removed <= least:
                continue
            for c in near[a]:
                if removed - costs[a, c] <= least:
                    break
                offset = (position[c] - position[a]) * step % n
                if offset < length:  # c lies in the stretch itself
                    continue
                for side in (1, -1):
                    d = tour[(position[c] + step * side) % n]
                    if (position[d] - position[a]) * step % n < length:
                        continue  # that edge goes with the stretch
                    if removed - costs[a, c] - costs[z, d] + costs[c, d] > least:
                        _move(tour, position, a, z, c, d, step)
                        return int(c)
    return -1


@compiled
def _move(tour: Array, position: Array, a: int, z: int, c: int, d: int, step: int) -> None:
    """Put the stretch ``a`` to ``z`` between the neighbours ``c`` and ``d``, ``a`` beside ``c``.

    Read in the direction of ``step``, the tour is ``before [a..z] [after..first] second``.
    """
    n = len(tour)
    before = tour[(position[a] - step) % n]
    after = tour[(position[z] + step) % n]
    c_comes_first = tour[(position[c] + step) % n] == d
    first = c if c_comes_first else d
    _turn(tour, position, a, first, before)  # before [first..after] [z..a] second
    _turn(tour, position, first, after, before)  # before [after..first] [z..a] second
    if c_comes_first:
        _turn(tour, position, z, a, before)  # before [after..first] [a..z] second


@compiled
def _turn(tour: Array, position: Array, p: int, q: int, outside: int) -> None:
    """Reverse the stretch between ``p`` and ``q`` that ``outside`` is not part of.

    Named by places, since each reversal may turn round what counts as forwards.
    """
    n = len(tour)
    if (position[q] - position[p]) % n < (position[outside] - position[p]) % n:
        _reverse(tour, position, position[p], position[q])
    else:
        _reverse(tour, position, position[q], position[p])


@compiled
def descend(costs: Array, near: Array, tour: Array, least: float) -> None:
    """Improve ``tour`` in place by 2-opt and Or-opt until neither finds anything.

    Don't-look bits as a queue: a place is looked at again once an edge at it has changed
    (Bentley, 1992, doi:10.1287/ijoc.4.4.387).

    Parameters
    ----------
    costs
        Symmetric, shape (n, n).
    near
        Candidate neighbours of each place, cheapest first, shape (n, k).
    tour
        Closed tour, shape (n,).
    least
        Smallest saving that counts, above rounding.

    """
    n = len(tour)
    position = np.empty(n, dtype=np.int64)
    for k in range(n):
        position[tour[k]] = k
    queue = tour.copy()
    waiting = np.ones(n, dtype=np.bool_)
    head, count = 0, n
    while count > 0:
        a = queue[head]
        head = head + 1 if head + 1 < n else 0
        count -= 1
        waiting[a] = False
        while True:
            left, right = tour[position[a] - 1], tour[(position[a] + 1) % n]
            c = _two_opt(costs, near, tour, position, a, least)
            if c < 0:
                c = _or_opt(costs, near, tour, position, a, least)
            if c < 0:
                break
            for p in (a, c, left, right):
                for q in (p, tour[position[p] - 1], tour[(position[p] + 1) % n]):
                    if not waiting[q]:
                        waiting[q] = True
                        queue[(head + count) % n] = q
                        count += 1
