"""Chosen viewpoints, as arrays."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.geometry.angles import direction
from planner.geometry.arrays import Floats, Ints, read_only


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoints:
    """Where photos are taken and where they look.

    Parameters
    ----------
    positions
        Shape (V, 3), metres, local frame.
    yaw_deg
        Shape (V,), degrees clockwise from +y, in (-180, 180].
    pitch_deg
        Shape (V,), degrees, 0 horizon, -90 nadir.
    kind
        Why each was chosen, such as ``"cover"``, ``"local"`` or ``"global"``, length V.
    targets
        Surface sample that each was aimed at, shape (V,), or -1.

    """

    positions: Floats
    yaw_deg: Floats
    pitch_deg: Floats
    kind: tuple[str, ...]
    targets: Ints

    def __post_init__(self) -> None:
        count = len(self.positions)
        set_ = object.__setattr__
        set_(self, "positions", read_only(self.positions, (None, 3), name="positions"))
        set_(self, "yaw_deg", read_only(self.yaw_deg, (count,), name="yaw_deg"))
        set_(self, "pitch_deg", read_only(self.pitch_deg, (count,), name="pitch_deg"))
        targets = read_only(self.targets, (count,), name="targets", dtype=np.int64)
        set_(self, "targets", targets)
        set_(self, "kind", tuple(self.kind))
        if len(self.kind) != count:
            raise ValueError(f"kind must name {count} viewpoints, got {len(self.kind)}.")

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def directions(self) -> Floats:
        """Unit view directions, shape (V, 3)."""
        return direction(self.yaw_deg, self.pitch_deg)

    def take(self, order: Ints) -> "Viewpoints":
        """Return the viewpoints of these rows, in this order."""
        rows = np.asarray(order)
        kind = tuple(self.kind[row] for row in np.arange(len(self))[rows])
        return Viewpoints(
            self.positions[rows], self.yaw_deg[rows], self.pitch_deg[rows], kind, self.targets[rows]
        )

    def joined(self, others: "Viewpoints") -> "Viewpoints":
        """Return these viewpoints, then the others."""
        return Viewpoints(
            np.concatenate([self.positions, others.positions]),
            np.concatenate([self.yaw_deg, others.yaw_deg]),
            np.concatenate([self.pitch_deg, others.pitch_deg]),
            self.kind + others.kind,
            np.concatenate([self.targets, others.targets]),
        )

    def rounded(self) -> "Viewpoints":
        """Round to what files hold: positions to 0.1 mm, angles to 0.0001 degrees."""
        yaw = np.round(self.yaw_deg, 4)
        return Viewpoints(
            np.round(self.positions, 4) + 0.0,  # a negative zero becomes zero
            np.where(yaw <= -180.0, 180.0, yaw) + 0.0,
            np.round(self.pitch_deg, 4) + 0.0,
            self.kind,
            self.targets,
        )

    def to_records(self) -> list[dict[str, Any]]:
        """One dict a viewpoint with the columns of ``viewpoints.csv``."""
        rows = zip(
            self.positions, self.directions, self.yaw_deg, self.pitch_deg, self.kind, strict=True
        )
        return [
            {
                "index": index,
                **dict(zip("xyz", map(float, position), strict=True)),
                **dict(zip(("dx", "dy", "dz"), map(float, look), strict=True)),
                "yaw_deg": float(yaw),
                "pitch_deg": float(pitch),
                "kind": kind,
            }
            for index, (position, look, yaw, pitch, kind) in enumerate(rows)
        ]
