"""Exact shortest paths among boxes of full height, by the planar visibility graph."""

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import Floats
from solvers.motion.boxes import Boxes
from solvers.motion.graph import shortest_route
from solvers.motion.problem import Waypoints

_ROUNDING = 1e-12  # share of the largest coordinate within which an edge only touches


def shortest_path(boxes: Boxes, start: Floats, goal: Floats) -> Waypoints | None:
    """Shortest path that enters no box.

    In the plane it turns at corners of boxes only, so that it is a shortest path in the
    graph of all corners that see each other (Lozano-Perez and Wesley, 1979,
    doi:10.1145/359156.359164). As the boxes are of full height, the path in space is that
    one with the other coordinates changing evenly along it. It touches corners; what
    lies within rounding counts as touching, so that the length is never too large.

    Parameters
    ----------
    boxes
        The obstacles, all of whose corners the path may use.
    start, goal
        Free points, shape (d,), d >= 2.

    Returns
    -------
    path
        Corners, shape (k, d), or ``None`` if there is no path.

    """
    low, high = boxes.corners[:, 0], boxes.corners[:, 1]
    scale = _ROUNDING * max(float(np.abs(boxes.corners).max(initial=0.0)), 1e-300)
    columns = [np.column_stack([x[:, 0], y[:, 1]]) for x in (low, high) for y in (low, high)]
    corners = np.concatenate(columns)
    within = (corners[:, None] > low + scale) & (corners[:, None] < high - scale)
    buried = (within[:, :, 0] & within[:, :, 1]).any(axis=1)
    nodes = np.vstack([start[:2], goal[:2], corners[~buried]])
    a, b = np.triu_indices(len(nodes), 1)
    seen = _sees(nodes[a], nodes[b], low, high, scale)
    route = shortest_route(nodes, np.column_stack([a[seen], b[seen]]), 0, 1)
    if not route:
        return None
    planar = nodes[route]
    reach = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(planar, axis=0), axis=1))])
    share = reach / reach[-1] if reach[-1] > 0.0 else np.linspace(0.0, 1.0, len(reach))
    path = start + share[:, None] * (goal - start)
    path[:, :2] = planar
    path[-1] = goal
    return path


def _sees(a: Floats, b: Floats, low: Floats, high: Floats, scale: float) -> NDArray[np.bool_]:
    """Which edges enter no open box, shape (edges,), by separating axes."""
    along, size = b - a, np.linalg.norm(b - a, axis=1)
    blocked = np.zeros(len(a), dtype=np.bool_)
    for corner, opposite in zip(low, high, strict=True):  # boxes are few, edges are many
        over = (np.maximum(a, b) > corner + scale) & (np.minimum(a, b) < opposite - scale)
        across, half = (corner + opposite) / 2.0 - a, (opposite - corner) / 2.0
        beside = np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
        width = half[0] * np.abs(along[:, 1]) + half[1] * np.abs(along[:, 0])
        blocked |= over.all(axis=1) & (beside < width - scale * size)
    return ~blocked
