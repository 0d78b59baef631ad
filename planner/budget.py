"""The best photos for a number of photos or for minutes of flight."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from planner.attempts import Mapper, Prior
from planner.bracket import Trial, trials_within
from planner.clock import Clock
from planner.config import Config
from planner.errors import PlannerError, Unattainable
from planner.findings import Finding
from planner.outing import Outing, fly_out
from planner.sorties.station import Station

MOST_TRIALS = 6
"""Smaller numbers of photos that are tried, unless none of them was within the limit."""

ROUNDING = 1e-6
"""Seconds by which the written times may be rounded up."""


@dataclass(frozen=True, slots=True)
class TimeLimit:
    """What came of a limit on the minutes of flight.

    Parameters
    ----------
    minutes
        As asked for.
    used
        Minutes of the flight as planned.
    share
        Share of the samples that can reach the target which the photos satisfy.
    whole_minutes, whole_photos, whole_share
        The same without the limit, with the number of photos.
    trials
        Smaller numbers of photos that were tried.

    """

    minutes: float
    used: float
    share: float
    whole_minutes: float
    whole_photos: int
    whole_share: float
    trials: int

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the limit cost, if it cost anything."""
        if self.whole_minutes <= self.minutes:
            return ()
        message = (
            f"{self.used:.2f} of {self.minutes:g} minutes of flight make "
            f"{100.0 * self.share:.1f} % of what can be reconstructed; {self.whole_photos} photos "
            f"in {self.whole_minutes:.2f} minutes would make {100.0 * self.whole_share:.1f} %"
        )
        return (Finding("viewpoints", "minutes-limit", message, self.share, partial=False),)


def best_outing(
    prior: Prior, stations: tuple[Station, ...], config: Config, spread: Mapper, clock: Clock
) -> tuple[Outing, TimeLimit | None]:
    """Plan within the number of photos, or the minutes of flight, that the settings allow.

    Fewer photos are tried where the flight takes longer than allowed, or where the photos that
    link the others are more than allowed with them. Of the plans within the limit it is the
    one that covers most samples, then the shortest.

    Parameters
    ----------
    prior
        What is known.
    stations
        Places of take-off and landing; with them the time of flight is that of all sorties, with
        their climbs, but without the time on the ground between them.
    config
        Settings, among them ``viewpoints.budget`` and ``viewpoints.minutes``.
    spread, clock
        Spread independent work, and hear how it goes.

    Returns
    -------
    outing, limit
        The plan, and what the limit on minutes did, if there is one.

    Raises
    ------
    PlannerError
        If not even the fewest photos are within the limit; the message says what is missing.

    """
    minutes, budget = config.viewpoints.minutes, config.viewpoints.budget

    def plan_of(number: int | None) -> Outing:
        views = config.viewpoints.model_copy(update={"budget": number, "minutes": None})
        settings = config.model_copy(update={"viewpoints": views})
        return fly_out(prior, stations, settings, spread, clock)

    whole = plan_of(budget)
    if minutes is not None:
        if whole.seconds <= 60.0 * minutes - ROUNDING:
            return whole, _limit(minutes, whole, whole, 0)
        chosen = sum(kind == "pair" for kind in whole.tried.chosen.kind)
        tried = _search(
            Trial(chosen, whole.seconds, whole),
            *(plan_of, lambda outing: outing.seconds, 60.0 * minutes - ROUNDING),
            least=2,
            clock=clock,
        )
        best = _best(tried, 60.0 * minutes - ROUNDING)
        if best is None:
            raise _too_little_time(minutes, [*tried, Trial(chosen, whole.seconds, whole)])
        return best, _limit(minutes, best, whole, len(tried))
    if budget is None or whole.photos <= budget:
        return whole, None
    tried = _search(
        Trial(budget, whole.photos, whole),
        *(plan_of, lambda outing: outing.photos, budget),
        least=1,
        clock=clock,
    )
    best = _best(tried, budget)
    if best is None:
        plans = [trial.answer for trial in tried if trial.answer is not None]
        fewest = min(plan.photos for plan in [*plans, whole])
        ties = "" if prior.scene.images is None else "viewpoints.ties = 0 or "
        raise PlannerError(
            f"viewpoints.budget = {budget}: the smallest plan found whose photos all match has "
            f"{fewest}; raise it to that, or set {ties}viewpoints.connected = false"
        )
    return best, None


def _search(
    whole: Trial[Outing | None],
    plan_of: Callable[[int | None], Outing],
    cost_of: Callable[[Outing], float],
    limit: float,
    *,
    least: int,
    clock: Clock,
) -> list[Trial[Outing | None]]:
    """Plans of fewer photos; one that cannot be made is beyond every limit."""

    def trial(number: int) -> Trial[Outing | None]:
        try:
            outing = plan_of(number)
        except Unattainable as error:
            clock.tell(f"no plan of {number} photos: {error}")
            return Trial(number, math.inf, None)
        clock.tell(f"{outing.photos} photos, {outing.seconds:.0f} s of flight")
        return Trial(number, cost_of(outing), outing)

    return trials_within(whole, trial, limit, least=least, most_trials=MOST_TRIALS)


def _best(tried: list[Trial[Outing | None]], limit: float) -> Outing | None:
    """The plan within the limit that covers most, then the shortest, then the first."""
    plans = [trial.answer for trial in tried if trial.answer is not None and trial.cost <= limit]
    return max(plans, key=lambda plan: (plan.tried.covered, -plan.seconds), default=None)


def _limit(minutes: float, outing: Outing, whole: Outing, trials: int) -> TimeLimit:
    return TimeLimit(
        minutes=minutes,
        used=outing.seconds / 60.0,
        share=outing.tried.selection.fulfilled,
        whole_minutes=whole.seconds / 60.0,
        whole_photos=whole.photos,
        whole_share=whole.tried.selection.fulfilled,
        trials=trials,
    )


def _too_little_time(minutes: float, tried: list[Trial[Outing | None]]) -> PlannerError:
    """Refusal that names the time of the shortest plan found."""
    plans = [trial.answer for trial in tried if trial.answer is not None]
    shortest = min(plans, key=lambda plan: plan.seconds)
    needed = math.ceil(100.0 * (shortest.seconds + ROUNDING) / 60.0) / 100.0
    return PlannerError(
        f"viewpoints.minutes = {minutes:g}: the shortest plan found, of {shortest.photos} photos, "
        f"takes {shortest.seconds / 60.0:.2f} minutes of flight, {needed - minutes:.2f} more than "
        f"allowed; set viewpoints.minutes to {needed:g} or more"
    )
