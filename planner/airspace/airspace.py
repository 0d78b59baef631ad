"""Where a drone may fly: clearance to solids, margin to zones, and proofs along edges."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.airspace.collision import Triangles
from planner.airspace.field import TriangleTree
from planner.airspace.obstacles import Points
from planner.airspace.occupancy import Occupancy, occupancy
from planner.airspace.solids import collect_solids, joined
from planner.airspace.storage import StoredAirspace, read_arrays, write_arrays
from planner.airspace.terrain import Terrain, terrain
from planner.airspace.zone_files import local_zones
from planner.airspace.zones import Zones, zones
from planner.config import AirspaceSettings
from planner.geometry.arrays import Bools, Floats, Ints, read_only
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground, Scene

_STEPS = 10  # of the walk out of a doubtful cell; each about doubles the distance


@dataclass(frozen=True, eq=False)
class Airspace:
    """Solids, zones and distances of a place.

    Solids are the surface, curtains around what is filled under roofs, the terrain and all
    under it, the raw points, whatever the open sky does not reach and, if it is to be closed, what
    was never seen; the faces of that count as surface.

    Parameters
    ----------
    mesh
        All triangles of the solids: surface, terrain, curtains, in that order, local metres.
    parts
        Number of triangles of each of the three, shape (3,).
    obstacles
        Raw points, shape (P, 3), metres.
    ground
        Terrain heights by cell.
    zones
        Prisms, ceiling, and what is kept from them.
    occupancy
        Grid of what the open sky reaches.
    d_min, d_max
        Least clearance, and the farthest that a photo is taken from, metres.
    low, high
        Corners of the space in which flight is considered, shape (3,), metres.

    """

    mesh: Mesh
    parts: Ints
    obstacles: Floats
    ground: Ground
    zones: Zones
    occupancy: Occupancy
    d_min: float
    d_max: float
    low: Floats
    high: Floats

    def __post_init__(self) -> None:
        for name, shape in (("obstacles", (None, 3)), ("low", (3,)), ("high", (3,))):
            object.__setattr__(self, name, read_only(getattr(self, name), shape, name=name))
        parts = read_only(self.parts, (3,), name="parts", dtype=np.int64)
        object.__setattr__(self, "parts", parts)
        if parts.min() < 0 or parts.sum() != len(self.mesh):
            raise ValueError(f"parts {parts} must sum to the {len(self.mesh)} triangles.")
        if not 0.0 < self.d_min < self.d_max or not (self.low < self.high).all():
            raise ValueError(
                f"need 0 < d_min < d_max and low < high, got {self.d_min}, {self.d_max}, "
                f"{self.low} and {self.high}."
            )

    def __getstate__(self) -> dict[str, Any]:
        """Fields only: each process builds its own search structures."""
        return {name: vars(self)[name] for name in self.__dataclass_fields__}

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Plain arrays that :meth:`from_arrays` and ``numpy.savez`` understand; no objects."""
        return write_arrays(
            StoredAirspace(
                mesh=self.mesh,
                parts=self.parts,
                obstacles=self.obstacles,
                ground=self.ground,
                zones=self.zones,
                d_min=self.d_min,
                d_max=self.d_max,
                low=self.low,
                high=self.high,
                under_roofs=self.occupancy.under_roofs,
                most_cells=self.occupancy.most_cells,
            )
        )

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, NDArray[Any]], *, name: str = "airspace.npz"
    ) -> "Airspace":
        """Build the airspace again from arrays that may come from anywhere.

        The occupancy grid is flooded anew from the surface, the terrain and the points.

        Parameters
        ----------
        arrays
            As :meth:`to_arrays` makes them.
        name
            What the file is called in complaints.

        Returns
        -------
        airspace
            Equal in every answer to the one that was stored.

        Raises
        ------
        PlannerError
            If anything is missing or cannot be.

        """
        stored = read_arrays(arrays, name=name)
        surface = Mesh(stored.mesh.vertices, stored.mesh.triangles[: stored.parts[0]])
        grid, _ = occupancy(
            surface,
            terrain(stored.ground),
            stored.obstacles,
            d_min=stored.d_min,
            under_roofs=stored.under_roofs,
            most_cells=stored.most_cells,
        )
        return cls(
            mesh=stored.mesh,
            parts=stored.parts,
            obstacles=stored.obstacles,
            ground=stored.ground,
            zones=stored.zones,
            occupancy=grid,
            d_min=stored.d_min,
            d_max=stored.d_max,
            low=stored.low,
            high=stored.high,
        )

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner of the space in which flight is considered, each (3,)."""
        return self.low, self.high

    @property
    def ceiling(self) -> float | None:
        """Highest flight above the terrain, metres, or ``None``."""
        return None if self.zones.ceiling is None else self.zones.ceiling.above_ground

    @cached_property
    def terrain(self) -> Terrain:
        """Terrain as the continuous sheet that is part of the solids."""
        return terrain(self.ground)

    @cached_property
    def _triangles(self) -> Triangles:
        return Triangles(self.mesh)

    @cached_property
    def _tree(self) -> TriangleTree:
        return TriangleTree(self.mesh)

    @cached_property
    def _points(self) -> Points:
        return Points(self.obstacles, cell=0.5 * self.d_min)

    def clearance(self, points: Floats) -> Floats:
        """Signed distance from points to solids.

        Parameters
        ----------
        points
            Shape (m, 3), metres, local frame.

        Returns
        -------
        clearance
            Shape (m,), metres. Exact outside; inside, minus the distance to the nearest surface.
            Minus infinity for a point that is not finite.

        """
        points = np.asarray(points, dtype=np.float64)
        clearance = np.full(len(points), -np.inf)
        finite = np.isfinite(points).all(axis=1)
        if len(at := points[finite]):
            surface, obstacle, side = self._measure(at)
            for row in np.flatnonzero(side == 0):  # few: only beside surfaces
                side[row] = 1 if self._walk_reaches_sky(at[row]) else -1
            clearance[finite] = np.minimum(side * surface, obstacle)
        return clearance

    def clearance_range(self, points: Floats) -> tuple[Floats, Floats]:
        """Bounds of the clearance of finite points, cheap: the side is not sought near surfaces.

        For choosing places and ways, not for proofs: by a tree that is much faster than FCL.

        Parameters
        ----------
        points
            Shape (m, 3), metres, local frame.

        Returns
        -------
        lowest, highest
            Each (m,), metres, up to rounding; equal unless close to surfaces, always where the
            clearance is ``d_min`` or more.

        """
        points = np.asarray(points, dtype=np.float64)
        surface, obstacle = self._tree.distance(points), self._points.distance(points)
        side = self._sides(points, np.minimum(surface, obstacle))
        lowest = np.minimum(np.where(side > 0, surface, -surface), obstacle)
        highest = np.minimum(np.where(side < 0, -surface, surface), obstacle)
        return lowest, highest

    def obstacle_distance(self, points: Floats) -> Floats:
        """Distance from finite points, (m, 3), to the nearest raw point, (m,), metres."""
        return self._points.distance(points)

    def zone_margin(self, points: Floats) -> Floats:
        """Signed margin of points, (m, 3), beyond what is kept from zones; negative is forbidden.

        Metres; changes by at most a metre a metre; infinite without zones, minus infinity if not
        finite.
        """
        points = np.asarray(points, dtype=np.float64)
        margin = np.full(len(points), -np.inf)
        finite = np.isfinite(points).all(axis=1)
        margin[finite] = self.zones.margin(points[finite])
        return margin

    def is_free(self, points: Floats) -> Bools:
        """Tell which points, (m, 3), keep ``d_min`` to solids, obey the zones and are in bounds."""
        points = np.asarray(points, dtype=np.float64)
        free: Bools = self._in_bounds(points) & (self.zone_margin(points) >= 0.0)
        free[free] = self.clearance(points[free]) >= self.d_min
        return free

    def capsule_clearance_at_least(self, a: Floats, b: Floats, radius: float) -> bool:
        """Prove that no surface and no obstacle is closer than ``radius`` to the segment.

        Says nothing about the side: with one end outside of solids, the whole segment is.

        Parameters
        ----------
        a, b
            Ends of the segment, shape (3,), metres.
        radius
            Wanted distance, metres, positive.

        Returns
        -------
        clear
            Exact but for a hundredth of a millimetre on the safe side. False for ends that are
            not finite or out of the space that is known.

        """
        a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
        if not self._in_bounds(np.stack([a, b]), margin=self.d_max).all():
            return False
        return self._points.capsule_is_clear(a, b, radius) and self._triangles.capsule_is_clear(
            a, b, radius
        )

    def zone_margin_at_least(self, a: Floats, b: Floats, margin: float) -> bool:
        """Prove that the zone margin along the whole segment is at least ``margin`` metres."""
        a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
        if not np.isfinite([a, b]).all():
            return False
        return self.zones.margin_at_least(a, b, margin)

    def edge_is_free(self, a: Floats, b: Floats) -> bool:
        """Prove that every point of the segment is free.

        The capsule of radius ``d_min`` around it touches no solid, its start is outside of solids
        (and so, with no surface between, is the rest), no zone is touched, both ends are in bounds.
        """
        a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
        return (
            bool(self._in_bounds(np.stack([a, b])).all())
            and self.zone_margin_at_least(a, b, 0.0)
            and self.capsule_clearance_at_least(a, b, self.d_min)
            and bool(self._is_sky(a[None])[0] or self._walk_reaches_sky(a))
        )

    def _in_bounds(self, points: Floats, *, margin: float = 0.0) -> Bools:
        inside = (points >= self.low - margin) & (points <= self.high + margin)
        return np.asarray(inside.all(axis=1))  # not a number is in no bounds

    def _measure(self, points: Floats) -> tuple[Floats, Floats, Ints]:
        """Distance to surfaces and to obstacles; side: 1 outside, -1 inside, 0 not known yet.

        A point farther from both than the grid blurs things is in a sky cell, or in a hollow.
        """
        surface, obstacle = self._triangles.distance(points), self._points.distance(points)
        return surface, obstacle, self._sides(points, np.minimum(surface, obstacle))

    def _sides(self, points: Floats, distance: Floats) -> Ints:
        """Side of points so far from surfaces and obstacles, as :meth:`_measure` tells it."""
        near = np.where(distance <= self.occupancy.blur, 0, -1)
        return np.where(self._is_sky(points), 1, near)

    def _is_sky(self, points: Floats) -> Bools:
        """Tell which points are proven outside by the grid, or by the terrain beyond it."""
        sky, in_grid = self.occupancy.is_sky(points)
        if in_grid.all():
            return sky
        return sky | (~in_grid & (points[:, 2] > self.terrain.height(points)))

    def _walk_reaches_sky(self, point: Floats) -> bool:
        """Step away from the nearest surface until in a sky cell; no step crosses a surface."""
        for _ in range(_STEPS):
            distance, nearest = self._triangles.nearest(point)
            if distance <= 0.0:
                return False
            point = point + 0.999 * (point - nearest)
            if self._is_sky(point[None])[0]:
                return True
        return False


def build_airspace(
    scene: Scene,
    mesh: Mesh,
    *,
    d_min: float,
    d_max: float,
    settings: AirspaceSettings = AirspaceSettings(),  # noqa: B008 - an immutable value
) -> Airspace:
    """Build the airspace of a scene.

    Parameters
    ----------
    scene
        Points, terrain and box.
    mesh
        Surface.
    d_min, d_max
        Least clearance, and farthest distance of a photo, metres.
    settings
        Zones, ceiling, grid.

    Returns
    -------
    airspace
        Flight is considered in the grown box.

    """
    settings = local_zones(settings, scene)
    low, high = flight_bounds(scene, settings, d_max=d_max)
    sheet = terrain(scene.ground)
    solids = collect_solids(scene, mesh, sheet, (low, high), d_min=d_min, settings=settings)
    reach = 2.0 * d_max + 2.0 * d_min
    parts = (solids.surface, sheet.mesh(low[:2] - reach, high[:2] + reach), solids.curtains)
    return Airspace(
        mesh=joined(parts),
        parts=np.array([len(part) for part in parts]),
        obstacles=solids.points,
        ground=scene.ground,
        zones=zones(settings.zones, settings.ceiling, scene.ground, kept=settings.zone_margin),
        occupancy=solids.occupancy,
        d_min=d_min,
        d_max=d_max,
        low=low,
        high=high,
    )


def flight_bounds(
    scene: Scene, settings: AirspaceSettings, *, d_max: float
) -> tuple[Floats, Floats]:
    """Lowest and highest corner, (3,) each, of the grown box in which flight is considered."""
    beyond = d_max if settings.beyond is None else settings.beyond
    half = 0.5 * scene.box.size @ np.abs(scene.box.axes) + beyond
    low, high = scene.box.centre - half, scene.box.centre + half
    low[2] = min(low[2], float(scene.ground.heights.min()))
    return low, high
