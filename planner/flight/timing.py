"""Where the aircraft is and where it looks, at a constant speed along the curve."""

import numpy as np

from planner.flight.path import FlightPath
from planner.geometry import bezier
from planner.geometry.angles import circular_difference_deg
from planner.geometry.arrays import Floats, Ints
from planner.viewpoints.viewpoints import Viewpoints

ROW_DECIMALS = 4
"""Rows are rounded so: 0.1 ms, 0.1 mm, 0.0001 degrees."""

TURN_RATE_DEG = 60.0
"""Degrees a second at which the camera turns between two photos from one place."""


MOST_ROWS = 5_000_000
"""Longer tables are refused: they come from a broken file."""

SHORTEST = 1e-3
"""A leg shorter than this many metres counts as one without length."""


def sample_path(
    path: FlightPath, viewpoints: Viewpoints, *, speed: float, step: float = 0.1
) -> Floats:
    """Rows of ``path.csv``: the flown curve on a uniform grid of time, and at each viewpoint.

    A piece lasts its arc length over the speed. A leg without length lasts as long as the camera
    turns, at :data:`TURN_RATE_DEG`, and at least one step. At a given time the piece is found by
    its end times, the place on it by :func:`planner.geometry.bezier.parameter_at`. Yaw goes the
    short way round and pitch straight, both in proportion to the leg's length. Nothing is
    random or adaptive: the same numbers in give the same rows out, so that a written table can
    be worked out again from the written curve.

    Parameters
    ----------
    path
        Certified curve.
    viewpoints
        Those that the path numbers, shape (K,).
    speed
        Metres a second, positive.
    step
        Seconds from row to row, positive.

    Returns
    -------
    rows
        Shape (n, 7): t (seconds), x, y, z (metres), yaw and pitch (degrees), piece. Rounded
        to :data:`ROW_DECIMALS`. Times rise strictly; a grid row within a tenth of a
        millisecond of a viewpoint gives way to it.

    Raises
    ------
    ValueError
        If speed or step is not positive, the path speaks of other viewpoints, or there would be
        more than :data:`MOST_ROWS` rows.

    """
    if not (speed > 0.0 and step > 0.0):
        raise ValueError(f"speed and step must be positive, got {speed} and {step}.")
    named = np.concatenate([[path.start], path.reached])
    if named.max() >= len(viewpoints):
        raise ValueError(f"the path names viewpoint {named.max()} of {len(viewpoints)}.")
    if path.start < 0:
        return np.zeros((0, 7))
    if not len(path):
        return _rounded(
            np.zeros(1),
            viewpoints.positions[[path.start]],
            viewpoints.yaw_deg[[path.start]],
            viewpoints.pitch_deg[[path.start]],
            np.zeros(1),
        )
    last = np.flatnonzero(path.reached >= 0)  # last piece of each leg
    ends = path.reached[last]
    begins = np.concatenate([[path.start], ends[:-1]])
    turn = circular_difference_deg(viewpoints.yaw_deg[ends], viewpoints.yaw_deg[begins])
    tilt = viewpoints.pitch_deg[ends] - viewpoints.pitch_deg[begins]
    resting = np.maximum(np.maximum(np.abs(turn), np.abs(tilt)) / TURN_RATE_DEG, step)
    durations = _durations(path, resting, speed)
    until = np.cumsum(durations)
    arrival, departure = until[last], np.concatenate([[0.0], until[last[:-1]]])
    if not arrival[-1] / step < MOST_ROWS:
        raise ValueError(
            f"a flight of {arrival[-1]:.3g} s has too many rows; is {speed} m/s right?"
        )

    t = _times(arrival, step)
    piece = np.searchsorted(until, t).clip(0, len(path) - 1)
    run = (t - (until - durations)[piece]) * speed
    parameter = bezier.parameter_at(path.controls, piece, run)
    parameter = np.where(t == until[piece], 1.0, parameter)
    leg = path.leg[piece]
    share = (t - departure[leg]) / (arrival - departure)[leg]
    share = np.where(t == arrival[leg], 1.0, share)
    return _rounded(
        t,
        bezier.evaluate(path.controls[piece], parameter),
        viewpoints.yaw_deg[begins][leg] + share * turn[leg],
        viewpoints.pitch_deg[begins][leg] + share * tilt[leg],
        piece,
    )


def _durations(path: FlightPath, resting: Floats, speed: float) -> Floats:
    """Seconds of each piece; ``resting`` are those of each leg if it has no length."""
    lengths = bezier.lengths(path.controls)
    whole = np.bincount(path.leg, lengths)[path.leg]
    pieces = np.bincount(path.leg)[path.leg]
    return np.where(whole < SHORTEST, resting[path.leg] / pieces, lengths / speed)


def _times(arrivals: Floats, step: float) -> Floats:
    """Grid of times up to the last arrival, and the arrivals themselves, rising."""
    marks = np.concatenate([[0.0], arrivals])
    grid = step * np.arange(int(np.floor(arrivals[-1] / step)) + 1)
    after = np.searchsorted(marks, grid).clip(0, len(arrivals))
    before = (after - 1).clip(0)
    gap = np.minimum(np.abs(marks[after] - grid), np.abs(grid - marks[before]))
    return np.sort(np.concatenate([grid[gap > 10.0**-ROW_DECIMALS], marks]))


def _rounded(
    t: Floats, xyz: Floats, yaw_deg: Floats, pitch_deg: Floats, piece: Floats | Ints
) -> Floats:
    """Rows, rounded, with yaw in (-180, 180]."""
    rows: Floats = np.column_stack([t, xyz, yaw_deg, pitch_deg, piece]).astype(np.float64)
    rows[:, 4] = (rows[:, 4] + 180.0) % 360.0 - 180.0
    rows = np.round(rows, ROW_DECIMALS) + 0.0  # -0.0 becomes 0.0
    rows[rows[:, 4] <= -180.0, 4] = 180.0
    return rows
