"""Speed along a way: as fast as its limits and the acceleration allow."""

import math
from dataclasses import dataclass

import numpy as np

from planner.geometry import bezier
from planner.geometry.arrays import Floats, Ints, read_only

CREEP = 0.05
"""Slowest speed that curvature asks for, metres a second: tighter bends are all but corners."""

STRAIGHT = 1e-5
"""Pieces that keep so close to their chord, metres, are straight: the rest is rounding."""

PROBES = 5
"""Places in each interval of a piece at which its curvature is looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class SpeedProfile:
    """Speed along intervals of a way: speeding up, cruising and braking within each.

    Parameters
    ----------
    length
        Of each interval, shape (n,), metres.
    speed
        At the ends of the intervals, shape (n + 1,), metres a second.
    peak
        Largest speed within each interval, shape (n,), metres a second.
    acceleration
        Of speeding up and braking, metres a second squared.

    """

    length: Floats
    speed: Floats
    peak: Floats
    acceleration: float

    def __post_init__(self) -> None:
        count = len(self.length)
        for name, shape in (("length", (count,)), ("speed", (count + 1,)), ("peak", (count,))):
            object.__setattr__(self, name, read_only(getattr(self, name), shape, name=name))

    @property
    def phases(self) -> tuple[Floats, Floats, Floats]:
        """Seconds of speeding up, cruising and braking within each interval, each (n,)."""
        first, last = self.speed[:-1], self.speed[1:]
        up = (self.peak - first) / self.acceleration
        down = (self.peak - last) / self.acceleration
        run = 0.5 * (up * (first + self.peak) + down * (last + self.peak))
        moving = self.peak > 0.0
        cruise = (self.length - run).clip(0.0) / np.where(moving, self.peak, 1.0)
        return up, np.where(moving, cruise, 0.0), down

    @property
    def duration(self) -> Floats:
        """Seconds of each interval, shape (n,)."""
        return np.asarray(np.sum(self.phases, axis=0))

    def at(self, interval: Ints, seconds: Floats) -> tuple[Floats, Floats]:
        """Distance run and speed, so many seconds into an interval.

        Parameters
        ----------
        interval
            Shape (m,).
        seconds
            From the interval's start, shape (m,); clipped to the interval.

        Returns
        -------
        run, speed
            Metres from the interval's start and metres a second, each (m,).

        """
        up, cruise, down = (phase[interval] for phase in self.phases)
        first, peak = self.speed[interval], self.peak[interval]
        one = seconds.clip(0.0, up)
        two = (seconds - up).clip(0.0, cruise)
        three = (seconds - up - cruise).clip(0.0, down)
        a = self.acceleration
        run = first * one + 0.5 * a * one**2 + peak * (two + three) - 0.5 * a * three**2
        speed = np.where(seconds < up, first + a * one, peak - a * three)
        return run.clip(0.0, self.length[interval]), speed


def speed_profile(
    length: Floats, fastest: Floats, at_ends: Floats, *, acceleration: float
) -> SpeedProfile:
    r"""Fastest speeds along a way with limits (the trapezoidal profile, generalised).

    Speeding up from each limit bounds what follows it, :math:`v_i^2 \le v_j^2 + 2 a (s_i - s_j)`,
    and braking towards each bounds what goes before. The least of all these bounds is the
    profile; within an interval of one limit it is a trapezoid, or a triangle where the interval
    is too short to reach the limit.

    Parameters
    ----------
    length
        Of each interval, shape (n,), metres.
    fastest
        Limit within each interval, shape (n,), metres a second.
    at_ends
        Limits at the ends of the intervals, shape (n + 1,); 0 is a stop.
    acceleration
        Metres a second squared, positive.

    Returns
    -------
    profile
        Nowhere faster than the limits.

    """
    cap = np.minimum(at_ends, np.minimum(np.r_[fastest, np.inf], np.r_[np.inf, fastest])) ** 2
    gain = 2.0 * acceleration * np.r_[0.0, np.cumsum(length)]
    forth = gain + np.minimum.accumulate(cap - gain)
    back = np.minimum.accumulate((cap + gain)[::-1])[::-1] - gain
    square = np.minimum(np.minimum(forth, back), cap).clip(0.0)
    first, last = square[:-1], square[1:]
    peak = np.minimum(fastest**2, 0.5 * (first + last) + acceleration * length)
    return SpeedProfile(
        length, np.sqrt(square), np.sqrt(np.maximum(peak, np.maximum(first, last))), acceleration
    )


def speed_in_bends(controls: Floats, lateral_acceleration: float) -> Floats:
    r"""Speed at which each interval of each piece just keeps the lateral acceleration.

    :math:`v^2 \kappa \le a`, with the largest curvature :math:`\kappa = |r' \times r''| / |r'|^3`
    of :data:`PROBES` places in the interval, but at least :data:`CREEP`.

    Parameters
    ----------
    controls
        Shape (M, 4, 3), metres.
    lateral_acceleration
        Metres a second squared, positive.

    Returns
    -------
    speed
        Shape (M, ``bezier.INTERVALS``), metres a second; infinite where straight.

    """
    share = np.linspace(0.0, 1.0, PROBES)
    at = ((np.arange(bezier.INTERVALS)[:, None] + share) / bezier.INTERVALS)[None]
    pieces = controls[:, None, None]
    rate = bezier.derivative(pieces, np.broadcast_to(at, (len(controls), *at.shape[1:])))
    bend = np.diff(controls, n=2, axis=1)[:, None, None]  # (M, 1, 1, 2, 3)
    second = 6.0 * ((1.0 - at[..., None]) * bend[..., 0, :] + at[..., None] * bend[..., 1, :])
    cross = np.linalg.norm(np.cross(rate, second), axis=-1)
    cube = np.linalg.norm(rate, axis=-1) ** 3
    square = lateral_acceleration * cube / np.where(cross > 0.0, cross, 1.0)
    square = np.where(cross > 0.0, square, np.inf).min(axis=-1)
    straight = bezier.hull_radius(controls) < STRAIGHT
    square[straight] = np.inf
    return np.asarray(np.maximum(np.sqrt(square), CREEP))


def rest_to_rest(distance: float, speed: float, acceleration: float) -> float:
    """Seconds of a straight way from rest to rest: a trapezoid, or a triangle if it is short.

    Parameters
    ----------
    distance
        Metres, at least 0.
    speed
        Largest, metres a second.
    acceleration
        Metres a second squared.

    """
    if distance * acceleration < speed**2:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration
