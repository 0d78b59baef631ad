"""Which photos to take in which sortie, as numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats, Ints, read_only

ENDS = 3
"""Least waypoints that a sortie has: above take-off, a photo, above landing."""

TIE = 1e-9
"""Durations may exceed the endurance, seconds, by what floating-point sums may."""

Known = Mapping[tuple[int, tuple[int, ...]], float]
"""Seconds of sorties that have been flown, by station and photos; infinite if impossible."""


@dataclass(frozen=True, slots=True, eq=False)
class SortieProblem:
    """Photos, stations, and what a sortie may take.

    Parameters
    ----------
    legs
        Seconds from photo to photo, the second one included, shape (V, V).
    out
        Seconds from lift-off at each station to each photo, which is included, shape (H, V).
    back
        Seconds from each photo to each station on the ground, shape (H, V).
    points
        Waypoints that a leg adds, at least 1, shape (V, V).
    out_points, back_points
        Waypoints that the ways from and to the stations add, at least 1, shape (H, V).
    endurance
        Seconds that a sortie may last.
    most
        Waypoints that a sortie may have; ``None`` is any number.
    turnaround
        Seconds on the ground that each sortie costs.

    Raises
    ------
    ValueError
        If shapes do not fit or a time is negative or not a number.

    """

    legs: Floats
    out: Floats
    back: Floats
    points: Ints
    out_points: Ints
    back_points: Ints
    endurance: float
    most: int | None = None
    turnaround: float = 0.0

    def __post_init__(self) -> None:
        count, stations = len(self.legs), len(self.out)
        for name, shape in (
            ("legs", (count, count)),
            ("out", (stations, count)),
            ("back", (stations, count)),
        ):
            object.__setattr__(self, name, read_only(getattr(self, name), shape, name=name))
            if not (getattr(self, name) >= 0.0).all():
                raise ValueError(f"{name} must not be negative.")
        for name, shape in (
            ("points", (count, count)),
            ("out_points", (stations, count)),
            ("back_points", (stations, count)),
        ):
            points = read_only(getattr(self, name), shape, name=name, dtype=np.int64)
            object.__setattr__(self, name, points)
            if points.size and int(points.min()) < 1:
                raise ValueError(f"{name}: each way adds at least one waypoint.")
        if not (self.endurance > 0.0 and self.turnaround >= 0.0):
            raise ValueError(
                f"need endurance > 0 and turnaround >= 0, got {self.endurance}, {self.turnaround}."
            )

    @property
    def size(self) -> int:
        """Number of photos."""
        return len(self.legs)

    def seconds(self, station: int, photos: Ints) -> float:
        """Duration of a sortie through these photos in this order."""
        inner = float(self.legs[photos[:-1], photos[1:]].sum())
        return float(self.out[station, photos[0]]) + inner + float(self.back[station, photos[-1]])

    def waypoints(self, station: int, photos: Ints) -> int:
        """Waypoints of a sortie through these photos in this order."""
        ends = self.out_points[station, photos[0]] + self.back_points[station, photos[-1]]
        return 1 + int(ends) + int(self.points[photos[:-1], photos[1:]].sum())

    def allows(self, station: int, photos: Ints) -> bool:
        """Whether a sortie keeps both limits."""
        enough = self.most is None or self.waypoints(station, photos) <= self.most
        return enough and self.seconds(station, photos) <= self.endurance + TIE


@dataclass(frozen=True, slots=True, eq=False)
class Split:
    """Photos of each sortie.

    Parameters
    ----------
    sorties
        Photos in order, one array a sortie; together each photo once.
    stations
        Station of each sortie.
    cost
        Seconds of all sorties, with those on the ground.
    method
        ``"split"`` of the given order, or ``"routing"``.

    """

    sorties: tuple[Ints, ...]
    stations: tuple[int, ...]
    cost: float
    method: str

    @property
    def order(self) -> Ints:
        """All photos, sortie by sortie."""
        return np.concatenate([np.zeros(0, dtype=np.int64), *self.sorties])
