"""A given number of photos that all match: what only links the others counts too."""

from typing import TYPE_CHECKING

import numpy as np

from planner.geometry.arrays import Bools, Ints
from planner.viewpoints.graph import LinkRule, link
from planner.viewpoints.subject import Subject
from planner.viewpoints.viewpoints import Viewpoints

if TYPE_CHECKING:
    from solvers.pairs import PairCoverProblem
    from solvers.pairs.state import State

_LINKS = 3  # photos that each is to match with
_MOST = 2_000  # poses looked at: each is compared with each
_SWAPS = 2  # exchanges for each photo
_BONUS = 2.0  # targets that a sample is worth which has what it wants: few done beat many begun


def spent(
    viewpoints: Viewpoints, offers: Viewpoints, subject: Subject, *, links: LinkRule, count: int
) -> Viewpoints:
    """Spend a number of photos, all in one piece with three links each as far as that goes.

    What is worth least is dropped while there are more, unless others hang on it; what is worth
    most is added while there are fewer, if it matches three of those that are there. Then photos
    are exchanged in the same way, one for one, as long as that is worth more. The same is begun
    from nothing, and the better of both is taken.

    Parameters
    ----------
    viewpoints
        The photos so far, more or fewer.
    offers
        Poses to choose from, of which the first 2,000 are looked at.
    subject
        What is to be photographed, and how photos count.
    links
        What two photos must have in common.
    count
        Number of photos.

    Returns
    -------
    viewpoints
        At most ``count``: fewer where no pose that matches is worth anything.

    """
    poses = viewpoints.joined(offers.take(np.arange(min(len(offers), _MOST))))
    seen_by = subject.samples, subject.caster, subject.camera
    linked = link(poses, *seen_by, reference=subject.reference, links=links).linked
    problem = subject.problem(subject.at(poses.positions, poses.yaw_deg, poses.pitch_deg))
    best: _Crew | None = None
    for begun in dict.fromkeys((len(viewpoints), 0)):
        crew = _Crew(problem, linked, begun)
        while len(crew.chosen) > count and crew.drop():
            pass
        while len(crew.chosen) < count and crew.add():
            pass
        if len(crew.chosen) > count:  # each of them holds others together
            continue
        crew.exchange(_SWAPS * count)
        best = crew if best is None or crew.worth > best.worth else best
    return viewpoints if best is None else poses.take(np.sort(best.chosen))


class _Crew:
    """The photos, what they are worth, and which poses match with which."""

    def __init__(self, problem: "PairCoverProblem", linked: Bools, begun: int) -> None:
        from solvers.pairs.state import empty_state
        from solvers.pairs.state_kernels import adopt

        self._state: State = empty_state(problem, bonus=_BONUS)
        self._linked = linked
        self.chosen = list(range(begun))
        adopt(self._state, np.arange(begun), np.inf)

    @property
    def worth(self) -> tuple[float, float]:
        """How many samples have what they want, then what the photos are worth to all."""
        return float(self._state.totals[0]), float(self._state.totals[2])

    def exchange(self, most: int) -> None:
        """Exchange one photo after the other, at most so many, while that is worth more."""
        from solvers.pairs.state_kernels import flip

        for _ in range(most):
            before, worth = list(self.chosen), self.worth
            if self.add() and self.drop() and self.worth > worth:
                continue
            for row in set(before) ^ set(self.chosen):
                flip(self._state, row)
            self.chosen = before
            return

    def add(self) -> bool:
        """Add what gains most among what matches; whether there is any."""
        from solvers.pairs.state_kernels import flip

        friends = np.count_nonzero(self._linked[:, self.chosen], axis=1)
        able = friends >= min(_LINKS, len(self.chosen))
        gain = np.where(able, self._state.gain, -np.inf)
        best = int(np.argmax(gain))
        if not gain[best] > 0.0:
            return False
        flip(self._state, best)
        self.chosen.append(best)
        return True

    def drop(self) -> bool:
        """Drop what loses least among what no other hangs on; whether there is any."""
        from solvers.pairs.state_kernels import flip, loss_of

        losses = [loss_of(self._state, row)[1] for row in self.chosen]
        for at in np.argsort(losses, kind="stable"):  # few
            left = [row for row in self.chosen if row != self.chosen[at]]
            if self._firmer(np.array(left, dtype=np.int64)):
                flip(self._state, self.chosen[at])
                self.chosen = left
                return True
        return False

    def _firmer(self, left: Ints) -> bool:
        """Whether some of the photos hang together no worse than all of them."""
        return bool((self._looseness(left) <= self._looseness(np.array(self.chosen))).all())

    def _looseness(self, rows: Ints) -> Ints:
        """Components, and links that photos lack."""
        from scipy.sparse.csgraph import connected_components

        linked = self._linked[np.ix_(rows, rows)]
        lack = (min(_LINKS, max(0, len(rows) - 1)) - linked.sum(axis=1)).clip(0)
        return np.array([connected_components(linked, directed=False)[0], lack.sum()])
