"""What a schedule of sorties is."""

from dataclasses import dataclass

from planner.flight.fly import Flight
from planner.flight.timing import Timeline
from planner.geometry.arrays import Ints
from planner.sorties.sortie import Sortie
from planner.sorties.station import Station
from planner.viewpoints.viewpoints import Viewpoints


@dataclass(frozen=True, slots=True, eq=False)
class Sorties:
    """All sorties of a plan.

    Parameters
    ----------
    stations
        Places of take-off and landing.
    flown
        The sorties in order; their photos number the viewpoints of ``flight``.
    flight, timeline
        All photos in the order of the sorties, as one flight.
    order
        Rows of the viewpoints as they were given, in that order, shape (V,).
    method
        ``"split"`` if the given order was cut, ``"routing"`` if another order was found.
    seconds
        Of all sorties and the ground time between, by method.
    rounds
        Cuts that were flown until each sortie's time was its true one.
    proven
        Whether no other cut of this order takes less, if each leg takes what it takes in the
        whole flight, or in a sortie where that was flown.
    others
        Flights through the photos of other parts of free space, numbered after those of
        ``flight``: no flight leads from one part to another, but sorties reach them all.

    """

    stations: tuple[Station, ...]
    flown: tuple[Sortie, ...]
    flight: Flight
    timeline: Timeline
    order: Ints
    method: str
    seconds: dict[str, float]
    rounds: int
    proven: bool
    others: tuple[Flight, ...] = ()

    @property
    def viewpoints(self) -> Viewpoints:
        """All photos, part after part."""
        views = self.flight.viewpoints
        for flight in self.others:
            views = views.joined(flight.viewpoints)
        return views
