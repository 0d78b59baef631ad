"""Yaw, pitch and view directions; differences on the circle."""

import numpy as np

from planner.geometry.arrays import Floats


def direction(yaw_deg: Floats, pitch_deg: Floats) -> Floats:
    """Unit view direction of each yaw and pitch.

    Parameters
    ----------
    yaw_deg
        Degrees clockwise from local +y (grid north), any shape (...).
    pitch_deg
        Degrees, 0 at the horizon, -90 at nadir, same shape.

    Returns
    -------
    direction
        Unit vectors, shape (..., 3), local frame, z up.

    """
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    level = np.cos(pitch)
    return np.stack([level * np.sin(yaw), level * np.cos(yaw), np.sin(pitch)], axis=-1)


def yaw_pitch(direction: Floats) -> tuple[Floats, Floats]:
    """Yaw and pitch, in degrees, that look along each vector.

    Parameters
    ----------
    direction
        Vectors of any length but zero, shape (..., 3), local frame, z up.

    Returns
    -------
    yaw_deg, pitch_deg
        Yaw in (-180, 180], clockwise from +y (0 for a vertical vector); pitch in [-90, 90].

    """
    x, y, z = np.moveaxis(np.asarray(direction, dtype=np.float64), -1, 0)
    yaw = np.degrees(np.arctan2(x, y))
    pitch = np.degrees(np.arctan2(z, np.hypot(x, y)))
    return np.where(yaw <= -180.0, 180.0, yaw), pitch


def circular_difference_deg(a: Floats, b: Floats) -> Floats:
    """Signed smallest turn from ``b`` to ``a``, degrees in [-180, 180)."""
    return (np.asarray(a) - np.asarray(b) + 180.0) % 360.0 - 180.0
