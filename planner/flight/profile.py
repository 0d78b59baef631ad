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

CUTS = 4
"""Parts of each interval of a piece whose curvature is bounded one by one."""


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
    r"""Speed at which each interval of each piece is proven to keep the lateral acceleration.

    :math:`v^2 \kappa \le a`, with the bound of :func:`curvature_bound`, the larger of
    :data:`CUTS` parts of the interval, but at least :data:`CREEP`.

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
    bound = curvature_bound(controls, bezier.INTERVALS * CUTS)
    most = bound.reshape(len(controls), bezier.INTERVALS, CUTS).max(axis=-1)
    square = lateral_acceleration / np.where(most > 0.0, most, 1.0)
    square = np.where(most > 0.0, square, np.inf)
    square[bezier.hull_radius(controls) < STRAIGHT] = np.inf
    return np.asarray(np.maximum(np.sqrt(square), CREEP))


def curvature_bound(controls: Floats, parts: int) -> Floats:
    r"""Bound the curvature of cubic pieces from above, part by part.

    On a part, :math:`r'` is a quadratic Bezier curve with control vectors :math:`e_0, e_1, e_2`
    (the blossom of the hodograph), and :math:`r' \times r''` one with :math:`e_0 \times e_1`,
    :math:`\frac{1}{2} e_0 \times e_2` and :math:`e_1 \times e_2`, times :math:`2 / h` for parts
    of length :math:`h` in the parameter. Both lie in the convex hulls of their control vectors, so
    that :math:`|r' \times r''|` is at most the longest of the one, and :math:`|r'|` at least the
    least component of the other along any direction, here that of :math:`e_1`.

    Parameters
    ----------
    controls
        Shape (M, 4, 3), metres.
    parts
        How many equal parts each piece is cut into.

    Returns
    -------
    bound
        At least :math:`\kappa = |r' \times r''| / |r'|^3` all over each part, shape (M, parts), one
        over metres; infinite where a part may come to rest in a bend, 0 where all of it rests.

    """
    base = 3.0 * np.diff(controls, axis=1)[:, :, None]  # (M, 3, 1, 3)
    left, right = np.arange(parts)[:, None] / parts, np.arange(1, parts + 1)[:, None] / parts

    def blossom(one: Floats, other: Floats) -> Floats:
        return np.asarray(
            (1.0 - one) * (1.0 - other) * base[:, 0]
            + (one * (1.0 - other) + other * (1.0 - one)) * base[:, 1]
            + one * other * base[:, 2]
        )

    first, middle, last = blossom(left, left), blossom(left, right), blossom(right, right)
    turning = (np.cross(first, middle), 0.5 * np.cross(first, last), np.cross(middle, last))
    area = 2.0 * parts * np.max([np.linalg.norm(one, axis=-1) for one in turning], axis=0)
    size = np.linalg.norm(middle, axis=-1)
    along = middle / np.where(size > 0.0, size, 1.0)[..., None]
    swiftness = np.min([(one * along).sum(axis=-1) for one in (first, middle, last)], axis=0)
    moving = swiftness > 0.0
    bound = area / np.where(moving, swiftness, 1.0) ** 3
    return np.where(moving, bound, np.where(area > 0.0, np.inf, 0.0))


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
