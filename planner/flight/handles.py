"""Which of several curves is flown soonest: short handles bend hard, long ones go round about."""

import numpy as np

from planner.config import FlightSettings
from planner.geometry.arrays import Floats

_STEPS = 24  # intervals of a piece
_SLOWEST = 1e-3  # metres a second, so that a cusp takes long and not for ever


def piece_seconds(controls: Floats, settings: FlightSettings) -> Floats:
    """Estimate how long each piece takes on its own.

    Speed is limited as such, by the lateral acceleration in bends, and by speeding up from the
    start and braking to the end: from and to rest where the aircraft stops for photos, else from
    and to what the bend there allows. This compares pieces, and times none: what comes before
    and after is left out.

    Parameters
    ----------
    controls
        Shape (..., 4, 3), metres.
    settings
        Speed, accelerations, and whether it stops.

    Returns
    -------
    seconds
        Shape (...).

    """
    swiftness, bend = _motion(controls, np.linspace(0.0, 1.0, _STEPS + 1))
    length = 0.5 * (swiftness[..., 1:] + swiftness[..., :-1]) / _STEPS
    run = np.concatenate([np.zeros_like(length[..., :1]), np.cumsum(length, axis=-1)], axis=-1)
    in_bends = settings.lateral_acceleration / np.maximum(bend, 1e-9)  # squares of speeds
    first, last = in_bends[..., :1], in_bends[..., -1:]
    if settings.shoot == "stop":
        first, last = np.zeros_like(first), np.zeros_like(last)
    twice = 2.0 * settings.acceleration
    ramps = np.minimum(first + twice * run, last + twice * (run[..., -1:] - run))
    speed = np.sqrt(np.minimum(np.minimum(in_bends, settings.speed**2), ramps))
    mean = 0.5 * (speed[..., 1:] + speed[..., :-1])
    return np.asarray((length / np.maximum(mean, _SLOWEST)).sum(axis=-1))


def _motion(controls: Floats, parameter: Floats) -> tuple[Floats, Floats]:
    """Size of the derivative and curvature at each parameter (s,), both (..., s)."""
    t = parameter[:, None]
    a, b, c, d = (controls[..., None, k, :] for k in range(4))
    velocity = 3.0 * ((1 - t) ** 2 * (b - a) + 2 * (1 - t) * t * (c - b) + t**2 * (d - c))
    change = 6.0 * ((1 - t) * (c - 2 * b + a) + t * (d - 2 * c + b))
    swiftness = np.linalg.norm(velocity, axis=-1)
    area = np.linalg.norm(np.cross(velocity, change), axis=-1)
    return swiftness, area / np.maximum(swiftness, 1e-9) ** 3
