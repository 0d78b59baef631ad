"""One whole answer: photos, their order, the certified flight in time, and its sorties."""

from dataclasses import dataclass

from planner.attempts import Attempt, Mapper, Prior, attempt, refilled, solver_words
from planner.clock import Clock
from planner.config import Config
from planner.flight.fly import Flight
from planner.flight.limits import Limits
from planner.flight.timing import Timeline, fly_in_time
from planner.sorties.parts import plan_parts
from planner.sorties.sorties import Sorties
from planner.sorties.station import Station
from planner.viewpoints.viewpoints import Viewpoints


@dataclass(frozen=True, slots=True, eq=False)
class Outing:
    """Photos with all that is flown to take them.

    Parameters
    ----------
    tried
        The choice of photos with its flight.
    flight, timeline
        The flight as it is written, and its times; in the order of the sorties if there are any.
    sorties
        Flights from take-off to landing, where stations are given.

    """

    tried: Attempt
    flight: Flight
    timeline: Timeline
    sorties: Sorties | None

    @property
    def seconds(self) -> float:
        """Seconds in the air: all sorties from lift-off to landing, or from first to last photo."""
        if self.sorties is None:
            return self.timeline.duration
        return sum(sortie.duration for sortie in self.sorties.flown)

    @property
    def viewpoints(self) -> Viewpoints:
        """All photos that are taken; those of ``flight`` come first."""
        return self.flight.viewpoints if self.sorties is None else self.sorties.viewpoints

    @property
    def photos(self) -> int:
        """Number of photos that are taken."""
        return len(self.viewpoints)


def fly_out(
    prior: Prior, stations: tuple[Station, ...], config: Config, spread: Mapper, clock: Clock
) -> Outing:
    """Choose photos, fly through them, and cut the flight into sorties if there are stations."""
    tried = attempt(prior, prior.positions, config, spread, clock, stations=stations)
    if tried.dropped:
        tried = refilled(tried, prior, config, spread, clock, stations=stations)
    flight = tried.flights[0]
    limits = Limits.of(config.flight, gsd=prior.scale.gsd)
    if not stations:
        return Outing(tried, flight, fly_in_time(flight.path, flight.viewpoints, limits), None)
    with clock.stage("sorties"), solver_words():
        sorties = plan_parts(
            tried.flights,
            tried.parts,
            stations,
            prior.airspace,
            tried.matches,
            settings=config.sorties,
            flight_settings=config.flight,
            limits=limits,
            seed=config.seed,
        )
        clock.tell(f"{len(sorties.flown)} sorties, {sorties.seconds[sorties.method]:.0f} s")
    return Outing(tried, sorties.flight, sorties.timeline, sorties)
