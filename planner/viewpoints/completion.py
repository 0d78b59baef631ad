"""Mend a selection of poses: fill what is missing, drop what is not needed."""

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Floats, Ints
from planner.viewpoints.candidates import Candidates
from planner.viewpoints.demand import Demand


class Tally:
    """What the chosen poses give each sample, where photos from one place count once.

    Parameters
    ----------
    candidates
        Poses to choose from.
    demand
        What each sample wants.

    """

    def __init__(self, candidates: Candidates, demand: Demand) -> None:
        pairs = candidates.pairs
        self._candidates, self._demand = candidates, demand
        self._photos = np.zeros(len(pairs), dtype=np.int32)  # chosen poses that hold each pair
        self.hits = np.zeros(len(demand.hits), dtype=np.int64)
        self._sides = np.zeros((len(demand.hits), int(pairs.sector.max(initial=0)) + 1), np.int32)

    def add(self, candidate: int) -> None:
        """Count one pose more."""
        pairs, row = self._candidates.pairs, self._candidates.row(candidate)
        self._photos[row] += 1
        first = row[self._photos[row] == 1]
        self.hits[pairs.sample[first]] += 1
        self._sides[pairs.sample[first], pairs.sector[first]] += 1

    def spare(self, candidate: int) -> bool:
        """Take one pose out unless a sample would lack it; tell whether it is out."""
        pairs, row = self._candidates.pairs, self._candidates.row(candidate)
        alone = row[self._photos[row] == 1]
        sample, sector = pairs.sample[alone], pairs.sector[alone]  # each sample once
        sides = np.count_nonzero(self._sides[sample], axis=1)
        sides -= self._sides[sample, sector] == 1
        lacks_hits = self.hits[sample] <= self._demand.hits[sample]
        if lacks_hits.any() or (sides < self._demand.sectors[sample]).any():
            return False
        self._photos[row] -= 1
        self.hits[sample] -= 1
        self._sides[sample, sector] -= 1
        return True

    def useful(self, pair: NDArray[np.int32]) -> Bools:
        """Tell which rows of ``pairs`` would fill an open demand."""
        pairs = self._candidates.pairs
        sample, sector = pairs.sample[pair], pairs.sector[pair]
        lacks_hits = self.hits < self._demand.hits
        lacks_sides = np.count_nonzero(self._sides, axis=1) < self._demand.sectors
        fresh_side = lacks_sides[sample] & (self._sides[sample, sector] == 0)
        return np.asarray((self._photos[pair] == 0) & (lacks_hits[sample] | fresh_side))


def complete_cover(candidates: Candidates, chosen: Ints, *, demand: Demand, prices: Floats) -> Ints:
    """Add poses until every demand is met that all candidates together can meet.

    For selections in which photos from one place were counted as several hits. Each step adds
    the pose that gives most for its price; at last, poses that became needless go, the
    dearest first.

    Parameters
    ----------
    candidates
        Poses to choose from.
    chosen
        Rows of the poses chosen so far, shape (k,).
    demand
        What each sample wants, not more than the candidates can give.
    prices
        Price of each candidate, positive, shape (K,).

    Returns
    -------
    chosen
        Sorted rows.

    """
    tally = Tally(candidates, demand)
    for row in chosen:  # few, as all loops here: the viewpoints of a plan
        tally.add(row)
    owner = np.repeat(np.arange(len(candidates)), np.diff(candidates.indptr))
    open_hits = np.flatnonzero(tally.useful(candidates.pair))
    added: list[int] = []
    while len(open_hits):
        gain = np.bincount(owner[open_hits], minlength=len(candidates)) / prices
        added.append(int(np.argmax(gain)))
        tally.add(added[-1])
        open_hits = open_hits[tally.useful(candidates.pair[open_hits])]
    rows = np.concatenate([chosen, np.array(added, dtype=np.int64)])
    dearest_first = rows[::-1][np.argsort(-prices[rows[::-1]], kind="stable")]
    kept = [row for row in dearest_first if not tally.spare(row)]
    return np.sort(np.array(kept, dtype=np.int64))
