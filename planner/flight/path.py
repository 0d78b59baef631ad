"""The curve that is flown, with what is proven about each of its pieces."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.geometry import bezier
from planner.geometry.arrays import Bools, Floats, Ints, read_only

JOINT_DECIMALS = 4
"""Viewpoints are flown through at positions rounded so, metres: to 0.1 mm."""

CONTROL_DECIMALS = 6
"""Control points are rounded so before they are certified: a file holds the very numbers."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightPath:
    """Cubic Bezier pieces, end to end, through the viewpoints in visiting order.

    Two pieces that meet share their point exactly, and their unit tangent except where a
    straight repaired piece makes the aircraft stop and turn (see :meth:`corners`). As the curve
    is flown at constant speed, a shared unit tangent is a continuous velocity.

    Parameters
    ----------
    controls
        Shape (M, 4, 3), metres, local frame.
    leg
        Leg of each piece, shape (M,), never falling; leg k starts at the k-th viewpoint.
    reached
        Viewpoint at the piece's end, shape (M,), or -1 within a leg.
    start
        Viewpoint at the start of the first piece; -1 if there is no viewpoint at all.
    repaired
        Whether a motion planner had to lead the leg around something, shape (M,).
    clearance
        Proven lower bound of the distance to solids along the piece, shape (M,), metres.
    zone_margin
        Proven lower bound of the distance to zones beyond what is kept from them, shape (M,),
        metres, infinite without any.

    Raises
    ------
    ValueError
        If pieces do not join or are numbered out of order.

    """

    controls: Floats
    leg: Ints
    reached: Ints
    start: int
    repaired: Bools
    clearance: Floats
    zone_margin: Floats

    def __post_init__(self) -> None:
        count = len(self.controls)
        set_ = object.__setattr__
        set_(self, "controls", read_only(self.controls, (None, 4, 3), name="controls"))
        for name, kind in (("leg", np.int64), ("reached", np.int64), ("repaired", np.bool_)):
            set_(self, name, read_only(getattr(self, name), (count,), name=name, dtype=kind))
        for name in ("clearance", "zone_margin"):
            set_(self, name, read_only(getattr(self, name), (count,), name=name))
        if not np.isfinite(self.controls).all():
            raise ValueError("controls must be finite.")
        torn = np.flatnonzero((self.controls[1:, 0] != self.controls[:-1, 3]).any(axis=1))
        if torn.size:
            raise ValueError(f"piece {torn[0] + 1} does not start where piece {torn[0]} ends.")
        ends = np.ones(count, dtype=np.bool_)
        ends[:-1] = self.leg[1:] != self.leg[:-1]
        if count and (self.leg[0] != 0 or not np.isin(np.diff(self.leg), (0, 1)).all()):
            raise ValueError(f"legs must count up from 0, got {self.leg.tolist()}.")
        if not np.array_equal(ends, self.reached >= 0):
            raise ValueError("a viewpoint must be reached at the end of each leg and only there.")
        if self.reached.min(initial=-1) < -1 or self.start < (0 if count else -1):
            raise ValueError(f"viewpoints count from 0, got {self.start} and {self.reached.min()}.")

    def __len__(self) -> int:
        return len(self.controls)

    @property
    def length(self) -> float:
        """Length of the whole curve, metres."""
        return float(bezier.lengths(self.controls).sum())

    def corners(self, angle: float = 1e-3) -> Ints:
        """Pieces that start with a turn on the spot of more than ``angle`` radians."""
        ends = end_tangents(self.controls)
        before, after = ends[:-1, 1], ends[1:, 0]
        turn = np.linalg.norm(after - before, axis=1) > angle  # chord of the unit circle
        moving = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1) > 0.0
        return np.flatnonzero(turn & moving) + 1

    def to_records(self) -> list[dict[str, Any]]:
        """One dict a piece, ready for JSON; an infinite margin becomes ``None``."""
        return [
            {
                "piece": piece,
                "leg": int(self.leg[piece]),
                "reached": int(self.reached[piece]),
                "repaired": bool(self.repaired[piece]),
                "clearance": float(self.clearance[piece]),
                "zone_margin": _finite(self.zone_margin[piece]),
                "controls": self.controls[piece].tolist(),
            }
            for piece in range(len(self))
        ]

    @classmethod
    def from_records(cls, records: list[dict[str, Any]], *, start: int) -> "FlightPath":
        """Path from :meth:`to_records`.

        Raises
        ------
        ValueError
            If a record lacks something, has a wrong shape, or the pieces do not join.

        """
        try:
            margins = [record["zone_margin"] for record in records]
            return cls(
                controls=np.array([record["controls"] for record in records]).reshape(-1, 4, 3),
                leg=np.array([record["leg"] for record in records], dtype=np.int64),
                reached=np.array([record["reached"] for record in records], dtype=np.int64),
                start=start,
                repaired=np.array([record["repaired"] for record in records], dtype=np.bool_),
                clearance=np.array([record["clearance"] for record in records], dtype=np.float64),
                zone_margin=np.array([math.inf if m is None else m for m in margins], np.float64),
            )
        except (KeyError, TypeError) as error:
            raise ValueError(f"a piece of the path is malformed: {error!r}.") from error


def end_tangents(controls: Floats) -> Floats:
    """Unit tangents at the start and the end of each piece.

    Where a handle has no length, the next control point that differs gives the direction.

    Parameters
    ----------
    controls
        Shape (M, 4, 3).

    Returns
    -------
    tangents
        Shape (M, 2, 3); zero for a piece without length.

    """
    result = np.zeros((len(controls), 2, 3))
    for row, points, sign in ((0, controls, 1.0), (1, controls[:, ::-1], -1.0)):
        for reach in (3, 2, 1):  # the nearest that differs wins
            step = sign * (points[:, reach] - points[:, 0])
            size = np.linalg.norm(step, axis=1, keepdims=True)
            result[:, row] = np.where(
                size > 0.0, step / np.where(size > 0.0, size, 1.0), result[:, row]
            )
    return result


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
