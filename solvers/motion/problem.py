"""Shortest free path between two points of a box."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from solvers.arrays import Floats, floats, read_only
from solvers.errors import InvalidProblem, InvalidSolution
from solvers.problem import Answer
from solvers.result import Status

Waypoints = Floats
"""Corners of a path from start to goal, shape (k, d)."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class MotionProblem:
    """Find the shortest polyline from start to goal all of whose edges are free.

    Parameters
    ----------
    start, goal
        Points, shape (d,), inside the bounds.
    bounds
        Lower and upper corner of the box that the path stays in, shape (2, d).
    is_free
        Whether a point, shape (d,), is free.
    edge_is_free
        Whether the whole straight edge between two points is free. The last word: what
        it says must be exact or on the safe side. Without it an edge counts as free if
        its points at most ``step`` apart are.
    step
        Length of the longest edge to try at once, and distance between the points that
        are tried where no edge check is given; positive.

    Raises
    ------
    InvalidProblem
        If shapes do not fit, the box is empty, or an end lies outside of it.

    """

    start: Floats
    goal: Floats
    bounds: Floats
    is_free: Callable[[Floats], bool]
    edge_is_free: Callable[[Floats, Floats], bool]
    step: float

    family: ClassVar[str] = "motion"

    def __init__(
        self,
        start: Any,
        goal: Any,
        bounds: Any,
        is_free: Callable[[Floats], bool],
        edge_is_free: Callable[[Floats, Floats], bool] | None = None,
        *,
        step: float,
    ) -> None:
        shape = np.shape(start)
        if len(shape) != 1 or shape[0] == 0:
            raise InvalidProblem(f"start must be a point of shape (d,), got shape {shape}.")
        if not (np.isfinite(step) and step > 0.0):
            raise InvalidProblem(f"step must be positive, got {step}.")
        box = floats(bounds, (2, shape[0]), "bounds")
        if not (box[0] < box[1]).all():
            raise InvalidProblem("bounds must have every lower corner below the upper one.")
        for name, point in (("start", start), ("goal", goal)):
            own = floats(point, shape, name)
            if (own < box[0]).any() or (own > box[1]).any():
                raise InvalidProblem(
                    f"{name} {own.tolist()} lies outside the bounds {box.tolist()}."
                )
            object.__setattr__(self, name, own)
        object.__setattr__(self, "bounds", box)
        object.__setattr__(self, "is_free", is_free)
        object.__setattr__(self, "edge_is_free", edge_is_free or self._sampled_edge_is_free)
        object.__setattr__(self, "step", float(step))

    def __repr__(self) -> str:
        return f"MotionProblem({self.start.tolist()} -> {self.goal.tolist()})"

    @property
    def features(self) -> frozenset[str]:
        """Nothing beyond the plain case."""
        return frozenset()

    def evaluate(self, candidate: Any) -> tuple[Waypoints, float]:
        """Own copy of a path, and its length.

        Raises
        ------
        InvalidSolution
            If it does not join start and goal, leaves the box, or an edge is not free.

        """
        try:
            path = np.array(candidate, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InvalidSolution(f"expected waypoints of shape (k, d): {error}") from error
        if path.ndim != 2 or path.shape[1] != len(self.start) or len(path) < 1:
            raise InvalidSolution(f"expected waypoints (k, {len(self.start)}), got {path.shape}.")
        if not np.isfinite(path).all():
            raise InvalidSolution("a waypoint is not finite.")
        if not (np.array_equal(path[0], self.start) and np.array_equal(path[-1], self.goal)):
            raise InvalidSolution("the path does not lead from start to goal.")
        if (path < self.bounds[0]).any() or (path > self.bounds[1]).any():
            raise InvalidSolution("the path leaves the bounds.")
        if not self.is_free(path[0]):
            raise InvalidSolution("the start is not free.")
        for k in range(len(path) - 1):
            if not self.edge_is_free(path[k], path[k + 1]):
                raise InvalidSolution(f"edge {k} is not free.")
        read_only(path)
        return path, float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())

    def cost(self, candidate: Any) -> float:
        """Length of a path; raises as :meth:`evaluate` does."""
        return self.evaluate(candidate)[1]

    def trivial(self) -> Answer | None:
        """The straight edge where it is free; ``INFEASIBLE`` where an end is not free."""
        if not (self.is_free(self.start) and self.is_free(self.goal)):
            return Answer(Status.INFEASIBLE)
        if self.edge_is_free(self.start, self.goal):
            return Answer(Status.OPTIMAL, np.stack([self.start, self.goal]))
        return None

    def _sampled_edge_is_free(self, a: Floats, b: Floats) -> bool:
        pieces = max(1, int(np.ceil(np.linalg.norm(b - a) / self.step)))
        return all(self.is_free(a + (b - a) * share) for share in np.linspace(0.0, 1.0, pieces + 1))
