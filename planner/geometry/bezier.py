"""Cubic Bezier pieces, many at a time: points, halves, hulls and arc length."""

import numpy as np

from planner.geometry.arrays import Floats, Ints

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS  # on [0, 1]

INTERVALS = 32
"""Equal parameter intervals of a piece in which arc length is integrated."""


def evaluate(controls: Floats, parameter: Floats) -> Floats:
    """Point of each piece at its own parameter.

    Parameters
    ----------
    controls
        Control points, shape (..., 4, 3), metres.
    parameter
        Values in [0, 1], shape (...).

    Returns
    -------
    points
        Shape (..., 3), metres; at 0 and 1 exactly the first and the last control point.

    """
    t = np.asarray(parameter)[..., None]
    s = 1.0 - t
    first, second, third, last = np.moveaxis(controls, -2, 0)
    return np.asarray(
        s**3 * first + 3.0 * s * s * t * second + 3.0 * s * t * t * third + t**3 * last
    )


def derivative(controls: Floats, parameter: Floats) -> Floats:
    """Change of the point with the parameter; shapes as :func:`evaluate`."""
    t = np.asarray(parameter)[..., None]
    s = 1.0 - t
    start, middle, end = np.moveaxis(3.0 * np.diff(controls, axis=-2), -2, 0)
    return np.asarray(s * s * start + 2.0 * s * t * middle + t * t * end)


def split(controls: Floats) -> tuple[Floats, Floats]:
    """Two halves of each piece at parameter one half, by de Casteljau.

    Parameters
    ----------
    controls
        Shape (..., 4, 3).

    Returns
    -------
    left, right
        Control points of the halves, each (..., 4, 3). They share the middle point exactly.

    """
    a, b, c, d = np.moveaxis(controls, -2, 0)
    ab, bc, cd = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d)
    abc, bcd = 0.5 * (ab + bc), 0.5 * (bc + cd)
    middle = 0.5 * (abc + bcd)
    return np.stack([a, ab, abc, middle], axis=-2), np.stack([middle, bcd, cd, d], axis=-2)


def hull_radius(controls: Floats) -> Floats:
    """Distance from the chord within which each whole piece lies.

    A piece lies in the convex hull of its control points; the points within some radius of
    a segment are convex too; so the largest distance of a control point from the chord bounds
    that of every point of the curve.

    Parameters
    ----------
    controls
        Shape (..., 4, 3), metres.

    Returns
    -------
    radius
        Shape (...), metres, at least 0.

    """
    start, end = controls[..., :1, :], controls[..., 3:, :]
    chord = end - start
    inner = controls[..., 1:3, :] - start
    square = (chord * chord).sum(axis=-1)
    along = (inner * chord).sum(axis=-1) / np.where(square > 0.0, square, 1.0)
    nearest = along.clip(0.0, 1.0)[..., None] * chord
    return np.asarray(np.linalg.norm(inner - nearest, axis=-1).max(axis=-1))


def polygon_length(controls: Floats) -> Floats:
    """Length of each control polygon, shape (...): at least the piece's own length."""
    return np.asarray(np.linalg.norm(np.diff(controls, axis=-2), axis=-1).sum(axis=-1))


def straight(start: Floats, end: Floats) -> Floats:
    """Pieces that run straight and evenly from each start to each end.

    Parameters
    ----------
    start, end
        Shape (..., 3).

    Returns
    -------
    controls
        Shape (..., 4, 3).

    """
    share = np.arange(4)[:, None] / 3.0
    return start[..., None, :] * (1.0 - share) + end[..., None, :] * share


def length_table(controls: Floats) -> Floats:
    """Arc length from the start of each piece to the ends of its equal parameter intervals.

    Gauss-Legendre with 8 nodes in each of :data:`INTERVALS` intervals.

    Parameters
    ----------
    controls
        Shape (M, 4, 3), metres.

    Returns
    -------
    table
        Shape (M, INTERVALS + 1), metres, from 0 to the piece's length, never falling.

    """
    left = np.arange(INTERVALS) / INTERVALS
    at = left[:, None] + _NODES / INTERVALS  # (I, G)
    rate = np.linalg.norm(derivative(controls[:, None, None], at[None]), axis=-1)  # (M, I, G)
    part = rate @ _WEIGHTS / INTERVALS
    return np.concatenate([np.zeros((len(controls), 1)), np.cumsum(part, axis=1)], axis=1)


def lengths(controls: Floats) -> Floats:
    """Arc length of each piece, shape (M,), metres."""
    return length_table(controls)[:, -1]


def parameter_at(controls: Floats, piece: Ints, distance: Floats) -> Floats:
    """Parameter at which a piece has run so far.

    The interval comes from :func:`length_table`, the place in it from a fixed number of
    Newton steps that fall back to bisection; nothing in it is random or adaptive, so that
    the same controls give the same numbers again.

    Parameters
    ----------
    controls
        Shape (M, 4, 3), metres.
    piece
        Piece of each query, shape (n,).
    distance
        Arc length from that piece's start, metres, shape (n,); clipped to the piece.

    Returns
    -------
    parameter
        Shape (n,), in [0, 1].

    """
    table = length_table(controls)[piece]  # (n, I + 1)
    goal = np.clip(distance, 0.0, table[:, -1])
    interval = (table[:, 1:] < goal[:, None]).sum(axis=1).clip(0, INTERVALS - 1)
    rows = np.arange(len(goal))
    left = interval / INTERVALS
    wanted = goal - table[rows, interval]
    whole = table[rows, interval + 1] - table[rows, interval]
    low, high = left, left + 1.0 / INTERVALS
    at = left + np.where(whole > 0.0, wanted / np.where(whole > 0.0, whole, 1.0), 0.0) / INTERVALS
    own = controls[piece]
    for _ in range(12):
        span = at - left
        nodes = left[:, None] + _NODES * span[:, None]  # (n, G)
        run = np.linalg.norm(derivative(own[:, None], nodes), axis=-1) @ _WEIGHTS * span
        excess = run - wanted
        low, high = np.where(excess < 0.0, at, low), np.where(excess < 0.0, high, at)
        rate = np.linalg.norm(derivative(own, at), axis=-1)
        newton = at - excess / np.where(rate > 0.0, rate, 1.0)
        inside = (rate > 0.0) & (low <= newton) & (newton <= high)
        at = np.where(inside, newton, 0.5 * (low + high))
    return np.asarray(at.clip(0.0, 1.0))
