"""Shorten a free path without ever leaving free space."""

from collections.abc import Callable

import numpy as np

from solvers.motion.problem import Waypoints

Edge = Callable[[Waypoints, Waypoints], bool]

_TRIES = 6  # of one move: all of it, then half of it, and so on
_WORTH = 1e-4  # share of the length that another sweep must be likely to save


def straightened(path: Waypoints, edge_is_free: Edge) -> Waypoints:
    """Leave out corners: from each kept one, jump to the farthest that is in free reach."""
    kept, at = [0], 0
    while at < len(path) - 1:
        ahead = len(path) - 1
        while ahead > at + 1 and not edge_is_free(path[at], path[ahead]):
            ahead -= 1
        kept.append(ahead)
        at = ahead
    return path[kept]


def shortcut(
    path: Waypoints, edge_is_free: Edge, rng: np.random.Generator, *, rounds: int
) -> Waypoints:
    """Join random pairs of points on the path by straight edges where these are free.

    Parameters
    ----------
    path
        Corners, shape (k, d); every edge is free.
    edge_is_free
        Exact check of one straight edge.
    rng
        Source of the pairs.
    rounds
        How many pairs to try.

    Returns
    -------
    shorter
        Corners, same ends, every edge free, never longer than ``path``.

    """
    path = straightened(path, edge_is_free)
    for _ in range(rounds):
        if len(path) < 3:
            break
        reach = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))))
        low, high = np.sort(rng.random(2)) * reach[-1]
        i, j = (int(np.searchsorted(reach, at, side="right")) - 1 for at in (low, high))
        i, j = min(i, len(path) - 2), min(j, len(path) - 2)
        if i == j:
            continue
        a, b = (_on_edge(path, reach, k, at) for k, at in ((i, low), (j, high)))
        # The stumps too: rounding may move their end off the edge that was checked. The long
        # edge first: where it is not free, the others need no check.
        if all(edge_is_free(*edge) for edge in ((a, b), (path[i], a), (b, path[j + 1]))):
            path = np.concatenate([path[: i + 1], [a, b], path[j + 1 :]])
    return straightened(path, edge_is_free)


def tightened(path: Waypoints, edge_is_free: Edge, *, sweeps: int) -> Waypoints:
    """Pull the path taut: slide each corner along its edges, then towards its neighbours' chord.

    A corner goes as far as both of its edges stay free, by bisection: along the edge ahead,
    along the edge behind, and towards the chord one coordinate at a time, so that what
    blocks one direction does not hold up the others. Nothing is left to chance.

    Parameters
    ----------
    path
        Corners, shape (k, d); every edge is free.
    edge_is_free
        Exact check of one straight edge.
    sweeps
        Most passes over all corners; a pass that saves next to nothing is the last.

    Returns
    -------
    shorter
        Corners, same ends, every edge free, never longer than ``path``.

    """
    corners = list(path)
    for _ in range(sweeps):
        before = _length(corners)
        k = 1
        while k < len(corners) - 1:
            if edge_is_free(corners[k - 1], corners[k + 1]):
                del corners[k]
                continue
            corners[k] = _pulled(corners, k, edge_is_free, _WORTH * before)
            k += 1
        if _length(corners) > (1.0 - _WORTH) * before:
            break
    return np.array(corners)


def _pulled(corners: list[Waypoints], k: int, edge_is_free: Edge, least: float) -> Waypoints:
    """Corner ``k`` after its moves, each of them longer than ``least``."""
    a, corner, b = corners[k - 1], corners[k], corners[k + 1]
    for axis in range(-2, len(corner)):
        step = _step(a, corner, b, axis)
        if np.abs(step).max() <= least:
            continue
        length, low, high, at = _detour(a, corner, b), 0.0, 1.0, 1.0
        for _ in range(_TRIES):
            tried = corner + at * step
            shorter = _detour(a, tried, b) < length
            if shorter and edge_is_free(a, tried) and edge_is_free(tried, b):
                low = at
            else:
                high = at
            if low == high:
                break
            at = (low + high) / 2.0
        corner = corner + low * step
    return corner


def _step(a: Waypoints, corner: Waypoints, b: Waypoints, axis: int) -> Waypoints:
    """Longest step of a corner: on to ``b``, back to ``a``, or one axis of that to the chord."""
    if axis < 0:
        return (b if axis == -2 else a) - corner
    chord = b - a
    share = np.clip((corner - a) @ chord / max(float(chord @ chord), 1e-300), 0.0, 1.0)
    step = np.zeros(len(corner))
    step[axis] = a[axis] + share * chord[axis] - corner[axis]
    return step


def _detour(a: Waypoints, corner: Waypoints, b: Waypoints) -> float:
    return float(np.linalg.norm(corner - a) + np.linalg.norm(b - corner))


def _length(corners: list[Waypoints]) -> float:
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())


def _on_edge(path: Waypoints, reach: Waypoints, k: int, at: float) -> Waypoints:
    length = reach[k + 1] - reach[k]
    share = (at - reach[k]) / length if length > 0.0 else 0.0
    return np.asarray(path[k] + share * (path[k + 1] - path[k]))
