"""Obstacles whose edges can be checked exactly: boxes of full height."""

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from solvers.arrays import Floats, floats
from solvers.errors import InvalidProblem

_SLACK = 1e-9  # share of the largest coordinate by which boxes grow: far above all rounding


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Boxes:
    """Axis-parallel boxes that block the first two coordinates, whatever the others are.

    Touching a box is free, entering it is not. Both checks grow the boxes by a share of
    1e-9, so that rounding never calls free what is not; :meth:`meets` decides the true
    question in rational arithmetic.

    Parameters
    ----------
    corners
        Lower and upper corner of each footprint, shape (m, 2, 2).

    Raises
    ------
    InvalidProblem
        If the shape is another, or a lower corner does not lie below the upper one.

    """

    corners: Floats
    _middle: Floats = field(repr=False)
    _half: Floats = field(repr=False)

    def __init__(self, corners: Any) -> None:
        own = floats(corners, (len(corners), 2, 2), "corners")
        if not (own[:, 0] < own[:, 1]).all():
            raise InvalidProblem("every box must have its lower corner below the upper one.")
        slack = _SLACK * float(np.abs(own).max(initial=0.0))
        object.__setattr__(self, "corners", own)
        object.__setattr__(self, "_middle", own.mean(axis=1))
        object.__setattr__(self, "_half", (own[:, 1] - own[:, 0]) / 2.0 + slack)

    def __repr__(self) -> str:
        return f"Boxes({len(self.corners)} boxes)"

    def is_free(self, point: Floats) -> bool:
        """Whether a point, shape (d,) with d >= 2, lies in no box."""
        return not bool((np.abs(point[:2] - self._middle) < self._half).all(axis=1).any())

    def edge_is_free(self, a: Floats, b: Floats) -> bool:
        """Whether the whole edge between two points misses every box (separating axes)."""
        along, across = (b[:2] - a[:2]) / 2.0, self._middle - (a[:2] + b[:2]) / 2.0
        near = (np.abs(across) < self._half + np.abs(along)).all(axis=1)
        if not near.any():
            return True
        if not along.any():
            return False
        beside = np.abs(along[0] * across[:, 1] - along[1] * across[:, 0])
        near &= beside < self._half[:, 0] * abs(along[1]) + self._half[:, 1] * abs(along[0])
        return not bool(near.any())

    def meets(self, a: Floats, b: Floats) -> bool:
        """Whether an edge enters a box, decided without any rounding."""
        (ax, ay), (bx, by) = ([Fraction(v) for v in p[:2].tolist()] for p in (a, b))
        for (x0, y0), (x1, y1) in self.corners.tolist():
            left, low, right, top = (Fraction(v) for v in (x0, y0, x1, y1))
            if max(ax, bx) <= left or min(ax, bx) >= right:
                continue
            if max(ay, by) <= low or min(ay, by) >= top:
                continue
            sides = [
                (bx - ax) * (y - ay) - (by - ay) * (x - ax)
                for x in (left, right)
                for y in (low, top)
            ]
            if (ax, ay) == (bx, by) or min(sides) < 0 < max(sides):
                return True
        return False
