"""Smooth curves through points: tangents, handles, and rounded corners."""

import numpy as np

from planner.geometry import bezier
from planner.geometry.arrays import Floats


def tangents(points: Floats, *, closed: bool = False) -> Floats:
    """Unit tangent of a smooth curve at each of the points it passes.

    The direction of the parabola through a point and its two neighbours, with chord lengths as
    parameter: it leans towards the shorter chord, so that the curve does not swing out. Ends of
    an open curve look along their chord. Where the way turns straight back, the tangent is level
    and across.

    Parameters
    ----------
    points
        Shape (K, 3), metres.
    closed
        Whether the last point is followed by the first.

    Returns
    -------
    tangents
        Unit vectors, shape (K, 3).

    """
    count = len(points)
    result = np.zeros((count, 3))
    for k in range(count):  # few, and each may have to look past points that coincide
        before, after = _neighbour(points, k, -1, closed), _neighbour(points, k, 1, closed)
        result[k] = _tangent(points[k] - before, after - points[k])
    return result


def turned_along(lines: Floats, away: Floats, room: Floats) -> Floats:
    """Tangents turned until they point no farther towards or away from what is near.

    A curve that passes a point close to a wall must pass it along the wall.

    Parameters
    ----------
    lines
        Unit tangents, shape (K, 3).
    away
        Unit directions away from the nearest solid, shape (K, 3).
    room
        Largest share of each tangent along ``away`` that there is room for, shape (K,), from 0.

    Returns
    -------
    tangents
        Unit vectors, shape (K, 3); as they were where there is room, or where a tangent points
        so straight at the solid that turning it has no direction.

    """
    towards = (lines * away).sum(axis=1)
    level = lines - towards[:, None] * away
    flat = np.linalg.norm(level, axis=1)
    kept = towards.clip(-room, room)
    possible = (flat > 0.1) & (np.abs(towards) > room)
    scale = np.sqrt(1.0 - np.minimum(kept, 1.0) ** 2) / np.where(flat > 0.0, flat, 1.0)
    turned = scale[:, None] * level + kept[:, None] * away
    return np.where(possible[:, None], turned, lines)


def arcs(starts: Floats, ends: Floats, leaving: Floats, arriving: Floats, share: Floats) -> Floats:
    """One piece a leg, with the given directions at its ends.

    Parameters
    ----------
    starts, ends
        Shape (L, 3), metres.
    leaving, arriving
        Unit tangents there, shape (L, 3).
    share
        Length of both handles as a share of the chord, shape (L,) or one number.

    Returns
    -------
    controls
        Shape (L, 4, 3).

    """
    handle = np.asarray(share) * np.linalg.norm(ends - starts, axis=1)
    reach = handle[:, None]
    return np.stack([starts, starts + reach * leaving, ends - reach * arriving, ends], axis=1)


def corner(before: Floats, at: Floats, after: Floats, cut: float) -> Floats:
    """Piece that rounds a corner, starting and ending ``cut`` metres from it on its two sides.

    Its control points lie on the two sides, so that it meets them tangentially and stays inside
    the triangle that it cuts off.

    Parameters
    ----------
    before, at, after
        Points of the polyline, each (3,); ``at`` is the corner.
    cut
        Metres, at most the length of the shorter side.

    Returns
    -------
    controls
        Shape (4, 3).

    """
    first = at + cut * _unit(before - at)
    last = at + cut * _unit(after - at)
    return np.stack([first, first + (at - first) * 2.0 / 3.0, last + (at - last) * 2.0 / 3.0, last])


def departure(piece: Floats, tangent: Floats, share: float, *, backwards: bool) -> Floats:
    """Straight piece whose one end takes up another direction.

    Parameters
    ----------
    piece
        Control points, shape (4, 3).
    tangent
        Unit tangent at its start, or at its end if ``backwards``.
    share
        Length of both handles as a share of the chord.
    backwards
        Which end it is.

    Returns
    -------
    controls
        Shape (4, 3); the other end keeps its direction.

    """
    start, end = piece[0], piece[3]
    along = end - start
    reach = float(share * np.linalg.norm(along))
    first = share * along if backwards else reach * tangent
    last = reach * tangent if backwards else share * along
    return np.stack([start, start + first, end - last, end])


def polyline(points: Floats) -> Floats:
    """Straight pieces from point to point, shape (n - 1, 4, 3)."""
    return bezier.straight(points[:-1], points[1:])


def _neighbour(points: Floats, k: int, step: int, closed: bool) -> Floats:
    """Next point that lies elsewhere, or the point itself if there is none."""
    count, row = len(points), k
    for _ in range(count - 1):
        row += step
        if not closed and not 0 <= row < count:
            break
        other = points[row % count]
        if np.linalg.norm(other - points[k]) > 0.0:
            return np.asarray(other)
    return np.asarray(points[k])


def _tangent(incoming: Floats, outgoing: Floats) -> Floats:
    """Direction at a point from the chords that lead to it and away."""
    before, after = float(np.linalg.norm(incoming)), float(np.linalg.norm(outgoing))
    if before == 0.0 and after == 0.0:
        return np.array([1.0, 0.0, 0.0])
    if before == 0.0 or after == 0.0:
        return _unit(incoming + outgoing)
    lean = after * incoming / before + before * outgoing / after
    if np.linalg.norm(lean) > 1e-3 * (before + after):
        return _unit(lean)
    across = np.array([-incoming[1], incoming[0], 0.0])
    return _unit(across) if np.linalg.norm(across) > 1e-6 * before else np.array([1.0, 0.0, 0.0])


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
