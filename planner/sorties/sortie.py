"""One flight from lift-off to landing."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.flight.limits import Limits
from planner.flight.path import FlightPath
from planner.flight.profile import rest_to_rest
from planner.flight.sampling import TIME_DECIMALS, sample_path
from planner.flight.timing import STATION, Timeline, fly_in_time
from planner.geometry.arrays import Floats, Ints, read_only
from planner.sorties.station import Station
from planner.viewpoints.viewpoints import Viewpoints

ON_THE_COLUMN = -1
"""Segment of the rows at take-off and landing: between pad and entry."""


@dataclass(frozen=True, eq=False)
class Sortie:
    """A climb, a certified flight from the entry through its photos and back, and a descent.

    Parameters
    ----------
    number
        Of its station.
    station
        Where it takes off and lands.
    photos
        Viewpoints in flying order, shape (n,): rows of ``viewpoints.csv``.
    shared
        Those of them that another sortie takes too, so that photos link, shape (m,).
    timeline
        Of the flight from entry to entry: its first and last viewpoint is the entry.
    climb_speed
        Metres a second, up and down.

    """

    number: int
    station: Station
    photos: Ints
    shared: Ints
    timeline: Timeline
    climb_speed: float

    def __post_init__(self) -> None:
        for name in ("photos", "shared"):
            rows = read_only(getattr(self, name), (None,), name=name, dtype=np.int64)
            object.__setattr__(self, name, rows)

    @property
    def path(self) -> FlightPath:
        """The certified curve from entry to entry."""
        return self.timeline.path

    @property
    def climb_seconds(self) -> float:
        """Seconds of the climb, and of the descent."""
        limits = self.timeline.limits
        return rest_to_rest(self.station.climb, self.climb_speed, limits.acceleration)

    @property
    def duration(self) -> float:
        """Seconds from lift-off to landing."""
        return self.timeline.duration + 2.0 * self.climb_seconds

    @property
    def length(self) -> float:
        """Metres from lift-off to landing."""
        return self.path.length + 2.0 * self.station.climb

    @property
    def waypoints(self) -> int:
        """Places that the aircraft is sent to: the entry, and the end of each piece."""
        return len(self.path) + 1

    @cached_property
    def photo_times(self) -> Floats:
        """Seconds after lift-off at which photos are taken."""
        return self.timeline.photo_times + self.climb_seconds

    def rows(self, d_min: float) -> Floats:
        """Points of the whole sortie, as :func:`~planner.flight.sampling.sample_path` gives them.

        The first and the last row are the pad, and their segment is :data:`ON_THE_COLUMN`.
        """
        flown = sample_path(self.timeline, d_min=d_min)
        flown[:, 0] = np.round(flown[:, 0] + self.climb_seconds, TIME_DECIMALS)
        ends = flown[[0, -1]].copy()
        ends[:, 0] = 0.0, np.round(self.duration, TIME_DECIMALS)
        ends[:, 1:4] = self.station.pad
        ends[:, 6] = ON_THE_COLUMN
        return np.vstack([ends[:1], flown, ends[1:]])


def stops_of(viewpoints: Viewpoints, photos: Ints, station: Station) -> Viewpoints:
    """Viewpoints of a sortie: the entry, the photos, the entry, where the camera waits ready."""
    rows = np.asarray(photos)
    ends = Viewpoints(
        np.stack([station.entry, station.entry]),
        viewpoints.yaw_deg[rows[[0, -1]]],
        viewpoints.pitch_deg[rows[[0, -1]]],
        (STATION, STATION),
        np.full(2, -1),
    )
    return ends.take(np.array([0])).joined(viewpoints.take(rows)).joined(ends.take(np.array([1])))


def timed_sortie(
    number: int,
    station: Station,
    viewpoints: Viewpoints,
    path: FlightPath,
    *,
    photos: Ints,
    shared: Ints,
    limits: Limits,
    climb_speed: float,
) -> Sortie:
    """Sortie along a path that numbers the places of :func:`stops_of`.

    Raises
    ------
    ValueError
        If the path does not visit them once each, in order.

    """
    stops = stops_of(viewpoints, photos, station)
    visits = np.concatenate([[path.start], path.reached[path.reached >= 0]])
    if not np.array_equal(visits, np.arange(len(stops))):
        raise ValueError("the path of a sortie must visit its places in order.")
    timeline = fly_in_time(path, stops, limits)
    return Sortie(number, station, photos, shared, timeline, climb_speed)
