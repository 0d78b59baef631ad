"""Shorten a free path without ever leaving free space."""

from collections.abc import Callable

import numpy as np

from solvers.motion.problem import Waypoints

Edge = Callable[[Waypoints, Waypoints], bool]


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
        # The stumps too: rounding may move their end off the edge that was checked.
        ends = (edge_is_free(path[i], a), edge_is_free(a, b), edge_is_free(b, path[j + 1]))
        if all(ends):
            path = np.concatenate([path[: i + 1], [a, b], path[j + 1 :]])
    return straightened(path, edge_is_free)


def _on_edge(path: Waypoints, reach: Waypoints, k: int, at: float) -> Waypoints:
    length = reach[k + 1] - reach[k]
    share = (at - reach[k]) / length if length > 0.0 else 0.0
    return np.asarray(path[k] + share * (path[k + 1] - path[k]))
