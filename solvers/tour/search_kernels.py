"""Compiled 3-opt moves that can be undone, and kicks between them; import only where used."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]


class Walk(NamedTuple):
    """A closed tour under way, and what was done to it since the last kick."""

    tour: Array
    """Places in order, int32 (n,)."""
    position: Array
    """Where each place stands in ``tour``, int32 (n,)."""
    queue: Array
    """Ring of places to look at, int32 (n,)."""
    waiting: Array
    """Which places are in the ring, bool (n,)."""
    undo: Array
    """First and last position of each reversal made, in order, int32 (m, 2)."""
    made: Array
    """Number of reversals, first place in the ring, number of places in it, int64 (3,)."""


def new_walk(tour: Array) -> Walk:
    """Walk along a tour with every place waiting, in the order of the tour."""
    n = len(tour)
    position = np.empty(n, dtype=np.int32)
    position[tour] = np.arange(n, dtype=np.int32)
    return Walk(
        tour.astype(np.int32),
        position,
        tour.astype(np.int32),
        np.ones(n, dtype=np.bool_),
        np.empty((100 * n + 1000, 2), dtype=np.int32),
        np.array([0, 0, n], dtype=np.int64),
    )


@compiled
def _reverse(walk: Walk, i: int, j: int) -> bool:
    """Reverse positions ``i`` on to ``j``; or the rest, and then say so, if that is shorter."""
    tour, position = walk.tour, walk.position
    n = len(tour)
    inside = j - i + 1 if j >= i else j - i + 1 + n
    rest = 2 * inside > n
    if rest:
        i, j = (j + 1 if j + 1 < n else 0), (i - 1 if i > 0 else n - 1)
        inside = n - inside
    for _ in range(inside // 2):
        a, b = tour[i], tour[j]
        tour[i], tour[j] = b, a
        position[b], position[a] = i, j
        i = i + 1 if i + 1 < n else 0
        j = j - 1 if j > 0 else n - 1
    return rest


@compiled
def _turn(walk: Walk, first: int, last: int, step: int) -> int:
    """Reverse the stretch from ``first`` to ``last``, read along ``step``, and note it.

    Returns the step along which all else reads as before.
    """
    if step < 0:
        first, last = last, first
    i, j = walk.position[first], walk.position[last]
    walk.undo[walk.made[0], 0] = i
    walk.undo[walk.made[0], 1] = j
    walk.made[0] += 1
    return -step if _reverse(walk, i, j) else step


@compiled
def _take_back(walk: Walk) -> None:
    """Undo every reversal noted."""
    while walk.made[0] > 0:
        walk.made[0] -= 1
        _reverse(walk, walk.undo[walk.made[0], 0], walk.undo[walk.made[0], 1])


@compiled
def _beside(walk: Walk, place: int, step: int) -> int:
    """Neighbour of a place along ``step``, which is 1 or -1."""
    k = walk.position[place] + step
    n = len(walk.tour)
    return int(walk.tour[0 if k == n else (k if k >= 0 else n - 1)])


@compiled
def _await(walk: Walk, place: int) -> None:
    """Have a place looked at again."""
    if not walk.waiting[place]:
        walk.waiting[place] = True
        k = walk.made[1] + walk.made[2]
        n = len(walk.tour)
        walk.queue[k if k < n else k - n] = place
        walk.made[2] += 1


@compiled
def _await_all(walk: Walk, a: int, b: int, c: int, d: int, e: int, f: int) -> None:
    _await(walk, a)
    _await(walk, b)
    _await(walk, c)
    _await(walk, d)
    _await(walk, e)
    _await(walk, f)


@compiled
def _improve(costs: Array, near: Array, walk: Walk, t1: int, least: float) -> float:
    """Make the first 2-opt or 3-opt move found that removes an edge at ``t1``; what it saves.

    Sequential moves with positive partial gain (Lin and Kernighan, 1973,
    doi:10.1287/opre.21.2.498): out go the edges t1-t2, t3-t4 and t5-t6, in come t2-t3, t4-t5
    and t6-t1. Or-opt is among them. Zero if there is none.
    """
    n = len(walk.tour)
    position = walk.position
    for step in (1, -1):
        t2 = _beside(walk, t1, step)
        origin = position[t2]
        for t3 in near[t2]:
            gain1 = costs[t1, t2] - costs[t2, t3]
            if gain1 <= least:
                break
            if t3 == t1:
                continue
            behind3 = (position[t3] - origin) * step
            if behind3 < 0:
                behind3 += n
            # t3-t4 before t3: t1 t2..t4 t3.. becomes t1 t4..t2 t3..
            t4 = _beside(walk, t3, -step)
            if t4 != t2:
                gain2 = gain1 + costs[t3, t4]
                if gain2 - costs[t4, t1] > least:
                    _turn(walk, t2, t4, step)
                    _await_all(walk, t1, t2, t3, t4, t1, t2)
                    return float(gain2 - costs[t4, t1])
                for t5 in near[t4]:
                    gain3 = gain2 - costs[t4, t5]
                    if gain3 <= least:
                        break
                    if t5 == t1 or t5 == t3:  # noqa: PLR1714, SIM109
                        continue
                    behind5 = (position[t5] - origin) * step
                    if behind5 < 0:
                        behind5 += n
                    t6 = _beside(walk, t5, step if behind5 < behind3 else -step)
                    saved = gain3 + costs[t5, t6] - costs[t6, t1]
                    if t6 != t4 and saved > least:
                        onward = _turn(walk, t2, t4, step)
                        _turn(walk, t4, t6, onward)
                        _await_all(walk, t1, t2, t3, t4, t5, t6)
                        return float(saved)
            # t3-t4 after t3, which needs t5-t6 between t2 and t3
            t4 = _beside(walk, t3, step)
            gain2 = gain1 + costs[t3, t4]
            for t5 in near[t4]:
                gain3 = gain2 - costs[t4, t5]
                if gain3 <= least:
                    break
                behind5 = (position[t5] - origin) * step
                if behind5 < 0:
                    behind5 += n
                if behind5 >= behind3:
                    continue
                t6 = _beside(walk, t5, step)
                saved = gain3 + costs[t5, t6] - costs[t6, t1]
                if saved > least:  # t1 t2..t5 t6..t3 t4 becomes t1 t6..t3 t2..t5 t4
                    onward = _turn(walk, t2, t3, step)
                    onward = _turn(walk, t3, t6, onward)
                    _turn(walk, t5, t2, onward)
                    _await_all(walk, t1, t2, t3, t4, t5, t6)
                    return float(saved)
                if t5 == t2:
                    continue
                t6 = _beside(walk, t5, -step)
                saved = gain3 + costs[t5, t6] - costs[t6, t1]
                if saved > least:  # t1 t2..t6 t5..t3 t4 becomes t1 t6..t2 t3..t5 t4
                    onward = _turn(walk, t2, t6, step)
                    _turn(walk, t5, t3, onward)
                    _await_all(walk, t1, t2, t3, t4, t5, t6)
                    return float(saved)
    return 0.0


@compiled
def settle(costs: Array, near: Array, walk: Walk, least: float) -> float:
    """Improve until no place that waits has a move; the sum of what was saved.

    Don't-look bits as a queue: a place is looked at again once an edge at it has changed
    (Bentley, 1992, doi:10.1287/ijoc.4.4.387).

    Parameters
    ----------
    costs
        Symmetric, shape (n, n).
    near
        Candidate neighbours of each place, cheapest first, int32 (n, k).
    walk
        The tour, changed in place.
    least
        Smallest saving that counts, above rounding.

    """
    total = 0.0
    n = len(walk.tour)
    while walk.made[2] > 0:
        place = walk.queue[walk.made[1]]
        walk.made[1] = walk.made[1] + 1 if walk.made[1] + 1 < n else 0
        walk.made[2] -= 1
        walk.waiting[place] = False
        while walk.made[0] + 3 < len(walk.undo):
            saved = _improve(costs, near, walk, place, least)
            if saved <= 0.0:
                break
            total += saved
    return total


@compiled
def _kick(costs: Array, walk: Walk, at: int, first: int, second: int) -> float:
    """Swap the ``first`` places after position ``at`` and the ``second`` next; what it costs.

    A double bridge whose two inner stretches are short (Martin, Otto and Felten, 1991).
    """
    tour, n = walk.tour, len(walk.tour)
    before = tour[at]
    a, b = tour[(at + 1) % n], tour[(at + first) % n]
    c, d = tour[(at + first + 1) % n], tour[(at + first + second) % n]
    after = tour[(at + first + second + 1) % n]
    dearer = (
        costs[before, c]
        + costs[d, a]
        + costs[b, after]
        - costs[before, a]
        - costs[b, c]
        - costs[d, after]
    )
    onward = _turn(walk, a, d, 1)
    onward = _turn(walk, d, c, onward)
    _turn(walk, b, a, onward)
    _await_all(walk, before, a, b, c, d, after)
    return float(dearer)


@compiled
def _length(costs: Array, tour: Array) -> float:
    total = costs[tour[-1], tour[0]]
    for k in range(len(tour) - 1):
        total += costs[tour[k], tour[k + 1]]
    return float(total)


@compiled
def chain(
    costs: Array,
    near: Array,
    walk: Walk,
    best: Array,
    kicks: int,
    reach: int,
    heat: float,
    least: float,
    rng: np.random.Generator,
) -> float:
    """Kick, settle, and keep or take back, so many times.

    A worse tour is kept with the probability of simulated annealing at temperature ``heat``.

    Parameters
    ----------
    costs, near, walk, least
        As for :func:`settle`, which has been run.
    best
        Best tour so far, replaced when a better one comes up, int32 (n,).
    kicks
        How many.
    reach
        Most places that a kick moves, from 2 to n - 2.
    heat
        Excess in cost that is kept with probability 1/e, at least 0.
    rng
        All chance.

    Returns
    -------
    cost
        Of ``best``.

    """
    n = len(walk.tour)
    now, least_yet = _length(costs, walk.tour), _length(costs, best)
    for _ in range(kicks):
        walk.made[0] = 0
        at = int(rng.random() * n)
        both = 2 + int(rng.random() * (reach - 1))
        first = 1 + int(rng.random() * (both - 1))
        change = _kick(costs, walk, at, first, both - first) - settle(costs, near, walk, least)
        if change <= 0.0 or (heat > 0.0 and change < -heat * np.log(1.0 - rng.random())):
            now += change
            if now < least_yet - least:
                least_yet = now
                best[:] = walk.tour
        else:
            _take_back(walk)
    return least_yet
