"""Proof that whole Bezier pieces keep their distance, not only points of them.

A piece is cut in halves until each part is proven. A part is proven in one of two ways.

* Clearance changes by at most a metre a metre. So along a curve no longer than its control
  polygon ``L`` with clearances ``c0`` and ``c1`` at its ends it is at least ``(c0 + c1 - L) / 2``.
* The part lies in the capsule around its chord whose radius is the largest distance of a
  control point from the chord. If no solid touches that capsule grown by ``r``, every point of
  the part is at least ``r`` away from solids; and as the ends are outside of solids by the sign
  of their clearance, and no surface lies between, the whole part is.

Zones are kept in the same two ways, and the bounds of the space that is known because a curve
stays in the convex hull of its control points.

What is proven is the larger of the wanted distance and the smallest clearance seen so far on the
piece less a tolerance, so that the bound is tight as well as true. A point too close refutes the
piece at once. Parts still open at the last depth are refused: the proof fails closed.
"""

from dataclasses import dataclass

import numpy as np

from planner.airspace.space import Space
from planner.geometry import bezier
from planner.geometry.arrays import Bools, Floats, Ints

DEPTH = 11
"""Halvings after which a part that is still not proven is refused."""

TOLERANCE = 0.04
"""Wanted tightness of the proven bound, as a share of the wanted distance."""


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """What is proven about each of M pieces.

    Parameters
    ----------
    safe
        Whether clearance is at least the wanted distance, no zone is touched and the bounds are
        kept, shape (M,).
    clearance
        Proven lower bound of the clearance, metres, shape (M,); minus infinity where not safe.
    zone_margin
        Proven lower bound of the zone margin, metres, shape (M,); minus infinity where not safe.
    seen
        Smallest clearance that was met at any point of the piece, metres, shape (M,).
    where
        That point, shape (M, 3).

    """

    safe: Bools
    clearance: Floats
    zone_margin: Floats
    seen: Floats
    where: Floats


def certify(
    controls: Floats,
    airspace: Space,
    *,
    required: float | None = None,
    zone_required: float = 0.0,
    tolerance: float | None = None,
) -> Certificate:
    """Prove lower bounds of clearance and zone margin along each whole piece.

    Parameters
    ----------
    controls
        Shape (M, 4, 3), metres.
    airspace
        Solids and zones.
    required
        Distance to solids that makes a piece safe, metres; the airspace's ``d_min`` by default.
    zone_required
        The same for zones, metres.
    tolerance
        How far a bound may lie under the smallest value seen, metres; by default
        :data:`TOLERANCE` of ``required``.

    Returns
    -------
    certificate
        One row a piece.

    """
    wanted = airspace.d_min if required is None else required
    slack = TOLERANCE * wanted if tolerance is None else tolerance
    proof = _Proof(controls, airspace, wanted, zone_required, slack)
    parts = proof.first_parts()
    for _ in range(DEPTH):
        parts = proof.split(proof.leave_open(parts))
        if not len(parts.owner):
            break
    proof.refuse(proof.leave_open(parts))
    return proof.certificate()


def prove(controls: Floats, airspace: Space, margin: float) -> Certificate:
    """Certificate of pieces for half of ``margin`` metres beyond ``d_min``, and as much to zones.

    Places and edges are chosen with the whole margin: the other half is what rounding their
    coordinates may cost, without which the proof of an edge that just touches would fail.
    """
    half = 0.5 * margin
    return certify(controls, airspace, required=airspace.d_min + half, zone_required=half)


@dataclass(frozen=True, slots=True, eq=False)
class _Parts:
    """Parts of pieces that are still open: ``owner`` is the piece, ``ends`` the values there."""

    controls: Floats  # (n, 4, 3)
    owner: Ints  # (n,)
    clearance: Floats  # (n, 2)
    zones: Floats  # (n, 2)

    def take(self, rows: Bools) -> "_Parts":
        return _Parts(self.controls[rows], self.owner[rows], self.clearance[rows], self.zones[rows])


class _Proof:
    """Bounds of all pieces while their parts are worked off."""

    def __init__(
        self,
        controls: Floats,
        airspace: Space,
        required: float,
        zone_required: float,
        tolerance: float,
    ) -> None:
        count = len(controls)
        self.controls, self.airspace, self.tolerance = controls, airspace, tolerance
        self.required, self.zone_required = required, zone_required
        self.seen = np.full(count, np.inf)
        self.seen_zone = np.full(count, np.inf)
        self.where = controls[:, 0].copy()
        self.floor = np.full(count, np.inf)
        self.zone_floor = np.full(count, np.inf)
        self.safe: Bools = np.asarray(np.isfinite(controls).all(axis=(1, 2)))

    def first_parts(self) -> _Parts:
        """Halves of all pieces, whose ends have been looked at."""
        owner = np.flatnonzero(self.safe)
        whole = self.controls[owner]
        ends = zip(self._look(whole[:, 0], owner), self._look(whole[:, 3], owner), strict=True)
        clearance, zones = (np.stack(pair, axis=1) for pair in ends)
        return self.split(_Parts(whole, owner, clearance, zones))

    def split(self, parts: _Parts) -> _Parts:
        """Both halves of each part of a piece that is not refuted; looks at their joint."""
        parts = parts.take(self.safe[parts.owner])
        left, right = bezier.split(parts.controls)
        joint = self._look(left[:, 3], parts.owner)
        halves = []
        for ends, middle in zip((parts.clearance, parts.zones), joint, strict=True):
            first = np.stack([ends[:, 0], middle], axis=1)
            halves.append(np.concatenate([first, np.stack([middle, ends[:, 1]], axis=1)]))
        both = np.concatenate([left, right])
        return _Parts(both, np.tile(parts.owner, 2), halves[0], halves[1])

    def leave_open(self, parts: _Parts) -> _Parts:
        """Prove what can be proven now; return the other parts of pieces not refuted."""
        parts = parts.take(self.safe[parts.owner])
        polygon = bezier.polygon_length(parts.controls)
        solid = 0.5 * (parts.clearance.sum(axis=1) - polygon)
        zone = parts.zones.min(axis=1) - 0.5 * polygon
        goal, zone_goal = self._goals(parts.owner)
        proven, zone_proven = solid >= goal, zone >= zone_goal
        for row in np.flatnonzero(~(proven & zone_proven)).tolist():  # each is an exact sweep
            start, end = parts.controls[row, 0], parts.controls[row, 3]
            around = float(bezier.hull_radius(parts.controls[row]))
            if not zone_proven[row]:
                zone_proven[row] = self._zone_swept(start, end, zone_goal[row] + around)
                zone[row] = zone_goal[row]
            if zone_proven[row] and not proven[row]:
                proven[row] = self._swept(start, end, goal[row] + around)
                solid[row] = goal[row]
        done = proven & zone_proven & self._within(parts.controls).all(axis=1)
        np.minimum.at(self.floor, parts.owner[done], solid[done])
        np.minimum.at(self.zone_floor, parts.owner[done], zone[done])
        return parts.take(~done)

    def refuse(self, parts: _Parts) -> None:
        """Give up the pieces of these parts."""
        self.safe[parts.owner] = False

    def certificate(self) -> Certificate:
        """Result, with no bound for what is not safe."""
        return Certificate(
            safe=self.safe,
            clearance=np.where(self.safe, self.floor, -np.inf),
            zone_margin=np.where(self.safe, self.zone_floor, -np.inf),
            seen=self.seen,
            where=self.where,
        )

    def _goals(self, owner: Ints) -> tuple[Floats, Floats]:
        """What is to be proven of clearance and zone margin for the parts of these pieces."""
        solid = np.maximum(self.required, self.seen[owner] - self.tolerance)
        return solid, np.maximum(self.zone_required, self.seen_zone[owner] - self.tolerance)

    def _swept(self, start: Floats, end: Floats, radius: float) -> bool:
        return self.airspace.capsule_clearance_at_least(start, end, radius)

    def _zone_swept(self, start: Floats, end: Floats, margin: float) -> bool:
        return self.airspace.zone_margin_at_least(start, end, margin)

    def _within(self, points: Floats) -> Bools:
        """Which points, shape (..., 3), lie in the space that is known."""
        low, high = self.airspace.bounds
        return np.asarray(((points >= low) & (points <= high)).all(axis=-1))

    def _look(self, points: Floats, owner: Ints) -> tuple[Floats, Floats]:
        """Clearance and zone margin of points on the curve; refutes pieces by them."""
        if not len(points):
            return np.zeros(0), np.zeros(0)
        clearance, zones = self.airspace.clearance(points), self.airspace.zone_margin(points)
        order = np.argsort(-clearance, kind="stable")  # the least is written last
        less = clearance[order] < self.seen[owner[order]]
        self.where[owner[order[less]]] = points[order[less]]
        np.fmin.at(self.seen, owner, clearance)
        np.fmin.at(self.seen_zone, owner, zones)
        close = ~self._within(points) | ~(
            (clearance >= self.required) & (zones >= self.zone_required)
        )  # or no number
        self.safe[owner[close]] = False
        return clearance, zones
