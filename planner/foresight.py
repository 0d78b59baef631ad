"""What is refused before the work that it would waste."""

from pathlib import Path

import numpy as np

from planner.airspace.airspace import flight_bounds
from planner.airspace.terrain import terrain
from planner.airspace.zone_files import with_files
from planner.config import Config, SortieSettings
from planner.errors import MissingDependency, PlannerError
from planner.scale import DESIGN_INCIDENCE, NEAREST_SHARE, Scale
from planner.scene.readers.poses import read_poses
from planner.scene.scene import Scene
from planner.sorties.refusals import refuse_waypoints
from planner.sorties.station import pad_of
from planner.sorties.thought import usable_seconds
from planner.viewpoints.camera import Camera, camera_of
from planner.viewpoints.frustum import elevation_range

_MOST_SQUARES = 50_000_000
"""Squares of side R on the ground; for more the memory of most machines is too small."""

_AREA_CELL = 0.01  # of the longest side: squares of which those with points are counted


def refuse_settings(config: Config) -> Config:
    """Refuse what the settings and the files that they name show to be impossible.

    Returns
    -------
    config
        The same settings with the zones of files among the others: files are read once.

    Raises
    ------
    PlannerError
        If a solver is not known or cannot keep its limit, a file cannot be used, a reference
        system is not known, the camera sees only the sky, or there is nowhere to fly.
    MissingDependency
        If a solver is not installed.

    """
    _refuse_solvers(config)
    _refuse_systems(config)
    airspace = with_files(config.airspace)
    if config.scene.images is not None:
        read_poses(Path(config.scene.images))
    camera = camera_of(config.camera)
    if elevation_range(camera)[0] >= 0.0:
        raise PlannerError(
            f"camera.pitch_min_deg = {config.camera.pitch_min_deg:g}: nothing below the horizon "
            "comes into the picture; lower it, -90 being straight down"
        )
    _refuse_distances(config, camera)
    if config.scale.d_min is not None:
        _refuse_ceiling(config, config.scale.d_min)
    if config.sorties.stations:
        refuse_waypoints(config.sorties)
    return config.model_copy(update={"airspace": airspace})


def refuse_place(config: Config, scene: Scene, scale: Scale) -> None:
    """Refuse what the size of a place shows to be impossible, before its surface is made.

    Raises
    ------
    PlannerError
        If R does not suit the place, the ceiling or the range of photos is within the least
        distance, a station is out of bounds, or the climb from it takes longer than a battery
        lasts.

    """
    _refuse_radius(scene, scale.radius)
    _refuse_ceiling(config, scale.d_min)
    if config.viewpoints.by_pairs:
        _refuse_range(config, scale)
    if config.sorties.stations:
        _refuse_stations(config, scene, scale)
        _refuse_climbs(config.sorties, scale.d_min)


def _refuse_solvers(config: Config) -> None:
    from solvers import SolverError, SolverUnavailable
    from solvers.registry import load, require

    views, route = config.viewpoints, config.route
    covers = not views.by_pairs and views.iterations is not None
    for setting, family, name, counted in (
        ("viewpoints.solver", "cover", views.solver, covers),
        ("route.solver", "tour", route.solver, route.iterations is not None),
        ("flight.solver", "motion", config.flight.solver, True),
        ("viewpoints.pair_solver", "pairs", views.pair_solver, views.by_pairs),
    ):
        try:
            solver = load(family, name)
            require(solver)
        except SolverUnavailable as error:
            raise MissingDependency(f"{setting}: {error}") from error
        except SolverError as error:
            raise PlannerError(f"{setting} = {name!r}: {error}") from error
        if counted and "iterations" in getattr(solver, "ignores", ()):
            table = setting.partition(".")[0]
            raise PlannerError(
                f"{setting} = {name!r}: heeds no limit on {table}.iterations; choose another solver"
                + (f", or leave {table}.iterations out" if family in {"cover", "tour"} else "")
            )


def _refuse_systems(config: Config) -> None:
    """Reference systems that are not known, or in which a scan cannot be."""
    zones = [
        (f"airspace.zones[{row}].crs", zone.crs)
        for row, zone in enumerate(config.airspace.zones)
        if zone.crs not in {"local", "source"}
    ]
    scan = [] if config.scene.crs is None else [("scene.crs", config.scene.crs)]
    if not zones and not scan:
        return
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    for setting, text in (*scan, *zones):
        try:
            system = CRS.from_user_input(text)
        except CRSError:
            raise PlannerError(
                f"{setting} = {text[:60]!r}: is not known; give an EPSG code such as EPSG:25832"
            ) from None
        if setting == "scene.crs" and (system.is_geographic or system.is_geocentric):
            raise PlannerError(
                f"{setting} = {text[:60]!r}: is no map projection; "
                "project the scan to metres (for example UTM) and give that"
            )


def _refuse_distances(config: Config, camera: Camera) -> None:
    """Least and farthest distances that leave no room, where both are settled by settings."""
    lengths = config.scale
    farthest, why = lengths.d_max, "scale.d_max"
    if farthest is None and lengths.gsd is not None:
        farthest, why = camera.distance_for(lengths.gsd, DESIGN_INCIDENCE), "scale.gsd"
    if lengths.d_min is None or farthest is None:
        return
    if lengths.d_min >= NEAREST_SHARE * farthest:
        raise PlannerError(
            f"scale.d_min = {lengths.d_min:g}: leaves no room below d_max {farthest:.4g} m; "
            f"lower it under {NEAREST_SHARE * farthest:.4g} m or raise {why}"
        )


def _refuse_ceiling(config: Config, d_min: float) -> None:
    """A ceiling under which nothing keeps its distance from the ground and from the ceiling."""
    ceiling, kept = config.airspace.ceiling, config.airspace.zone_margin
    if ceiling is not None and ceiling < d_min + kept:
        under = f"{kept:g} m of zone_margin over " if kept else ""
        raise PlannerError(
            f"airspace.ceiling = {ceiling:g}: is under {under}d_min {d_min:.4g} m, which is kept "
            f"from the ground too; raise it by over {d_min + kept - ceiling:.2f} m or lower "
            f"scale.d_min{' or airspace.zone_margin' if kept else ''}"
        )


def _refuse_radius(scene: Scene, radius: float) -> None:
    """A radius larger than the place, or so small that its samples would fill the memory."""
    longest, name = float(scene.box.size.max()), scene.source or scene.name
    if radius > longest:
        raise PlannerError(
            f"{name}: scale.radius {radius:.4g} m is more than the whole scene, {longest:.4g} m; "
            "lower it, or set scene.unit if the unit is wrong"
        )
    area = _area(scene)
    if area > _MOST_SQUARES * radius**2:
        least = np.sqrt(area / _MOST_SQUARES)
        raise PlannerError(
            f"{name}: scale.radius {radius:.3g} m makes more samples than fit into memory; "
            f"raise it to {1.01 * least:.3g} m or more, or give a smaller part of the scene"
        )


def _area(scene: Scene) -> float:
    """Area that the points lie over, square metres, however the place is turned or bent."""
    xy, cell = scene.cloud.xyz[:, :2], _AREA_CELL * float(scene.box.size.max())
    squares = np.floor((xy - xy.min(axis=0)) / cell).astype(np.int64)
    held = np.zeros(squares.max(axis=0) + 1, dtype=np.bool_)
    held[tuple(squares.T)] = True
    return float(min(np.count_nonzero(held) * cell**2, scene.box.size[:2].prod()))


def _refuse_range(config: Config, scale: Scale) -> None:
    """A range of photos that ends before they may begin."""
    reference = 2.0 * scale.gsd * camera_of(config.camera).focal_px
    share = config.viewpoints.pair_range
    if share * reference <= scale.d_min:
        raise PlannerError(
            f"viewpoints.pair_range = {share:g}: photos then count up to {share * reference:.3g} m "
            f"only, which is within d_min {scale.d_min:.4g} m; "
            f"raise it over {scale.d_min / reference:.3g} or lower scale.d_min"
        )


def _refuse_stations(config: Config, scene: Scene, scale: Scale) -> None:
    """Stations out of the space in which flight is considered, or deep in the ground."""
    bounds = flight_bounds(scene, config.airspace, d_max=scale.d_max)
    kept = {"d_min": scale.d_min, "margin": config.flight.margin}
    height = terrain(scene.ground).height
    for number, point in enumerate(config.sorties.stations):
        pad_of(number, np.array(point, dtype=np.float64), bounds, height, **kept)


def _refuse_climbs(settings: SortieSettings, d_min: float) -> None:
    """A battery that does not last for the way up to ``d_min`` and back."""
    climbs, usable = 2.0 * d_min / settings.climb_speed, usable_seconds(settings)
    if climbs > usable:
        raise PlannerError(
            f"sorties.endurance_seconds = {settings.endurance_seconds:g}: to climb to d_min "
            f"{d_min:.4g} m and back takes {climbs:.0f} s, and a reserve of {settings.reserve:g} "
            f"leaves {usable:.0f} s; raise it"
        )
