"""Shortest ways between places through free space, looked for only when asked."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.airspace.roadmap import CELLS_A_D_MIN, Roadmap
from planner.airspace.space import Space
from planner.geometry.arrays import Bools, Floats, Ints

_NEAR = (2, 4)  # cells around a place in which its first cell is sought
_GATES = 6  # cells that a place is joined to, at most
_SWEEPS = 1  # passes that pull a way taut: more save less than a thousandth

Key = tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class FreeWay:
    """A way that keeps its distance, or the knowledge that there is none.

    Parameters
    ----------
    points
        Corners from place to place, shape (n, 3), metres, or ``None``.
    apart
        Whether the places lie in separate parts of free space, as far as the roadmap tells.

    """

    points: Floats | None
    apart: bool = False

    @property
    def length(self) -> float:
        """Metres; infinite without a way."""
        if self.points is None:
            return float("inf")
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


class FreeWays:
    """Ways in one airspace; each is sought once, the same whichever end it is sought from.

    Straight where that is free; else the shortest way over a grid of cells of a quarter of
    ``d_min``, pulled taut with exact edge checks.

    Parameters
    ----------
    airspace
        Solids and zones.
    margin
        Kept beyond ``d_min``, and from zones, metres.

    """

    def __init__(self, airspace: Space, *, margin: float) -> None:
        self._airspace, self._margin = airspace, margin
        self._required = airspace.d_min + margin
        self._free: dict[tuple[Key, Key], bool] = {}
        self._found: dict[tuple[Key, Key], FreeWay] = {}
        self._gates: dict[Key, Ints] = {}

    @cached_property
    def _roadmap(self) -> Roadmap:
        return Roadmap(
            self._airspace.clearance_range,
            self._airspace.zone_margin,
            self._airspace.bounds,
            required=self._required,
            margin=self._margin,
            cell=self._airspace.d_min / CELLS_A_D_MIN,
        )

    def straight(self, starts: Floats, ends: Floats) -> Bools:
        """Tell which chords, from (m, 3) to (m, 3), are free; the places must be."""
        return np.array(
            [self._chord_is_free(a, b) for a, b in zip(starts, ends, strict=True)], dtype=np.bool_
        )

    def between(self, start: Floats, end: Floats) -> FreeWay:
        """Shortest way that was found from one free place, shape (3,), to another."""
        one, other = _key(start), _key(end)
        swapped = other < one
        pair = (other, one) if swapped else (one, other)
        if pair not in self._found:
            self._found[pair] = self._way(*map(np.array, pair))
        way = self._found[pair]
        if not swapped or way.points is None:
            return way
        return FreeWay(way.points[::-1])

    def pocket(self, place: Floats) -> int:
        """Number of the closed part of free space that a place lies in, 0 if in none so far."""
        return max(self._roadmap.pockets_of(self._gates_of(place)), default=0)

    def _way(self, start: Floats, end: Floats) -> FreeWay:
        if self._chord_is_free(start, end):
            return FreeWay(np.stack([start, end]))
        gates = self._gates_of(start), self._gates_of(end)
        found = self._roadmap.way(start, end, *gates)
        if found.points is None:
            return FreeWay(None, found.apart)
        return FreeWay(self._taut(np.vstack([start, found.points, end])))

    def _taut(self, points: Floats) -> Floats:
        from solvers.motion.shortcut import straightened, tightened

        return tightened(
            straightened(points, self._edge_is_free), self._edge_is_free, sweeps=_SWEEPS
        )

    def _gates_of(self, place: Floats) -> Ints:
        """Cells next to a place that a free edge leads to, (n, 3)."""
        key = _key(place)
        if key not in self._gates:
            self._gates[key] = self._open_gates(place)
        return self._gates[key]

    def _open_gates(self, place: Floats) -> Ints:
        gates: list[Ints] = []
        for radius in _NEAR:
            for cell in self._roadmap.cells_near(place, radius):
                if self._edge_is_free(place, self._roadmap.centres(cell)):
                    gates.append(cell)
                if len(gates) == _GATES:
                    break
            if gates:
                break
        return np.array(gates, dtype=np.int64).reshape(-1, 3)

    def _chord_is_free(self, a: Floats, b: Floats) -> bool:
        one, other = _key(a), _key(b)
        pair = (one, other) if one <= other else (other, one)
        if pair not in self._free:
            self._free[pair] = self._edge_is_free(*map(np.array, pair))
        return self._free[pair]

    def _edge_is_free(self, a: Floats, b: Floats) -> bool:
        """Whether a whole edge keeps its distance; one of its ends must be known to."""
        return self._airspace.capsule_clearance_at_least(
            a, b, self._required
        ) and self._airspace.zone_margin_at_least(a, b, self._margin)


def _key(place: Floats) -> Key:
    return tuple(place.tolist())
