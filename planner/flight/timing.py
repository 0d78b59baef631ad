"""When the aircraft is where, and where it looks: the time-parameterised flight."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.flight.limits import Limits
from planner.flight.path import FlightPath
from planner.flight.profile import (
    CREEP,
    SpeedProfile,
    speed_in_bends,
    speed_profile,
)
from planner.geometry import bezier
from planner.geometry.angles import circular_difference_deg
from planner.geometry.arrays import Bools, Floats, Ints, read_only
from planner.viewpoints.viewpoints import Viewpoints

STATION = "station"
"""Kind of a place that is flown to without taking a photo: take-off and landing."""

SHORTEST = 0.1
"""Seconds that a leg lasts at least, even one without length or turn."""

SAME = 1e-9
"""Times nearer than this, seconds, differ by rounding."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """The flight in time; the start is at zero.

    Within a leg the aircraft flies its pieces by the speed profile and then rests until the camera
    has turned and settled. Yaw goes the short way round and pitch straight, both evenly in time,
    from ``turn_from`` to ``turn_until``; no photo is taken while they move.

    Parameters
    ----------
    path, viewpoints, limits
        What is flown, in which order, and how.
    profile
        Speeds along the intervals of all pieces, ``bezier.INTERVALS`` each.
    ends
        Seconds at the end of each interval, shape (intervals,).
    depart, done
        Seconds at which each leg starts and ends, shape (legs,); ``done`` is when the photo at
        its end is taken.
    turn_from, turn_until
        Seconds between which the camera turns on each leg, shape (legs,).
    first
        Viewpoint of each leg's start, shape (legs,).

    """

    path: FlightPath
    viewpoints: Viewpoints
    limits: Limits
    profile: SpeedProfile
    ends: Floats
    depart: Floats
    done: Floats
    turn_from: Floats
    turn_until: Floats
    first: Ints

    def __post_init__(self) -> None:
        legs = (len(self.depart),)
        for name in ("depart", "done", "turn_from", "turn_until"):
            object.__setattr__(self, name, read_only(getattr(self, name), legs, name=name))

    @property
    def duration(self) -> float:
        """Seconds from the start to the end."""
        if len(self.done):
            return float(self.done[-1])
        alone = self.path.start >= 0 and self.limits.stop
        return self.limits.settle_seconds if alone else 0.0

    @property
    def photo_times(self) -> Floats:
        """Seconds at which photos are taken, rising, shape (photos,)."""
        if self.path.start < 0:
            return np.zeros(0)
        start = self.depart[0] if len(self.depart) else self.duration
        times = np.concatenate([[start], self.done])
        return np.asarray(times[_is_photo(self.path, self.viewpoints)])

    @property
    def arrivals(self) -> Floats:
        """Seconds at which each leg's last piece is flown, shape (legs,)."""
        return np.asarray(self.ends.reshape(-1, bezier.INTERVALS)[self.path.reached >= 0, -1])

    @cached_property
    def piece_ends(self) -> Floats:
        """Seconds at the end of each piece, shape (M,)."""
        return np.asarray(self.ends.reshape(-1, bezier.INTERVALS)[:, -1])

    def at(self, seconds: Floats) -> tuple[Ints, Floats, Floats]:
        """Piece, parameter on it and speed at these times.

        Parameters
        ----------
        seconds
            Shape (m,), from 0 to the duration.

        Returns
        -------
        piece, parameter, speed
            Each (m,). While it rests the aircraft is at the end of the piece it has flown.

        """
        row = np.searchsorted(self.ends, seconds).clip(0, len(self.ends) - 1)
        begun = self.ends - self.profile.duration
        resting = (seconds < begun[row]) & (row > 0)
        row = np.where(resting, row - 1, row)
        piece = row // bezier.INTERVALS
        run, speed = self.profile.at(row, seconds - begun[row])
        before = np.cumsum(self.profile.length) - self.profile.length
        so_far = before[row] - before[piece * bezier.INTERVALS] + run
        parameter = bezier.parameter_at(self.path.controls, piece, so_far)
        over = seconds >= self.piece_ends[piece]
        return piece, np.where(over, 1.0, parameter), np.where(resting, 0.0, speed)

    def angles(self, seconds: Floats) -> tuple[Floats, Floats]:
        """Yaw in (-180, 180] and pitch at these times, degrees, each (m,)."""
        leg = np.searchsorted(self.done, seconds).clip(0, len(self.done) - 1)
        start, end = self.first[leg], self._last[leg]
        share = (seconds - self.turn_from[leg]) / (self.turn_until - self.turn_from)[leg]
        share = np.where(seconds >= self.turn_until[leg], 1.0, share.clip(0.0, 1.0))
        views = self.viewpoints
        turn = circular_difference_deg(views.yaw_deg[end], views.yaw_deg[start])
        yaw = (views.yaw_deg[start] + share * turn + 180.0) % 360.0 - 180.0
        tilt = views.pitch_deg[end] - views.pitch_deg[start]
        return np.where(yaw <= -180.0, 180.0, yaw), views.pitch_deg[start] + share * tilt

    @property
    def _last(self) -> Ints:
        return self.path.reached[self.path.reached >= 0]


def fly_in_time(path: FlightPath, viewpoints: Viewpoints, limits: Limits) -> Timeline:
    """Time a flight as fast as its limits allow.

    Speed keeps within the speed limit, the lateral acceleration in bends, and rests at zero at
    the ends, at corners and, if the aircraft stops for photos, at each viewpoint. A leg that is
    flown through is slowed so that the camera has turned, and held its angles, by its end; where
    that would be slower than :data:`~planner.flight.profile.CREEP` the aircraft stops instead.

    Parameters
    ----------
    path
        Certified curve.
    viewpoints
        Those that the path numbers; places of kind :data:`STATION` are no photos.
    limits
        Of motion.

    Returns
    -------
    timeline
        The same numbers in give the same numbers out.

    Raises
    ------
    ValueError
        If the path names other viewpoints.

    """
    named = np.concatenate([[path.start], path.reached])
    if named.max() >= len(viewpoints):
        raise ValueError(f"the path names viewpoint {named.max()} of {len(viewpoints)}.")
    last = path.reached[path.reached >= 0]
    first = np.concatenate([[path.start], last[:-1]])[: len(last)].astype(np.int64)
    photo = _is_photo(path, viewpoints)
    turn = _turn_seconds(viewpoints, first, last, limits)
    if not limits.stop:
        turn = turn + 2.0 * limits.hold_seconds
    whole = np.zeros(len(last))
    np.add.at(whole, path.leg, bezier.lengths(path.controls))
    stops = np.full(len(last), limits.stop) | ~photo[1:] | (whole < CREEP * turn)
    paced = np.full(len(last), np.inf)
    through = ~stops & (turn > 0.0) & (not limits.stop)
    paced[through] = whole[through] / turn[through]
    profile = _profile(path, paced, stops, limits)
    legs = np.repeat(path.leg, bezier.INTERVALS)
    moving = np.bincount(legs, profile.duration, minlength=len(last))
    window = np.maximum(np.maximum(moving, turn), SHORTEST)
    total = window + np.where(limits.stop & photo[1:], limits.settle_seconds, 0.0)
    rest = limits.settle_seconds if limits.stop and photo[:1].any() else 0.0
    done = rest + np.cumsum(total)
    depart = done - total
    so_far = np.cumsum(profile.duration)
    ends = np.maximum.accumulate(depart[legs] + so_far - (np.cumsum(moving) - moving)[legs])
    ends = np.where(ends > done[legs] - SAME, done[legs], ends)  # exactly, so that pieces are clear
    hold = 0.0 if limits.stop else limits.hold_seconds
    return Timeline(
        path,
        viewpoints,
        limits,
        profile,
        ends,
        depart,
        done,
        depart + hold,
        depart + window - hold,
        first,
    )


def _is_photo(path: FlightPath, viewpoints: Viewpoints) -> Bools:
    """Whether a photo is taken at the start and at the end of each leg, shape (legs + 1,)."""
    stations = np.array([kind == STATION for kind in viewpoints.kind], dtype=np.bool_)
    visits = np.concatenate([[path.start], path.reached[path.reached >= 0]]).astype(np.int64)
    if path.start < 0:
        return np.zeros(0, dtype=np.bool_)
    photo = ~stations[visits]
    if len(visits) > 1 and visits[-1] == path.start:
        photo[-1] = False  # back where the first photo was taken
    return photo


def _turn_seconds(views: Viewpoints, first: Ints, last: Ints, limits: Limits) -> Floats:
    """Seconds in which aircraft and gimbal turn from view to view, at once."""
    yaw = np.abs(circular_difference_deg(views.yaw_deg[last], views.yaw_deg[first]))
    pitch = np.abs(views.pitch_deg[last] - views.pitch_deg[first])
    return np.maximum(yaw / limits.yaw_rate_deg, pitch / limits.gimbal_rate_deg)


def _profile(path: FlightPath, paced: Floats, stops: Bools, limits: Limits) -> SpeedProfile:
    """Speed profile of all pieces; ``paced`` is the speed at which each leg's turn is in time."""
    count = bezier.INTERVALS
    fastest = np.minimum(speed_in_bends(path.controls, limits.lateral_acceleration), limits.speed)
    fastest = np.minimum(fastest, paced[path.leg][:, None])
    at_ends = np.full(count * len(path) + 1, np.inf)
    ends = count * (np.flatnonzero(path.reached >= 0) + 1)
    at_ends[ends] = np.where(stops, 0.0, limits.photo_speed)
    at_ends[count * path.corners()] = 0.0
    at_ends[[0, -1]] = 0.0
    return speed_profile(
        np.diff(bezier.length_table(path.controls), axis=1).ravel(),
        fastest.ravel(),
        at_ends,
        acceleration=limits.acceleration,
    )
