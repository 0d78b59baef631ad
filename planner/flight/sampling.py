"""Rows of ``path.csv``: points so dense that straight lines between them are safe too."""

import numpy as np

from planner.errors import PlannerError
from planner.flight.timing import Timeline
from planner.geometry import bezier
from planner.geometry.arrays import Bools, Floats, Ints

STEP = 0.1
"""Seconds from row to row where nothing asks for more."""

ROW_DECIMALS = 4
"""Rows are rounded so: 0.1 mm, 0.0001 degrees."""

TIME_DECIMALS = 6
"""Times are rounded so: microseconds."""

APART = 1e-5
"""Rows nearer in time than this, seconds, are one."""

ROUNDING = 2e-4
"""What rounding and :data:`APART` may cost a chord of its distance, metres."""

LEAST_SLACK = 1e-4
"""Chords are not asked to keep closer to the curve than this, metres."""

MOST_ROWS = 5_000_000
"""Longer tables are refused: they come from a broken file."""

_SHARPER = 24


def sample_path(timeline: Timeline, *, d_min: float | None = None, step: float = STEP) -> Floats:
    """Rows of ``path.csv``, such that an aircraft that flies from row to row is safe as well.

    There is a row on each multiple of ``step``, at the end of each piece, at each arrival and
    each photo, and wherever the camera starts or stops turning. A straight line between two rows of
    a piece lies within the distance ``h`` of the curve that
    :func:`~planner.geometry.bezier.hull_radius` gives for the stretch between them; rows are
    added half-way in time until ``h`` is less than what the piece is proven to keep beyond
    ``d_min``, and beyond its zones, less :data:`ROUNDING`. So the proof of the curve is one of
    the rows. Nothing is random: the same numbers in give the same rows out.

    Parameters
    ----------
    timeline
        The flight in time.
    d_min
        Distance that the lines are to keep, metres; ``None`` asks nothing of them.
    step
        Seconds from row to row, positive.

    Returns
    -------
    rows
        Shape (n, 7): t (seconds), x, y, z (metres), yaw and pitch (degrees), piece. Rounded to
        :data:`TIME_DECIMALS` and :data:`ROW_DECIMALS`. Times rise strictly.

    Raises
    ------
    ValueError
        If ``step`` is not positive.
    PlannerError
        If there would be more than :data:`MOST_ROWS` rows.

    """
    if not step > 0.0:
        raise ValueError(f"step must be positive, got {step}.")
    path, views = timeline.path, timeline.viewpoints
    if path.start < 0:
        return np.zeros((0, 7))
    if not len(path):
        spot = [path.start, path.start]
        return _rows(
            np.array([0.0, timeline.duration])[: 1 + (timeline.duration > 0.0)],
            views.positions[spot],
            views.yaw_deg[spot],
            views.pitch_deg[spot],
            np.zeros(2, dtype=np.int64),
        )
    _refuse_more_than_most(timeline.duration / step)
    t = _times(timeline, step)
    if d_min is not None:
        slack = np.minimum(path.clearance - d_min, path.zone_margin) - ROUNDING
        t = _refined(t, timeline, np.maximum(slack, LEAST_SLACK))
    piece, parameter, _ = timeline.at(t)
    return _rows(t, bezier.evaluate(path.controls[piece], parameter), *timeline.angles(t), piece)


def _times(timeline: Timeline, step: float) -> Floats:
    """Grid of times and all events, rising; an earlier group wins where two nearly coincide."""
    t = np.zeros(0)
    grid = step * np.arange(int(np.floor(timeline.duration / step)) + 1)
    for group in (
        np.r_[0.0, timeline.depart[:1], timeline.done],
        timeline.arrivals,
        timeline.piece_ends,
        np.r_[timeline.turn_from, timeline.turn_until],
        grid,
    ):
        new = np.unique(group)
        new = new[np.r_[True, np.diff(new) > APART]]
        if len(t):
            after = np.searchsorted(t, new)
            gap = np.minimum(
                np.abs(new - t[(after - 1).clip(0)]), np.abs(t[after.clip(0, len(t) - 1)] - new)
            )
            new = new[gap > APART]
        t = np.sort(np.concatenate([t, new]))
    return t


def _refined(t: Floats, timeline: Timeline, slack: Floats) -> Floats:
    """Times with as many added as keep each chord within the slack of its piece."""
    for _ in range(_SHARPER):
        far = _strays(t, timeline, slack) & (np.diff(t) > 4.0 * APART)
        if not far.any():
            break
        _refuse_more_than_most(len(t) + float(far.sum()))
        t = np.sort(np.concatenate([t, 0.5 * (t[:-1] + t[1:])[far]]))
    return t


def _strays(t: Floats, timeline: Timeline, slack: Floats) -> Bools:
    """Which chords may be farther from the curve than the slack of the piece they belong to."""
    piece, parameter, _ = timeline.at(t)
    owner = piece[1:]
    start = np.where(piece[:-1] == owner, parameter[:-1], 0.0)
    radius = bezier.hull_radius(_stretch(timeline.path.controls, owner, start, parameter[1:]))
    return np.asarray(radius > slack[owner])


def _stretch(controls: Floats, piece: Ints, start: Floats, end: Floats) -> Floats:
    """Control points of the stretch of each piece between two parameters, by blossoming."""
    own = controls[piece]
    return np.stack(
        [
            _blossom(own, start, start, start),
            _blossom(own, start, start, end),
            _blossom(own, start, end, end),
            _blossom(own, end, end, end),
        ],
        axis=1,
    )


def _blossom(controls: Floats, *parameters: Floats) -> Floats:
    """Polar form of each cubic piece at its three parameters, shape (n, 3)."""
    points = controls
    for parameter in parameters:
        t = parameter[:, None, None]
        points = (1.0 - t) * points[:, :-1] + t * points[:, 1:]
    return np.asarray(points[:, 0])


def _rows(t: Floats, xyz: Floats, yaw_deg: Floats, pitch_deg: Floats, piece: Ints) -> Floats:
    """Rows, rounded, with yaw in (-180, 180]."""
    count = len(t)
    rows: Floats = np.column_stack(
        [t, xyz[:count], yaw_deg[:count], pitch_deg[:count], piece[:count]]
    ).astype(np.float64)
    rows[:, 0] = np.round(rows[:, 0], TIME_DECIMALS)
    rows[:, 1:] = np.round(rows[:, 1:], ROW_DECIMALS) + 0.0  # -0.0 becomes 0.0
    rows[rows[:, 4] <= -180.0, 4] = 180.0
    return rows


def _refuse_more_than_most(rows: float) -> None:
    if not rows < MOST_ROWS:
        raise PlannerError(
            f"the flight would have {rows:.3g} rows, more than {MOST_ROWS:,}; raise flight.speed, "
            "or lower scale.d_min and scale.gsd, or set scene.unit if the unit is wrong"
        )
