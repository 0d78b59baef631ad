"""What it costs to go from one viewpoint to another (paper section 3.4, Eqs. 9 to 11)."""

import numpy as np

from planner.geometry.arrays import Floats


def translation_cost(positions: Floats) -> Floats:
    """Distance between viewpoints, scaled to [0, 1] over all pairs (Eq. 9).

    Parameters
    ----------
    positions
        Shape (V, 3), metres.

    Returns
    -------
    cost
        Shape (V, V), in [0, 1]; 0 on the diagonal, which is no pair, and everywhere if all
        distances are equal (as printed, Eq. 9 would divide by zero).

    """
    b = distances(positions)
    pair = ~np.eye(len(b), dtype=np.bool_)
    if not pair.any():
        return np.zeros_like(b)
    b_min, b_max = b[pair].min(), b[pair].max()
    if b_max == b_min:
        return np.zeros_like(b)
    return np.where(pair, (b - b_min) / (b_max - b_min), 0.0)  # Eq. 9


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


def switching_cost(positions: Floats, directions: Floats) -> Floats:
    """Mean of translation and rotation cost (Eq. 11).

    Parameters
    ----------
    positions
        Shape (V, 3), metres.
    directions
        View directions, shape (V, 3).

    Returns
    -------
    cost
        Shape (V, V), symmetric, in [0, 1]; 0 on the diagonal.

    """
    return 0.5 * translation_cost(positions) + 0.5 * rotation_cost(directions)  # Eq. 11


def switching_seconds(
    positions: Floats,
    yaw_deg: Floats,
    pitch_deg: Floats,
    *,
    speed: float,
    turn_rate_deg: float,
    stop_seconds: float,
) -> Floats:
    """Time of the switch: flying and turning at once, then the stop for the photo.

    The larger of distance over speed and turn over rate, plus the stop. The turn is the larger
    of the change of yaw, on the circle, and of pitch, as aircraft and gimbal turn together.

    Parameters
    ----------
    positions
        Shape (V, 3), metres.
    yaw_deg, pitch_deg
        Shape (V,), degrees.
    speed
        Metres a second, positive.
    turn_rate_deg
        Degrees a second, positive.
    stop_seconds
        Seconds at each photo, at least 0.

    Returns
    -------
    seconds
        Shape (V, V), symmetric; 0 on the diagonal.

    Raises
    ------
    ValueError
        If a rate is not positive or the stop is negative.

    """
    if not (speed > 0.0 and turn_rate_deg > 0.0 and stop_seconds >= 0.0):
        raise ValueError(
            "need speed > 0, turn_rate_deg > 0 and stop_seconds >= 0, got "
            f"{speed}, {turn_rate_deg} and {stop_seconds}."
        )
    around = np.abs(yaw_deg[:, None] - yaw_deg[None, :]) % 360.0
    yaw = np.minimum(around, 360.0 - around)  # unlike a signed difference, exactly symmetric
    pitch = np.abs(pitch_deg[:, None] - pitch_deg[None, :])
    moving = np.maximum(distances(positions) / speed, np.maximum(yaw, pitch) / turn_rate_deg)
    return np.where(np.eye(len(moving), dtype=np.bool_), 0.0, moving + stop_seconds)


def distances(positions: Floats) -> Floats:
    """Euclidean distance of each pair, shape (V, V), metres, exactly symmetric."""
    return np.asarray(np.linalg.norm(positions[:, None, :] - positions[None, :, :], axis=2))
