"""Travelling salesman, closed or open, with fixed ends where wanted."""

import itertools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from solvers.arrays import Floats, Ints, floats, read_only
from solvers.errors import InvalidProblem, InvalidSolution
from solvers.problem import Answer
from solvers.result import Status

Order = Ints
"""The places in the order of the visit, shape (n,)."""

_BY_HAND = 3  # places up to which every order is tried


@dataclass(frozen=True, eq=False, init=False, repr=False)
class TourProblem:
    """Find the order of all places with the least sum of costs from each to the next.

    Parameters
    ----------
    costs
        Cost from row to column, finite and at least 0, shape (n, n); the diagonal is
        not read. May be asymmetric.
    closed
        Whether the cost from the last place back to the first counts.
    start
        Place that the order begins with.
    end
        Place that an open order ends with.

    Raises
    ------
    InvalidProblem
        If the costs are not square, finite and non-negative, or the ends do not fit.

    """

    costs: Floats
    closed: bool
    start: int | None
    end: int | None

    family: ClassVar[str] = "tour"

    def __init__(
        self,
        costs: Any,
        closed: bool = True,
        *,
        start: int | None = None,
        end: int | None = None,
    ) -> None:
        shape = np.shape(costs)
        if len(shape) != 2 or shape[0] != shape[1] or shape[0] == 0:
            raise InvalidProblem(f"costs must be (n, n) with n >= 1, got shape {shape}.")
        n = shape[0]
        for name, place in (("start", start), ("end", end)):
            if place is not None and not 0 <= place < n:
                raise InvalidProblem(f"{name} must lie in [0, {n}), got {place}.")
        if closed and end is not None:
            raise InvalidProblem("a closed tour has no end; set closed=False.")
        if end is not None and start == end and n > 1:
            raise InvalidProblem(
                f"start and end are both {start}; for a round trip set closed=True."
            )
        own = np.array(costs, dtype=np.float64)
        np.fill_diagonal(own, 0.0)
        object.__setattr__(self, "costs", floats(own, (n, n), "costs", least=0.0))
        object.__setattr__(self, "closed", bool(closed))
        object.__setattr__(self, "start", None if start is None else int(start))
        object.__setattr__(self, "end", None if end is None else int(end))

    def __repr__(self) -> str:
        kind = "closed" if self.closed else "open"
        return f"TourProblem({self.size} places, {kind}, start={self.start}, end={self.end})"

    @property
    def size(self) -> int:
        """Number of places."""
        return len(self.costs)

    @property
    def symmetric(self) -> bool:
        """Whether each way there costs what the way back does."""
        return bool(np.array_equal(self.costs, self.costs.T))

    @property
    def features(self) -> frozenset[str]:
        """``asymmetric``, ``open``, ``start`` and ``end``, where they apply."""
        used = {
            "asymmetric": not self.symmetric,
            "open": not self.closed,
            "start": self.start is not None,
            "end": self.end is not None,
        }
        return frozenset(name for name, present in used.items() if present)

    def evaluate(self, candidate: Any) -> tuple[Order, float]:
        """Own copy of an order, and its cost.

        Raises
        ------
        InvalidSolution
            If it is no permutation of the places or breaks a fixed end.

        """
        given = np.asarray(candidate)
        if given.shape != (self.size,) or given.dtype.kind not in "iu":
            raise InvalidSolution(
                f"expected the {self.size} places in some order, got shape {given.shape} "
                f"of {given.dtype}."
            )
        order = given.astype(np.int64)
        seen = np.zeros(self.size, dtype=np.bool_)
        seen[order[(order >= 0) & (order < self.size)]] = True
        if not seen.all():
            raise InvalidSolution(f"place {np.flatnonzero(~seen)[0]} is not visited.")
        if self.start is not None and order[0] != self.start:
            raise InvalidSolution(f"must start at {self.start}, starts at {order[0]}.")
        if self.end is not None and order[-1] != self.end:
            raise InvalidSolution(f"must end at {self.end}, ends at {order[-1]}.")
        legs = self.costs[order[:-1], order[1:]].sum()
        back = self.costs[order[-1], order[0]] if self.closed else 0.0
        read_only(order)
        return order, float(legs + back)

    def cost(self, candidate: Any) -> float:
        """Cost of an order; raises as :meth:`evaluate` does."""
        return self.evaluate(candidate)[1]

    def trivial(self) -> Answer | None:
        """Best of all orders, where there are so few that no solver is needed."""
        if self.size > _BY_HAND:
            return None
        best, least = None, np.inf
        for places in itertools.permutations(range(self.size)):
            try:
                order, cost = self.evaluate(np.array(places))
            except InvalidSolution:
                continue
            if cost < least:
                best, least = order, cost
        return Answer(Status.OPTIMAL, best)
