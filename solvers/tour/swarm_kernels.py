"""Compiled steps of a set-based particle swarm; import only where a solver runs."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]


@compiled
def sides(orders: Array, closed: bool, symmetric: bool, beside: Array) -> None:
    """Next place (and the one before, if symmetric) of each place in each order, or -1.

    ``orders`` has shape (particles, n), ``beside`` (particles, n, 2).
    """
    particles, n = orders.shape
    beside[:] = -1
    for p in range(particles):
        for k in range(n if closed else n - 1):
            a, b = orders[p, k], orders[p, (k + 1) % n]
            beside[p, a, 0] = b
            if symmetric:
                beside[p, b, 1] = a


@compiled
def drift(
    velocity: Array,
    beside: Array,
    best_beside: Array,
    teacher: Array,
    inertia: float,
    pull: float,
    rng: np.random.Generator,
) -> None:
    """Fade every velocity, and learn legs from the best orders that the teachers have found.

    Parameters
    ----------
    velocity
        Chance of each leg to be considered, in [0, 1], shape (particles, n, n).
    beside, best_beside
        Legs of the present and of the best orders, as :func:`sides` gives them.
    teacher
        Particle from which each one learns its legs at each place, (particles, n).
    inertia
        Share of the velocity that stays, in [0, 1].
    pull
        A leg is learnt with a chance of this times a random number, at most 1.
    rng
        All chance.

    """
    particles, n, _ = beside.shape
    for p in range(particles):
        for a in range(n):
            for b in range(n):
                velocity[p, a, b] *= inertia
            for side in range(2):
                b = best_beside[teacher[p, a], a, side]
                if b >= 0 and b != beside[p, a, 0] and b != beside[p, a, 1]:
                    chance = min(1.0, pull * rng.random())
                    velocity[p, a, b] = max(velocity[p, a, b], chance)


@compiled
def move(
    costs: Array,
    velocity: Array,
    beside: Array,
    orders: Array,
    end: int,
    rng: np.random.Generator,
) -> None:
    """Build new orders: the cheapest leg by velocity, else one of the old ones, else any.

    Column 0 of ``orders`` holds where to begin; the rest is filled. ``end`` is the place to
    visit last, or -1.
    """
    particles, n = orders.shape
    free = np.empty(n, dtype=np.bool_)
    for p in range(particles):
        threshold = 1.0 - rng.random()
        free[:] = True
        place = orders[p, 0]
        free[place] = False
        last = n
        if end >= 0 and end != place:
            free[end] = False
            last = n - 1
            orders[p, last] = end
        for k in range(1, last):
            fast, kept, near = -1, -1, -1
            for b in range(n):
                if not free[b]:
                    continue
                cost = costs[place, b]
                if velocity[p, place, b] >= threshold and (fast < 0 or cost < costs[place, fast]):
                    fast = b
                if near < 0 or cost < costs[place, near]:
                    near = b
            for side in range(2):
                b = beside[p, place, side]
                if b >= 0 and free[b] and (kept < 0 or costs[place, b] < costs[place, kept]):
                    kept = b
            if fast >= 0:
                place = fast
            elif kept >= 0:
                place = kept
            else:
                place = near
            orders[p, k] = place
            free[place] = False
