"""Fit proven, smooth pieces to the corners of all legs."""

from dataclasses import dataclass

import numpy as np

from planner.airspace.space import Space
from planner.config import FlightSettings
from planner.flight.certificate import prove
from planner.flight.handles import piece_seconds
from planner.flight.path import CONTROL_DECIMALS, end_tangents
from planner.flight.rounding import smooth_way
from planner.flight.smooth import arcs, tangents, turned_along
from planner.geometry import bezier
from planner.geometry.arrays import Floats, Ints

SWING = 0.5
"""How far a piece swings out along a tangent, as a share of the handle, or a little more."""

HANDLES = (1.0, 0.75, 0.5, 0.375)
"""Shares of the longest handle that are tried first: the one that is flown soonest leads."""

SHORT = (0.25, 0.125, 0.0625, 0.03125)
"""Shares that are tried where none of those is safe: they bend hard at their ends."""

STRAIGHT = 1e-3
"""Turns smaller than this many radians are none."""


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """Proven pieces from one viewpoint to the next.

    Parameters
    ----------
    controls
        Shape (m, 4, 3), metres.
    clearance, zone_margin
        Proven lower bounds, shape (m,), metres.
    repaired
        Whether it leads around something.

    """

    controls: Floats
    clearance: Floats
    zone_margin: Floats
    repaired: bool


@dataclass(frozen=True, slots=True)
class Fitter:
    """Fits curves in one airspace.

    Parameters
    ----------
    airspace
        Solids and zones.
    settings
        Handles and margin.

    """

    airspace: Space
    settings: FlightSettings

    def fit(self, guides: list[Floats], *, closed: bool) -> list[Leg | None]:
        """Smooth legs, end to end.

        Parameters
        ----------
        guides
            Corners of each leg, shape (n, 3), n >= 2: two where it is straight, more where it leads
            around something. Each starts where the one before ends.
        closed
            Whether the last ends where the first starts.

        Returns
        -------
        legs
            One a guide; ``None`` where not even its straight edges can be proven.

        """
        if not guides:
            return []
        lines = self._tangents(guides, closed=closed)
        found = self._legs(guides, lines[:-1], lines[1:])
        for k in range(0 if closed else 1, len(guides)):
            self._turn(k, guides, lines, found)
        return found

    def _legs(self, guides: list[Floats], leaving: Floats, arriving: Floats) -> list[Leg | None]:
        """Legs with these tangents at their ends, or as near to them as the proof allows."""
        found: list[Leg | None] = [None] * len(guides)
        direct = [k for k, guide in enumerate(guides) if len(guide) == 2]
        ends = np.array([guides[k] for k in direct]).reshape(-1, 2, 3)
        trials = self._by_time(ends, leaving[direct], arriving[direct])
        for trial in trials:
            rows = [row for row, k in enumerate(direct) if found[k] is None]
            if not rows:
                break
            for row, leg in zip(rows, self._proven(trial[rows]), strict=True):
                found[direct[row]] = leg
        for k, guide in enumerate(guides):
            if len(guide) > 2:
                found[k] = self._around(guide, leaving[k], arriving[k])
        return found

    def _by_time(self, ends: Floats, leaving: Floats, arriving: Floats) -> Floats:
        """Curves to try for legs from place to place, (legs, 2, 3), shape (trials, legs, 4, 3).

        For each leg the soonest flown comes first, and its chord last.
        """
        shares = self.settings.handle * np.array(HANDLES + SHORT)
        trials = np.stack([arcs(ends[:, 0], ends[:, 1], leaving, arriving, h) for h in shares])
        smooth, hard = np.split(trials, [len(HANDLES)])
        order = piece_seconds(smooth, self.settings).argsort(axis=0, kind="stable")
        smooth = np.take_along_axis(smooth, order[:, :, None, None], axis=0)
        chords = bezier.straight(ends[:, 0], ends[:, 1])
        return np.concatenate([smooth, hard, chords[None]])

    def _around(self, guide: Floats, leaving: Floats, arriving: Floats) -> Leg | None:
        smooth = smooth_way(guide, leaving, arriving, self.airspace, settings=self.settings)
        if smooth is None:
            return None
        controls, proof = smooth
        return Leg(controls, proof.clearance, proof.zone_margin, True)

    def _proven(self, controls: Floats) -> list[Leg | None]:
        """One leg a piece, rounded before it is proven; ``None`` where it is not safe."""
        rounded = np.round(controls, CONTROL_DECIMALS)
        proof = prove(rounded, self.airspace, self.settings.margin)
        return [
            Leg(rounded[k : k + 1], proof.clearance[k : k + 1], proof.zone_margin[k : k + 1], False)
            if proof.safe[k]
            else None
            for k in range(len(rounded))
        ]

    def _turn(self, k: int, guides: list[Floats], lines: Floats, found: list[Leg | None]) -> None:
        """Try other tangents at viewpoint ``k`` if the legs that meet there make a corner.

        A leg around something may have no room to turn near its viewpoint, while the leg on the
        other side has: so the straight ends of both are tried as the tangent of both.
        """
        pair = [k - 1, k] if k else [len(guides) - 1, 0]
        before, after = (found[row] for row in pair)
        if before is None or after is None or _corner(before, after) < STRAIGHT:
            return
        into, out = guides[pair[0]], guides[pair[1]]
        starts = lines[[pair[0], k]]
        stops = lines[[pair[0] + 1, pair[1] + 1]]
        for line in (out[1] - out[0], into[-1] - into[-2]):
            if not line.any():
                continue
            starts[1] = stops[0] = line / np.linalg.norm(line)
            first, second = self._legs([into, out], starts, stops)
            if first is None or second is None or _corner(first, second) >= STRAIGHT:
                continue
            if _takes(first, starts[0], 0) and _takes(second, stops[1], 1):
                found[pair[0]], found[pair[1]] = first, second
                lines[k] = starts[1]
                if k == 0:
                    lines[-1] = starts[1]
                return

    def _tangents(self, guides: list[Floats], *, closed: bool) -> Floats:
        """Unit tangent at each viewpoint, from the corners of all legs, shape (legs + 1, 3)."""
        corners = np.concatenate([guides[0][:1], *(guide[1:] for guide in guides)])
        at: Ints = np.cumsum([0, *(len(guide) - 1 for guide in guides)])
        if closed:
            corners, at[-1] = corners[:-1], 0
        reach = _reach(guides, closed=closed) * SWING * self.settings.handle
        return self._along_limits(tangents(corners, closed=closed)[at], corners[at], reach)

    def _along_limits(self, lines: Floats, spots: Floats, reach: Floats) -> Floats:
        """Turn tangents along what is nearer than curves reach, shape (K,), metres."""
        room = self._room(spots)
        near = np.flatnonzero(
            (room < reach) & (reach > 0.0)
        )  # nothing bends at a place without sides
        if len(near):
            away = self._uphill(spots[near])
            lines[near] = turned_along(lines[near], away, room[near].clip(0.0) / reach[near])
        return lines

    def _room(self, points: Floats) -> Floats:
        """Distance that is left to solids, zones and bounds, shape (n,), metres."""
        low, high = self.airspace.bounds
        solids = self.airspace.clearance(points) - self.airspace.d_min
        zones = self.airspace.zone_margin(points)
        inside = np.minimum(points - low, high - points).min(axis=1)
        return np.asarray(np.minimum(np.minimum(solids, zones) - self.settings.margin, inside))

    def _uphill(self, spots: Floats) -> Floats:
        """Direction in which there is more room, by central differences; zero where it has none."""
        step = 0.02 * self.airspace.d_min * np.eye(3)
        around = np.concatenate([spots[:, None] + step, spots[:, None] - step], axis=1)
        values = self._room(around.reshape(-1, 3)).reshape(-1, 2, 3)
        slope = np.nan_to_num(values[:, 0] - values[:, 1], posinf=0.0, neginf=0.0)
        size = np.linalg.norm(slope, axis=1, keepdims=True)
        return np.asarray(slope / np.where(size > 0.0, size, 1.0))


def _corner(before: Leg, after: Leg) -> float:
    """Turn on the spot between two legs, as the chord of the unit circle; 0 if one is a point."""
    last, first = end_tangents(before.controls[-1:])[0, 1], end_tangents(after.controls[:1])[0, 0]
    return float(np.linalg.norm(last - first)) if last.any() and first.any() else 0.0


def _takes(leg: Leg, line: Floats, end: int) -> bool:
    """Whether a leg has this tangent at its start (0) or at its end (1)."""
    own = end_tangents(leg.controls[[-end]])[0, end]
    return bool(np.linalg.norm(own - line) < STRAIGHT)


def _reach(guides: list[Floats], *, closed: bool) -> Floats:
    """Length of the longer of the two straight sides at each viewpoint, shape (legs + 1,)."""
    first = [np.linalg.norm(guide[1] - guide[0]) for guide in guides]
    last = [np.linalg.norm(guide[-1] - guide[-2]) for guide in guides]
    reach = np.maximum(np.append(first, 0.0), np.append(0.0, last))
    if closed:
        reach[[0, -1]] = max(reach[0], reach[-1])
    return np.asarray(reach)
