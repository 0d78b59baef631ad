"""Seeded motion problems whose shortest path is known."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from solvers.arrays import Floats
from solvers.errors import InvalidProblem
from solvers.motion.boxes import Boxes
from solvers.motion.problem import MotionProblem, Waypoints
from solvers.motion.visibility import shortest_path

_TRIES = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """A problem with its name and its exact answer.

    Parameters
    ----------
    name
        What tables call it.
    problem
        From a start to a goal among the boxes; it pickles.
    boxes
        The obstacles.
    shortest
        The shortest path, shape (k, d). It touches boxes, which no path that is checked in
        floating point may: solvers come near its length and never below.
    best_known
        Length of the shortest path.

    """

    name: str
    problem: MotionProblem
    boxes: Boxes
    shortest: Waypoints
    best_known: float


def random_boxes(
    seed: int, *, boxes: int = 10, side: float = 100.0, height: float = 30.0
) -> Instance:
    """Two places in a field of full-height boxes, with the straight line between them blocked.

    Parameters
    ----------
    seed
        Same seed, same problem; at least 0.
    boxes
        How many boxes, from 1; their sides are 6 to 22 % of the field's, and they may overlap.
    side, height
        Extent of the field, positive: the path stays in [0, side] x [0, side] x [0, height].

    Returns
    -------
    instance
        Start and goal are half a side apart or more, and a hundredth of it from every box.

    Raises
    ------
    InvalidProblem
        If a size makes no sense, or so many boxes leave no room for such a problem.

    """
    if boxes < 1 or not (side > 0.0 and height > 0.0):
        raise InvalidProblem(f"need boxes, got {boxes}, in a field, got {side} x {height}.")
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(boxes,)))
    bounds = np.array([[0.0, 0.0, 0.0], [side, side, height]])
    for _ in range(_TRIES):
        size = rng.uniform(0.06, 0.22, (boxes, 2)) * side
        low = rng.uniform(0.0, 1.0, (boxes, 2)) * (side - size)
        field = Boxes(np.stack([low, low + size], axis=1))
        start, goal = rng.uniform(bounds[0], bounds[1], (2, 3))
        if np.linalg.norm((goal - start)[:2]) < 0.5 * side or field.edge_is_free(start, goal):
            continue
        if any(_distance(field, point) < 0.01 * side for point in (start, goal)):
            continue
        path = shortest_path(field, start, goal)
        if path is None:
            continue
        length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        checks = (field.is_free, field.edge_is_free)
        problem = MotionProblem(start, goal, bounds, *checks, step=0.05 * side)
        return Instance(f"boxes-{boxes}-{seed}", problem, field, path, length)
    raise InvalidProblem(f"{boxes} boxes leave no room for two places that cannot see each other.")


def random_instances(count: int, *, first: int = 0, boxes: int = 10) -> Iterator[Instance]:
    """The problems of ``count`` seeds from ``first`` up."""
    return (random_boxes(seed, boxes=boxes) for seed in range(first, first + count))


def _distance(boxes: Boxes, point: Floats) -> float:
    """Level distance of a point to the nearest box."""
    low, high = boxes.corners[:, 0], boxes.corners[:, 1]
    outside = np.maximum(low - point[:2], point[:2] - high).clip(0.0)
    return float(np.linalg.norm(outside, axis=1).min())
