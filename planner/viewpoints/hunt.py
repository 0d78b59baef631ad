"""Where the search for photos stands: what is planned for by now, and what may be missed."""

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Bools, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.pool import Pool
from planner.viewpoints.subject import Subject
from solvers import Result


@dataclass(frozen=True, slots=True)
class Slack:
    """How many samples may end with less than is wanted.

    Parameters
    ----------
    weak
        Need no more than the floor.
    lost
        Need nothing. Those that the share leaves out are both together.

    """

    weak: int
    lost: int

    @classmethod
    def of(cls, firm: int, possible: int, settings: ViewpointSettings) -> "Slack":
        """Slack where so many samples can reach the target, and so many the floor."""
        below = math.floor((1.0 - settings.share) * firm + 1e-9)
        if not settings.floors:
            return cls(0, below)
        lost = min(below, math.floor((1.0 - settings.floor_share) * possible + 1e-9))
        return cls(below - lost, lost)

    @property
    def below(self) -> int:
        """How many may be below the target, or without their sharp photos."""
        return self.weak + self.lost


@dataclass(frozen=True, slots=True, eq=False)
class Hunt:
    """Where the search stands.

    Parameters
    ----------
    subject
        What is planned for by now, guards included.
    few, many
        Grids to choose from in a round, and in the last search.
    kept
        The photos.
    firm
        Which samples can reach the target from the grid, shape (S,); the others want the floor.
    sharp
        Sharp photos that each sample wants as long as it is to reach the target, shape (S,).
    wanted
        How many samples must have what they want, guards and others counted together.
    slack, spare
        What may be missed of the samples planned by, and of all guards.
    guards
        Samples that are not planned for yet, if any are to be looked at.
    result
        Of the last search.

    """

    subject: Subject
    few: Pool
    many: Pool
    kept: Pool
    firm: Bools
    sharp: Ints
    wanted: int
    slack: Slack
    spare: Slack
    guards: SurfaceSamples | None
    result: Result[Ints]

    @classmethod
    def begun(
        cls,
        subject: Subject,
        few: Pool,
        many: Pool,
        result: Result[Ints],
        *,
        chosen: Ints,
        guards: SurfaceSamples | None,
    ) -> "Hunt":
        """Where it stands after the first search, which has chosen rows of ``many``."""
        firm, possible = subject.reach(many)
        can = int(np.count_nonzero(possible))
        slack = Slack.of(int(np.count_nonzero(firm)), can, subject.settings)
        count = 0 if guards is None else len(guards)
        hunt = cls(
            *(subject, few, many, many.take(chosen)),
            firm=firm,
            sharp=subject.problem(many).fine_demand,
            wanted=can - slack.lost,
            slack=slack,
            spare=Slack.of(count, count, subject.settings),
            guards=guards,
            result=result,
        )
        return hunt.relaxed()

    def relaxed(self) -> "Hunt":
        """Want no more than the floor of the samples that have least, as many as may be.

        Those that have the very least may be lost, and count as far as they get.
        """
        subject = self.subject
        if subject.floor == 0.0:
            return self
        value, fine = subject.shown(self.kept)
        order = np.lexsort((value, (value >= subject.settings.target) & (fine >= self.sharp)))
        order = order[self.firm[order]]
        weak = ~self.firm
        for rows, slack in (
            (order[order < subject.planned], self.slack),
            (order[order >= subject.planned], self.spare),
        ):
            weak[rows[slack.lost : slack.below]] = True
        return replace(self, subject=subject.wanting(weak, self.sharp))

    def guarded(self) -> "Hunt":
        """Plan for the guards that the photos miss, if these are more than may be missed."""
        if self.guards is None:
            return self
        missed = self.subject.missed(self.guards, self.kept, self.many)
        known, old = len(self.subject.samples), self.subject.guards
        rows, lost = missed.rows, int(np.count_nonzero(missed.lost))
        if old + len(rows) <= self.spare.below and lost <= max(0, self.spare.lost - old):
            return self
        subject = self.subject.guarded(self.guards.places(rows))
        left = np.setdiff1d(np.arange(len(self.guards)), rows)
        few, many, kept = (
            subject.widened(pool, known) for pool in (self.few, self.many, self.kept)
        )
        most = self.spare.lost
        return replace(
            self,
            subject=subject,
            few=few,
            many=many,
            kept=kept,
            firm=np.concatenate([self.firm, missed.firm]),
            sharp=np.pad(self.sharp, (0, len(rows))),
            wanted=self.wanted + max(0, subject.guards - most) - max(0, old - most),
            guards=self.guards.places(left),
        ).relaxed()

    def searched(self, grid: Pool, beside: Pool | None, *, iterations: int, seed: int) -> "Hunt":
        """Go on searching from the photos among those of a grid, and others beside them."""
        pool = grid.joined(self.kept)
        pool = pool if beside is None else pool.joined(beside)
        start = len(grid) + np.arange(len(self.kept))
        problem = self.subject.problem(pool, wanted=self.wanted)
        result = self.subject.search(problem, start, iterations=iterations, seed=seed)
        found = start if result.solution is None else result.solution
        return replace(self, kept=pool.take(found), result=result).relaxed()
