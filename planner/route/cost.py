"""What it costs to go from one viewpoint to another (paper section 3.4, Eqs. 9 to 11)."""

import math
from dataclasses import dataclass

import numpy as np

from planner.config import FlightSettings
from planner.geometry.arrays import Floats


def translation_cost(positions: Floats, lengths: Floats | None = None) -> Floats:
    """Distance between viewpoints, scaled to [0, 1] over all pairs (Eq. 9).

    Parameters
    ----------
    positions
        Shape (V, 3), metres.
    lengths
        Lengths of the ways that are flown, shape (V, V), metres, none less than the distance;
        by default the distances. The scale stays that of the distances, so that a cost grows
        with its own length alone.

    Returns
    -------
    cost
        Shape (V, V), from 0, in [0, 1] where ways are straight; 0 on the diagonal, which is no
        pair, and everywhere if all distances are equal (as printed, Eq. 9 would divide by zero).

    """
    b = distances(positions)
    ways = b if lengths is None else lengths
    pair = ~np.eye(len(b), dtype=np.bool_)
    if not pair.any():
        return np.zeros_like(b)
    b_min, b_max = b[pair].min(), b[pair].max()
    if b_max == b_min:
        return np.zeros_like(b)
    return np.where(pair, (ways - b_min) / (b_max - b_min), 0.0)  # Eq. 9


def rotation_cost(directions: Floats) -> Floats:
    """Turn between view directions: 0 where parallel, 1 where opposite (Eq. 10).

    Parameters
    ----------
    directions
        Shape (V, 3), of any length but zero.

    Returns
    -------
    cost
        Shape (V, V), in [0, 1]; 0 on the diagonal.

    """
    o = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    c = 0.5 * (1.0 - (o @ o.T).clip(-1.0, 1.0))  # Eq. 10
    np.fill_diagonal(c, 0.0)
    return np.asarray(0.5 * (c + c.T))  # a product of matrices may differ in the last bit


def switching_cost(positions: Floats, directions: Floats, lengths: Floats | None = None) -> Floats:
    """Mean of translation and rotation cost (Eq. 11).

    Parameters
    ----------
    positions
        Shape (V, 3), metres.
    directions
        View directions, shape (V, 3).
    lengths
        As :func:`translation_cost` takes them.

    Returns
    -------
    cost
        Shape (V, V), symmetric, in [0, 1] where ways are straight; 0 on the diagonal.

    """
    return 0.5 * translation_cost(positions, lengths) + 0.5 * rotation_cost(directions)  # Eq. 11


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast the aircraft and its camera go from one photo to the next.

    Parameters
    ----------
    speed
        Metres a second.
    acceleration
        From rest and to rest, metres a second squared; infinite if photos are flown through.
    yaw_rate_deg, gimbal_rate_deg
        Degrees a second of yaw and of pitch.
    rest
        Seconds spent at each photo beside that, at least 0.

    Raises
    ------
    ValueError
        If a rate is not positive or the rest is negative.

    """

    speed: float = 4.0
    acceleration: float = 2.0
    yaw_rate_deg: float = 60.0
    gimbal_rate_deg: float = 60.0
    rest: float = 1.0

    def __post_init__(self) -> None:
        rates = self.speed, self.acceleration, self.yaw_rate_deg, self.gimbal_rate_deg
        if not (min(rates) > 0.0 and self.rest >= 0.0):
            raise ValueError(f"need positive rates and rest >= 0, got {rates} and {self.rest}.")

    @classmethod
    def of(cls, settings: FlightSettings) -> "Pace":
        """Pace of the flight that these settings describe."""
        stop = settings.shoot == "stop"
        return cls(
            settings.speed,
            settings.acceleration if stop else math.inf,
            settings.yaw_rate_deg,
            settings.gimbal_rate_deg,
            settings.settle_seconds if stop else 2.0 * settings.hold_seconds,
        )

    def flying(self, metres: Floats) -> Floats:
        """Seconds from rest to rest over such lengths: a trapezoid of speed, or a triangle."""
        ramps = self.speed**2 / self.acceleration  # of speeding up and braking together, metres
        cruising = metres / self.speed + self.speed / self.acceleration
        return np.where(metres >= ramps, cruising, 2.0 * np.sqrt(metres / self.acceleration))


def switching_seconds(
    positions: Floats,
    yaw_deg: Floats,
    pitch_deg: Floats,
    *,
    pace: Pace,
    lengths: Floats | None = None,
) -> Floats:
    """Time of the switch: flying and turning at once, then the rest at the photo.

    The longest of the flight, the change of yaw on the circle, and the change of pitch, as
    aircraft and gimbal turn while it flies; plus the rest.

    Parameters
    ----------
    positions
        Shape (V, 3), metres.
    yaw_deg, pitch_deg
        Shape (V,), degrees.
    pace
        Speed, acceleration and rates.
    lengths
        Lengths of the ways that are flown, shape (V, V), metres; by default the distances.

    Returns
    -------
    seconds
        Shape (V, V), symmetric; 0 on the diagonal.

    """
    around = np.abs(yaw_deg[:, None] - yaw_deg[None, :]) % 360.0
    yaw = np.minimum(around, 360.0 - around)  # unlike a signed difference, exactly symmetric
    pitch = np.abs(pitch_deg[:, None] - pitch_deg[None, :])
    turning = np.maximum(yaw / pace.yaw_rate_deg, pitch / pace.gimbal_rate_deg)
    flying = pace.flying(distances(positions) if lengths is None else lengths)
    moving = np.maximum(flying, turning)
    return np.where(np.eye(len(moving), dtype=np.bool_), 0.0, moving + pace.rest)


def distances(positions: Floats) -> Floats:
    """Euclidean distance of each pair, shape (V, V), metres, exactly symmetric."""
    return np.asarray(np.linalg.norm(positions[:, None, :] - positions[None, :, :], axis=2))
