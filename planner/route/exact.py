"""Tours whose used legs cost what they truly cost, with few true costs worked out."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.route.cost import distances
from planner.route.ways import FreeWays

if TYPE_CHECKING:
    from solvers.result import Result

TOO_COARSE = 2.0
"""A blocked leg that the roadmap is too coarse for counts so many times its chord."""


class Lengths:
    """Length of the way between each pair of viewpoints: its chord until it is looked at.

    A chord is never longer than the way, so that costs that grow with length are lower bounds.

    Parameters
    ----------
    positions
        Shape (V, 3), metres.
    ways
        Free ways, or ``None`` where chords are all there is.

    Attributes
    ----------
    metres
        What is known, shape (V, V), symmetric; infinite where there is no way.
    blocked
        Pairs whose chord was found blocked, shape (V, V).

    """

    def __init__(self, positions: Floats, ways: FreeWays | None) -> None:
        self._positions, self._ways = positions, ways
        self.metres = distances(positions)
        self.blocked: Bools = np.zeros(self.metres.shape, dtype=np.bool_)
        self._known: Bools = np.eye(len(positions), dtype=np.bool_) | (ways is None)

    def look_at(self, here: Ints, there: Ints) -> bool:
        """Find the ways of these legs; tell whether any turned out longer than its chord."""
        longer = False
        for a, b in zip(here.tolist(), there.tolist(), strict=True):
            if self._known[a, b] or self._ways is None:
                continue
            self._known[a, b] = self._known[b, a] = True
            one, other = self._positions[a], self._positions[b]
            if self._ways.straight(one[None], other[None])[0]:
                continue
            way = self._ways.between(one, other)
            chord = self.metres[a, b]
            length = max(chord, way.length)
            if way.points is None and not way.apart:
                length = TOO_COARSE * chord
            self.metres[a, b] = self.metres[b, a] = length
            self.blocked[a, b] = self.blocked[b, a] = longer = True
        return longer

    def spaces(self, rows: Ints) -> list[Ints]:
        """Split viewpoints by the parts of free space that are known to be separate."""
        if self._ways is None:
            return [rows]
        number = np.array([self._ways.pocket(self._positions[row]) for row in rows.tolist()])
        return [rows[number == one] for one in np.unique(number).tolist()]


@dataclass(frozen=True, slots=True, eq=False)
class Tour:
    """Best order that was found of some viewpoints.

    Parameters
    ----------
    rows
        Viewpoints in order, shape (n,).
    result
        What the solver said in the last round; its bound holds for the true costs.
    rounds
        How often it was asked.

    """

    rows: Ints
    result: "Result[Ints]"
    rounds: int


def exact_tour(
    rows: Ints,
    lengths: Lengths,
    costs_of: Callable[[Floats], Floats],
    solve: Callable[[Floats, Ints, Ints | None], "Result[Ints]"],
    *,
    closed: bool,
    rounds: int,
) -> Tour | None:
    """Solve with lower bounds, look at the legs that the tour uses, and solve again.

    Ends when all used legs cost what the solver was told: then the tour is as good for the true
    costs as the solver is, and a bound from lower bounds is a bound for them.

    Parameters
    ----------
    rows
        Viewpoints to visit, shape (n,), n >= 1.
    lengths
        What is known of the ways; more is known afterwards.
    costs_of
        Costs of all pairs, (V, V), from their lengths; growing with each.
    solve
        Called with costs (n, n), ``rows`` and the best order so far in places of ``rows``.
    closed
        Whether the tour returns.
    rounds
        Most solutions; then the best order so far is taken.

    Returns
    -------
    tour
        Order with the least true cost of all that were met, or ``None`` if the solver used a leg
        between separate parts of space: those have tours of their own.

    """
    best, least, count, longer = np.arange(len(rows)), np.inf, 0, True
    while longer and count < rounds:
        count += 1
        result = solve(
            costs_of(lengths.metres)[np.ix_(rows, rows)], rows, best if count > 1 else None
        )
        order = np.arange(len(rows)) if result.solution is None else result.solution
        here, there = legs_of(rows[order], closed=closed)
        longer = lengths.look_at(here, there)
        if np.isinf(lengths.metres[here, there]).any():
            return None
        cost = float(costs_of(lengths.metres)[here, there].sum())
        if cost < least:
            best, least = order, cost
    return Tour(rows[best], result, count)


def legs_of(order: Ints, *, closed: bool) -> tuple[Ints, Ints]:
    """Rows at the starts and at the ends of the legs of an order, each (legs,)."""
    if closed and len(order) > 1:
        return order, np.roll(order, -1)
    return order[:-1], order[1:]
