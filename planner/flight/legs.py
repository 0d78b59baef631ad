"""Proven legs between viewpoints: the chord where it is free, else a way around."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.config import FlightSettings
from planner.flight.certificate import Space, prove
from planner.flight.path import CONTROL_DECIMALS
from planner.flight.repair import find_way
from planner.flight.rounding import SHRINK, smooth_way
from planner.flight.smooth import arcs, tangents, turned_along
from planner.geometry import bezier
from planner.geometry.arrays import Floats, Ints

if TYPE_CHECKING:
    from solvers.result import Result

SWING = 0.5
"""How far a piece swings out along a tangent, as a share of the handle, or a little more."""

Pair = tuple[int, int]
"""Viewpoints at the start and the end of a leg."""


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """Proven pieces from one viewpoint to the next.

    Parameters
    ----------
    controls
        Shape (m, 4, 3), metres.
    clearance, zone_margin
        Proven lower bounds, shape (m,), metres.
    repaired
        Whether it leads around something.

    """

    controls: Floats
    clearance: Floats
    zone_margin: Floats
    repaired: bool


class Legs:
    """All legs that one flight tries; each chord and each way around is looked for once.

    Parameters
    ----------
    spots
        Positions of all viewpoints, shape (V, 3), rounded as they are flown.
    airspace
        Solids and zones.
    settings
        Handles, margin, solver.
    seed
        Root of the motion solver's chance.

    Attributes
    ----------
    results
        What the motion solver said, one result a search.

    """

    def __init__(self, spots: Floats, airspace: Space, settings: FlightSettings, seed: int) -> None:
        self._spots, self._airspace, self._settings, self._seed = spots, airspace, settings, seed
        self.results: list[Result[Floats]] = []
        self._chords: dict[Pair, Leg | None] = {}
        self._ways: dict[Pair, Floats | None] = {}

    def broken(self, pairs: list[Pair]) -> list[bool]:
        """Tell for which pairs there is neither a free chord nor a way around."""
        self._look_at_chords(pairs)
        return [self._guide(pair) is None for pair in pairs]

    def joined(self, some: list[int], others: list[int]) -> bool:
        """Tell whether the nearest two viewpoints of two groups are joined by a safe way."""
        gap = np.linalg.norm(self._spots[some][:, None] - self._spots[others][None], axis=2)
        i, j = np.unravel_index(int(gap.argmin()), gap.shape)
        return not self.broken([(some[int(i)], others[int(j)])])[0]

    def fly(self, pairs: list[Pair], *, closed: bool) -> list[Leg] | None:
        """Smooth legs, end to end.

        Parameters
        ----------
        pairs
            In order, each starting where the one before ends; none may be broken.
        closed
            Whether the last ends where the first starts.

        Returns
        -------
        legs
            One a pair, or ``None`` if a way turned out to have no proof: it is broken now.

        """
        guides = [guide for guide in map(self._guide, pairs) if guide is not None]
        leaving, arriving = self._tangents(guides, closed=closed)
        direct = self._direct(pairs, leaving, arriving)
        found = [
            self._around(pair, leaving[k], arriving[k]) if leg is None else leg
            for k, (pair, leg) in enumerate(zip(pairs, direct, strict=True))
        ]
        safe = [leg for leg in found if leg is not None]
        return safe if len(safe) == len(pairs) else None

    def _look_at_chords(self, pairs: list[Pair]) -> None:
        """Certify the straight chords that are new, all at once."""
        new = [pair for pair in dict.fromkeys(pairs) if pair not in self._chords]
        if new:
            ends = self._spots[np.array(new)]
            controls = bezier.straight(ends[:, 0], ends[:, 1])
            self._chords.update(zip(new, self._certified(controls), strict=True))

    def _guide(self, pair: Pair) -> Floats | None:
        """Corners of a leg: its chord if that is free, else the way around, else ``None``."""
        if self._chords[pair] is not None:
            return self._spots[list(pair)]
        if pair not in self._ways:
            way = find_way(
                self._spots[pair[0]],
                self._spots[pair[1]],
                self._airspace,
                settings=self._settings,
                seed=self._seed,
            )
            self.results += way.results
            self._ways[pair] = way.points
        return self._ways[pair]

    def _direct(self, pairs: list[Pair], leaving: Floats, arriving: Floats) -> list[Leg | None]:
        """Arc of the largest safe handle where the chord is free; the chord is the last resort."""
        found: list[Leg | None] = [None] * len(pairs)
        ends = self._spots[np.array(pairs, dtype=np.int64).reshape(-1, 2)]
        rows = [k for k, pair in enumerate(pairs) if self._chords[pair] is not None]
        for share in SHRINK:
            if not rows:
                break
            handle = np.array(share * self._settings.handle)
            trial = arcs(ends[rows, 0], ends[rows, 1], leaving[rows], arriving[rows], handle)
            for k, leg in zip(rows, self._certified(trial), strict=True):
                found[k] = leg
            rows = [k for k in rows if found[k] is None]
        for k in rows:
            found[k] = self._chords[pairs[k]]
        return found

    def _around(self, pair: Pair, leaving: Floats, arriving: Floats) -> Leg | None:
        """Smoothed way around; without a proof the pair counts as broken from now on."""
        points = self._ways[pair]
        if points is None:
            return None
        smooth = smooth_way(
            points,
            leaving,
            arriving,
            self._airspace,
            settings=self._settings,
        )
        if smooth is None:
            self._ways[pair] = None
            return None
        controls, proof = smooth
        return Leg(controls, proof.clearance, proof.zone_margin, True)

    def _certified(self, controls: Floats) -> list[Leg | None]:
        """One leg a piece, rounded before it is proven; ``None`` where it is not safe."""
        rounded = np.round(controls, CONTROL_DECIMALS)
        proof = prove(rounded, self._airspace, self._settings.margin)
        return [
            Leg(rounded[k : k + 1], proof.clearance[k : k + 1], proof.zone_margin[k : k + 1], False)
            if proof.safe[k]
            else None
            for k in range(len(rounded))
        ]

    def _tangents(self, guides: list[Floats], *, closed: bool) -> tuple[Floats, Floats]:
        """Unit tangents at the start and the end of each leg, from the corners of all of them."""
        if not guides:
            return np.zeros((0, 3)), np.zeros((0, 3))
        corners = np.concatenate([guides[0][:1], *(guide[1:] for guide in guides)])
        at: Ints = np.cumsum([0, *(len(guide) - 1 for guide in guides)])
        if closed:
            corners, at[-1] = corners[:-1], 0
        reach = _reach(guides, closed=closed) * SWING * self._settings.handle
        lines = self._along_solids(tangents(corners, closed=closed)[at], corners[at], reach)
        return lines[:-1], lines[1:]

    def _along_solids(self, lines: Floats, spots: Floats, reach: Floats) -> Floats:
        """Turn tangents along what is nearer than curves reach, shape (K,), metres."""
        room = self._airspace.clearance(spots) - self._airspace.d_min - self._settings.margin
        near = np.flatnonzero(room < reach)
        if len(near):
            away = self._uphill(spots[near])
            lines[near] = turned_along(lines[near], away, room[near].clip(0.0) / reach[near])
        return lines

    def _uphill(self, spots: Floats) -> Floats:
        """Direction in which clearance grows, by central differences; zero where it has none."""
        step = 0.02 * self._airspace.d_min * np.eye(3)
        around = np.concatenate([spots[:, None] + step, spots[:, None] - step], axis=1)
        values = self._airspace.clearance(around.reshape(-1, 3)).reshape(-1, 2, 3)
        slope = np.nan_to_num(values[:, 0] - values[:, 1], posinf=0.0, neginf=0.0)
        size = np.linalg.norm(slope, axis=1, keepdims=True)
        return np.asarray(slope / np.where(size > 0.0, size, 1.0))


def _reach(guides: list[Floats], *, closed: bool) -> Floats:
    """Length of the longer of the two straight sides at each viewpoint, shape (legs + 1,)."""
    first = [np.linalg.norm(guide[1] - guide[0]) for guide in guides]
    last = [np.linalg.norm(guide[-1] - guide[-2]) for guide in guides]
    reach = np.maximum(np.append(first, 0.0), np.append(0.0, last))
    if closed:
        reach[[0, -1]] = max(reach[0], reach[-1])
    return np.asarray(reach)
