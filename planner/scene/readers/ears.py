"""Triangulation of a plane polygon by clipping ears, holes joined to the rim by bridges.

The method is Meisters' two-ears theorem put to work (doi:10.2307/2319703).
"""

import numpy as np

from planner.geometry.arrays import Bools, Floats


def clip_ears(xy: Floats, loop: list[int]) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon that turns left.

    Parameters
    ----------
    xy
        Points, shape (N, 2).
    loop
        Rows of ``xy`` around the polygon; a row may occur twice, at the ends of a bridge.

    Returns
    -------
    triangles
        Rows of ``xy``, each turning left. A polygon that crosses itself is still used up, with
        triangles that may overlap.

    """
    loop = list(loop)
    found: list[tuple[int, int, int]] = []
    at = misses = 0
    while len(loop) > 3:
        count = len(loop)
        at %= count
        before, here, after = loop[at - 1], loop[at], loop[(at + 1) % count]
        turn = _turn(xy[before], xy[here], xy[after])
        if turn == 0.0 or misses > count or (turn > 0.0 and _is_ear(xy, loop, at)):
            if turn > 0.0:
                found.append((before, here, after))
            del loop[at]
            at, misses = at - 1 if misses == 0 else at, 0
        else:
            at, misses = at + 1, misses + 1
    if len(loop) == 3 and _turn(*xy[loop]) > 0.0:
        found.append((loop[0], loop[1], loop[2]))
    return found


def join_holes(xy: Floats, loops: list[list[int]]) -> list[int]:
    """One loop out of an outer ring and its holes.

    Parameters
    ----------
    xy
        Points, shape (N, 2).
    loops
        Rows of ``xy`` of the outer ring, which turns left, and of the holes, which may turn
        either way.

    Returns
    -------
    loop
        The outer ring with a bridge to each hole and back, walked the other way round.

    """
    joined = list(loops[0])
    waiting = [hole if _area(xy[hole]) < 0.0 else hole[::-1] for hole in loops[1:] if len(hole) > 2]
    while waiting:
        near = [_closest_pairs(xy, joined, hole)[0][0] for hole in waiting]
        hole = waiting.pop(int(np.argmin(near)))
        i, j = _bridge(xy, joined, hole, waiting)
        joined = joined[: i + 1] + hole[j:] + hole[: j + 1] + joined[i:]
    return joined


def _bridge(
    xy: Floats, joined: list[int], hole: list[int], others: list[list[int]]
) -> tuple[int, int]:
    """Closest places in the loop and in the hole that see each other."""
    edges = [
        np.stack([xy[ring], np.roll(xy[ring], -1, axis=0)], axis=1)
        for ring in (joined, hole, *others)
    ]
    fence = np.concatenate(edges)
    pairs = _closest_pairs(xy, joined, hole)
    for _, i, j in pairs:
        a, b = xy[joined[i]], xy[hole[j]]
        if not _crosses(a, b, fence).any() and _inside(xy, joined, i, b):
            return i, j
    return pairs[0][1], pairs[0][2]


def _closest_pairs(xy: Floats, joined: list[int], hole: list[int]) -> list[tuple[float, int, int]]:
    """Squared distance and places of pairs of corners, the closest 200 first."""
    off = ((xy[joined][:, None] - xy[hole][None, :]) ** 2).sum(axis=2)
    order = np.argsort(off, axis=None, kind="stable")[:200]
    i, j = np.unravel_index(order, off.shape)
    return list(zip(off[i, j].tolist(), i.tolist(), j.tolist(), strict=True))


def _inside(xy: Floats, loop: list[int], i: int, target: Floats) -> bool:
    """Whether the way from corner ``i`` to ``target`` starts within the polygon's angle there."""
    before, here = xy[loop[i - 1]], xy[loop[i]]
    after = xy[loop[(i + 1) % len(loop)]]
    left_in = _turn(before, here, target) > 0.0
    left_out = _turn(here, after, target) > 0.0
    if _turn(before, here, after) >= 0.0:
        return left_in and left_out
    return left_in or left_out


def _crosses(a: Floats, b: Floats, edges: Floats) -> Bools:
    """Which edges, shape (E, 2, 2), cross the segment ab other than at a shared end."""
    p, q = edges[:, 0], edges[:, 1]
    shared = _same(p, a) | _same(p, b) | _same(q, a) | _same(q, b)
    side_p, side_q = _turns(a, b, p), _turns(a, b, q)
    side_a, side_b = _turns(p, q, a), _turns(p, q, b)
    return np.asarray(~shared & (side_p * side_q <= 0.0) & (side_a * side_b <= 0.0))


def _is_ear(xy: Floats, loop: list[int], at: int) -> bool:
    """Whether no other corner lies in the triangle that a corner makes with its neighbours."""
    a, b, c = xy[loop[at - 1]], xy[loop[at]], xy[loop[(at + 1) % len(loop)]]
    points = xy[loop]
    corner = _same(points, a) | _same(points, b) | _same(points, c)
    within = (_turns(a, b, points) >= 0.0) & (_turns(b, c, points) >= 0.0)
    within &= _turns(c, a, points) >= 0.0
    return not (within & ~corner).any()


def _same(points: Floats, point: Floats) -> Bools:
    return np.asarray((points == point).all(axis=1))


def _turns(a: Floats, b: Floats, c: Floats) -> Floats:
    """Twice the signed areas of triangles abc, each (2,) or (M, 2); positive turns left."""
    u, v = b - a, c - a
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float(_turns(a, b, c))


def _area(ring: Floats) -> float:
    """Twice the signed area of a ring, shape (K, 2)."""
    after = np.roll(ring, -1, axis=0)
    return float((ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum())
