"""Prove that a Bezier curve keeps its distance, given any distance that changes by 1 m a metre."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.geometry import bezier
from planner.geometry.arrays import Floats, Ints

RESOLUTION = 1e-4
"""Stretches smaller than this, metres, are no longer halved; see :func:`prove_distance`."""

MOST_HALVINGS = 40


@dataclass(frozen=True, slots=True, eq=False)
class CurveProof:
    """What is proven about each piece of a curve.

    Parameters
    ----------
    bound
        Proven lower bound of the distance along each piece, shape (M,), metres.
    violated
        Pieces with a point nearer than asked, ascending, shape (k,).
    distance
        Distance at such a point of each violated piece, shape (k,), metres.
    point
        That point, shape (k, 3), metres.

    """

    bound: Floats
    violated: Ints
    distance: Floats
    point: Floats


def prove_distance(
    controls: Floats, distance: Callable[[Floats], Floats], needed: float
) -> CurveProof:
    """Bound the distance along each piece from below by halving it until the bound is enough.

    A piece lies in the hull of its control points, so no point of it is farther from its middle
    than the farthest of them; and the distance at that point is smaller than at the middle by
    that much at most (Lipschitz bound 1).

    Parameters
    ----------
    controls
        Shape (M, 4, 3), metres.
    distance
        Signed distance, metres, of points (n, 3); must change by at most 1 m a metre.
    needed
        Distance that is asked for, metres.

    Returns
    -------
    proof
        Where nothing is violated, bounds reach ``needed`` to within twice :data:`RESOLUTION`.

    """
    bound = np.full(len(controls), np.inf)
    worst = np.full(len(controls), np.inf)
    where = np.zeros((len(controls), 3))
    part, piece = np.asarray(controls), np.arange(len(controls))
    for _ in range(MOST_HALVINGS):
        if not len(part):
            break
        middle = bezier.evaluate(part, np.full(len(part), 0.5))
        reach = np.linalg.norm(part - middle[:, None], axis=2).max(axis=1)
        there = distance(middle)
        for row in np.flatnonzero(there < np.minimum(needed, worst[piece])):  # few
            if there[row] < worst[piece[row]]:
                worst[piece[row]], where[piece[row]] = there[row], middle[row]
        low = there - reach
        done = (low >= needed) | (reach <= RESOLUTION) | (there < needed - RESOLUTION)
        np.minimum.at(bound, piece[done], low[done])
        left, right = bezier.split(part[~done])
        part = np.concatenate([left, right])
        piece = np.concatenate([piece[~done]] * 2)
    np.minimum.at(bound, piece, -np.inf)  # whatever was never settled is not proven
    violated = np.flatnonzero((worst < needed - RESOLUTION) | ~(bound >= needed - 2.0 * RESOLUTION))
    return CurveProof(bound, violated, np.minimum(worst, bound)[violated], where[violated])


@dataclass(frozen=True, slots=True, eq=False)
class LineProof:
    """What is proven about the straight lines from row to row of a table.

    Parameters
    ----------
    bound
        Proven lower bound of the distance along all of them, metres.
    nearest
        Row after which the point comes that was met with the least distance.
    point
        That point, shape (3,), metres.
    violated
        Rows after which a line comes nearer than asked, ascending, shape (k,).
    distance
        Distance at such a point of each, shape (k,), metres.

    """

    bound: float
    nearest: int
    point: Floats
    violated: Ints
    distance: Floats


def prove_lines(
    xyz: Floats, distance: Callable[[Floats], Floats], needed: float, *, tolerance: float
) -> LineProof:
    """Bound the distance along the straight lines that join places, within a tolerance.

    Parameters
    ----------
    xyz
        Places in order, shape (n, 3), n >= 1, metres.
    distance
        Signed distance, metres, of points (n, 3); must change by at most 1 m a metre.
    needed
        Distance that is asked for, metres.
    tolerance
        How far the bound may lie under the least distance met, metres.

    Returns
    -------
    proof
        The bound reaches ``needed`` to within twice :data:`RESOLUTION` if nothing is violated.

    """
    there = distance(xyz)
    row = int(np.argmin(there))
    least, point = float(there[row]), xyz[row]
    moved = (np.diff(xyz, axis=0) != 0.0).any(axis=1)
    start = np.flatnonzero(moved)
    start = start if len(start) else np.zeros(1, dtype=np.int64)  # it never moves
    lines = bezier.straight(xyz[start], xyz[np.minimum(start + 1, len(xyz) - 1)])
    while least - tolerance > needed:  # nearly always proven at once
        proof = prove_distance(lines, distance, least - tolerance)
        if not len(proof.violated):
            return LineProof(float(proof.bound.min()), row, point, _NONE, np.zeros(0))
        worst = int(np.argmin(proof.distance))
        row, point = int(start[proof.violated[worst]]), proof.point[worst]
        least = min(float(proof.distance[worst]), least - 0.5 * tolerance)
    proof = prove_distance(lines, distance, needed)
    return LineProof(
        min(float(proof.bound.min()), least), row, point, start[proof.violated], proof.distance
    )


_NONE = np.zeros(0, dtype=np.int64)
