"""Legs between viewpoints: straight where that is free, else around."""

from typing import TYPE_CHECKING

import numpy as np

from planner.airspace.space import Space
from planner.config import FlightSettings
from planner.flight.certificate import prove
from planner.flight.curve import Fitter, Leg
from planner.flight.path import CONTROL_DECIMALS
from planner.flight.repair import find_way
from planner.geometry import bezier
from planner.geometry.arrays import Floats
from planner.route.ways import FreeWays

if TYPE_CHECKING:
    from solvers.result import Result

Pair = tuple[int, int]
"""Viewpoints at the start and the end of a leg."""


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
    free_ways
        Where the motion solver starts.

    Attributes
    ----------
    results
        What the motion solver said, one result a search.

    """

    def __init__(
        self,
        spots: Floats,
        airspace: Space,
        settings: FlightSettings,
        seed: int,
        free_ways: FreeWays,
    ) -> None:
        self._free_ways = free_ways
        self._spots, self._airspace, self._settings, self._seed = spots, airspace, settings, seed
        self.results: list[Result[Floats]] = []
        self._free: dict[Pair, bool] = {}
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
            One a pair, or ``None`` if some turned out to have no proof: they are broken now.

        """
        guides = [guide for guide in map(self._guide, pairs) if guide is not None]
        found = Fitter(self._airspace, self._settings).fit(guides, closed=closed)
        for pair, leg in zip(pairs, found, strict=True):
            if leg is None:
                self._free[pair], self._ways[pair] = False, None
        safe = [leg for leg in found if leg is not None]
        return safe if len(safe) == len(pairs) else None

    def _look_at_chords(self, pairs: list[Pair]) -> None:
        """Prove the straight chords that are new, all at once."""
        new = [pair for pair in dict.fromkeys(pairs) if pair not in self._free]
        if new:
            ends = self._spots[np.array(new)]
            controls = np.round(bezier.straight(ends[:, 0], ends[:, 1]), CONTROL_DECIMALS)
            safe = prove(controls, self._airspace, self._settings.margin).safe
            self._free.update(zip(new, safe.tolist(), strict=True))

    def _guide(self, pair: Pair) -> Floats | None:
        """Corners of a leg: its chord if that is free, else the way around, else ``None``."""
        if self._free[pair]:
            return self._spots[list(pair)]
        if pair not in self._ways:
            start, end = self._spots[pair[0]], self._spots[pair[1]]
            way = find_way(
                start,
                end,
                self._airspace,
                settings=self._settings,
                seed=self._seed,
                guess=self._free_ways.between(start, end),
            )
            self.results += way.results
            self._ways[pair] = way.points
        return self._ways[pair]
