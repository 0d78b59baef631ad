"""Smooth a polyline of proven edges into proven pieces."""

import numpy as np

from planner.airspace.space import Space
from planner.config import FlightSettings
from planner.flight.certificate import Certificate, prove
from planner.flight.path import CONTROL_DECIMALS, JOINT_DECIMALS
from planner.flight.smooth import corner, departure, polyline
from planner.geometry.arrays import Floats

SHRINK = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
"""Shares of the full handle, or of the full corner cut, that are tried in turn."""

PUSH = (0.0, 0.05, 0.15, 0.4)
"""How far a corner that cannot be rounded is moved out of its bend in turn, in ``d_min``."""


def smooth_way(
    points: Floats,
    leaving: Floats,
    arriving: Floats,
    airspace: Space,
    *,
    settings: FlightSettings,
) -> tuple[Floats, Certificate] | None:
    """Certified pieces along a polyline, its corners rounded as far as the proof allows.

    The corners of a short way touch what it leads around, and rounding cuts them: so they are
    moved out of their bend until they can be rounded. A corner that still cannot stays sharp, an
    end that cannot take up the tangent of its viewpoint starts straight; the aircraft stops and
    turns there.

    Parameters
    ----------
    points
        Corners, shape (n, 3), n >= 2, metres.
    leaving, arriving
        Unit tangents at the two viewpoints, shape (3,).
    airspace
        Solids and zones.
    settings
        Handle and margin.

    Returns
    -------
    pieces
        Control points (m, 4, 3) and their certificate, or ``None`` if not even the straight
        edges can be proven.

    """
    margin = settings.margin
    nodes = _distinct(points)
    inward, out, sharp = _inward(nodes), np.zeros(len(nodes)), np.zeros(len(nodes), dtype=np.bool_)
    best: tuple[Floats, Certificate] | None = None
    fewest = len(nodes)
    for push in PUSH:
        out = np.where(sharp, push * airspace.d_min, out)
        corners = np.round(nodes - out[:, None] * inward, CONTROL_DECIMALS)
        cuts = _corner_cuts(corners, airspace, margin)
        sharp = cuts == 0.0
        sharp[[0, -1]] = False
        pieces = _with_ends(_chain(corners, cuts), leaving, arriving, airspace, settings)
        certificate = prove(pieces, airspace, margin)
        if certificate.safe.all() and sharp.sum() < fewest:
            best, fewest = (pieces, certificate), int(sharp.sum())
        if fewest == 0:
            break
    if best is not None:
        return best
    pieces = np.round(polyline(nodes), CONTROL_DECIMALS)
    certificate = prove(pieces, airspace, margin)
    return (pieces, certificate) if certificate.safe.all() else None


def _inward(nodes: Floats) -> Floats:
    """Unit direction into the bend at each inner node, shape (n, 3); zero at the ends."""
    sides = np.diff(nodes, axis=0)
    along = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    bend = np.zeros_like(nodes)
    bend[1:-1] = along[1:] - along[:-1]
    size = np.linalg.norm(bend, axis=1, keepdims=True)
    return np.asarray(bend / np.where(size > 0.0, size, 1.0))


def _with_ends(
    chain: Floats, leaving: Floats, arriving: Floats, airspace: Space, settings: FlightSettings
) -> Floats:
    """Chain whose first and last piece take up the viewpoints' tangents where that is safe."""
    if len(chain) < 2:
        return chain
    result = chain.copy()
    for row, tangent, backwards in ((0, leaving, False), (-1, arriving, True)):
        handles = settings.handle * np.array(SHRINK)
        trials = np.stack([departure(chain[row], tangent, h, backwards=backwards) for h in handles])
        trials = np.round(trials, CONTROL_DECIMALS)
        safe = prove(trials, airspace, settings.margin).safe
        if safe.any():
            result[row] = trials[int(safe.argmax())]
    return result


def _corner_cuts(nodes: Floats, airspace: Space, margin: float) -> Floats:
    """How far from each inner node its corner is cut off, shape (n,), 0 where it stays sharp."""
    sides = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    widest = np.zeros(len(nodes))
    widest[1:-1] = 0.5 * np.minimum(sides[:-1], sides[1:])
    cuts = np.zeros(len(nodes))
    for share in SHRINK:
        rows = np.flatnonzero((cuts == 0.0) & (widest > 0.0)).tolist()
        if not rows:
            break
        trial = np.stack([_corner(nodes, row, share * widest[row]) for row in rows])
        safe = prove(np.round(trial, CONTROL_DECIMALS), airspace, margin).safe
        for row in np.array(rows)[safe].tolist():
            cuts[row] = share * widest[row]
    return cuts


def _chain(nodes: Floats, cuts: Floats) -> Floats:
    """Straight pieces and rounded corners in turn, sharing their rounded ends exactly."""
    pieces, at = [], nodes[0]
    for row in range(1, len(nodes)):
        bend = None
        if cuts[row] > 0.0:
            bend = np.round(_corner(nodes, row, cuts[row]), CONTROL_DECIMALS)
        target = nodes[row] if bend is None else bend[0]
        if bend is not None and np.linalg.norm(target - at) < 10.0**-JOINT_DECIMALS:
            bend[0] = target = at  # two bends meet in the middle of a side
        if np.linalg.norm(target - at) > 0.0:
            pieces.append(np.round(polyline(np.stack([at, target])), CONTROL_DECIMALS)[0])
        if bend is not None:
            pieces.append(bend)
        at = pieces[-1][3]
    return np.stack(pieces)


def _corner(nodes: Floats, row: int, cut: float) -> Floats:
    return corner(nodes[row - 1], nodes[row], nodes[row + 1], cut)


def _distinct(points: Floats) -> Floats:
    """Rounded corners without repeated ones; first and last stay."""
    nodes = np.round(points, CONTROL_DECIMALS)
    moved = np.linalg.norm(np.diff(nodes, axis=0), axis=1) > 10.0**-JOINT_DECIMALS
    kept = nodes[np.concatenate([[True], moved])]
    kept[-1] = nodes[-1]
    return kept if len(kept) > 1 else nodes[[0, -1]]
