"""The downhill simplex method as a generator, so that many searches can step together."""

from collections.abc import Generator

import numpy as np

from planner.geometry.arrays import Floats

Search = Generator[Floats, tuple[Floats, Floats], tuple[Floats, float]]


def climb(start: Floats, *, size: float, evaluations: int) -> Search:
    """Search for the highest value around a point (Nelder and Mead, 1965).

    Yields points of shape (k, n) to be looked at; wants back, by ``send``, where they really
    were looked at, since a point may have been moved into what is allowed, and their values.

    Parameters
    ----------
    start
        First corner of the simplex, shape (n,).
    size
        Length of its edges along the axes.
    evaluations
        After how many points no new step begins.

    Returns
    -------
    best, value
        Highest point that was looked at, and its value.

    """
    corners = start + np.vstack([np.zeros(len(start)), size * np.eye(len(start))])
    corners, values = yield corners
    corners, values = corners.copy(), values.copy()
    used = len(corners)
    while used < evaluations:
        order = np.argsort(-values, kind="stable")
        corners, values = corners[order], values[order]
        middle, worst = corners[:-1].mean(axis=0), corners[-1]
        at, value = yield from _look(2.0 * middle - worst)
        used += 1
        if value > values[0]:  # go on that way
            farther, more = yield from _look(3.0 * middle - 2.0 * worst)
            used += 1
            at, value = (farther, more) if more > value else (at, value)
        elif value <= values[-2]:  # come back
            nearer = 1.5 * middle - 0.5 * worst if value > values[-1] else 0.5 * (middle + worst)
            inner, more = yield from _look(nearer)
            used += 1
            if more <= max(value, values[-1]):
                shrunk, levels = yield 0.5 * (corners[0] + corners[1:])
                corners[1:], values[1:] = shrunk, levels
                used += len(shrunk)
                continue
            at, value = inner, more
        corners[-1], values[-1] = at, value
    best = int(np.argmax(values))
    return corners[best], float(values[best])


def _look(point: Floats) -> Search:
    """Ask for the value of one point."""
    at, values = yield point[None]
    return at[0], float(values[0])
