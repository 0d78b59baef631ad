"""Settings of a plan: one frozen model a stage, strict TOML in and out."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from planner.assignment import assign
from planner.errors import PlannerError
from planner.mistakes import first_mistake
from planner.prism import ZoneSettings
from planner.settings import (
    Degrees,
    DegreesPerSecond,
    Metres,
    MetresPerPixel,
    MetresPerSecond,
    MetresPerSecondSquared,
    Minutes,
    Percent,
    Pixels,
    Seconds,
    Settings,
    WholePixels,
)
from planner.toml_text import toml_of

__all__ = [
    "FLIGHT_MARGIN",
    "AirspaceSettings",
    "CameraSettings",
    "Config",
    "FlightSettings",
    "QualitySettings",
    "RouteSettings",
    "ScaleSettings",
    "SceneSettings",
    "SortieSettings",
    "SurfaceSettings",
    "ViewpointSettings",
    "ZoneSettings",
    "load_config",
]

FLIGHT_MARGIN = 0.002
"""What a flight keeps beyond d_min unless it is set otherwise, metres."""

_Pad = Annotated[tuple[float, ...], Field(min_length=2, max_length=3)]


class SceneSettings(Settings):
    """How the source is read and cleaned."""

    up: Literal["auto", "x", "y", "z"] = "auto"
    """Vertical axis of the source; ``auto`` follows the format: y for GLB, z for the rest."""
    unit: Annotated[float, Field(gt=0.0)] | Literal["auto"] = "auto"
    """Metres that one unit of the source is; ``auto`` follows its reference system or format."""
    crs: str | None = None
    """Reference system of the source, such as ``EPSG:25832``; unset: what the file says."""
    outlier_neighbours: int = Field(default=16, ge=2, le=200)
    """Neighbours to which a point's mean distance is taken, to tell strays."""
    outlier_sigma: float = Field(default=5.0, gt=0.0)
    """Standard deviations by which that distance exceeds its mean where a point is dropped."""
    normal_neighbours: int = Field(default=16, ge=4, le=200)
    """Neighbours that a normal is fitted to."""
    max_points: int = Field(default=4_000_000, ge=1_000)
    """Points to which a denser cloud is thinned first, which bounds the memory."""
    images: str | None = Field(default=None, min_length=1)
    """File with the poses of the first flight's photos, in the source's coordinates."""


class CameraSettings(Settings):
    """A pinhole camera on a gimbal; by default 20 megapixels, 84 degrees across the diagonal."""

    width_px: WholePixels = Field(default=5472, ge=16, le=100_000)
    """Width of the picture."""
    height_px: WholePixels = Field(default=3648, ge=16, le=100_000)
    """Height of the picture."""
    diagonal_deg: Degrees = Field(default=84.0, gt=1.0, lt=170.0)
    """Field of view across the diagonal."""
    pitch_min_deg: Degrees = Field(default=-90.0, ge=-90.0, le=90.0)
    """Lowest pitch of the gimbal; -90 looks straight down, 0 at the horizon."""
    pitch_max_deg: Degrees = Field(default=0.0, ge=-90.0, le=90.0)
    """Highest pitch of the gimbal."""

    @model_validator(mode="after")
    def _has_a_range(self) -> Self:
        """Refuse a gimbal whose lowest pitch is above its highest."""
        if self.pitch_min_deg > self.pitch_max_deg:
            raise ValueError(
                f"pitch_min_deg = {self.pitch_min_deg:g} is above pitch_max_deg = "
                f"{self.pitch_max_deg:g}; swap them (-90 is straight down)"
            )
        return self


class ScaleSettings(Settings):
    """Lengths; those unset follow from the bounding box, the camera and each other."""

    radius: Metres | None = Field(default=None, gt=0.0)
    """Radius R: samples are at least so far apart; unset: ``radius_share`` of the longest side."""
    radius_share: float = Field(default=0.015, gt=0.0, lt=0.2)
    """R as a share of the longest side of the scene's box, where ``radius`` is unset."""
    gsd: MetresPerPixel | None = Field(default=None, gt=0.0)
    """Wanted ground sample distance; unset: R / 100, or coarser where that leaves no room."""
    d_min: Metres | None = Field(default=None, gt=0.0)
    """Distance to all solids that the flight keeps; unset: 2 R, and in a source known to be in
    metres no less than ``prior_noise`` plus 2 m."""
    d_max: Metres | None = Field(default=None, gt=0.0)
    """Farthest distance of a photo; unset: where a surface seen at 45 degrees has the ``gsd``."""
    voxel: Metres | None = Field(default=None, gt=0.0)
    """Spacing of the positions that photos are first chosen from; unset: 2 R."""
    poisson_depth: int | None = Field(default=None, ge=4, le=11)
    """Depth of the octree of the Poisson surface; unset: cells of about R / 4, from 5 to 9."""
    prior_noise: Metres | None = Field(default=None, ge=0.0)
    """Uncertainty of the coarse model; unset: the points' median distance to planes through
    their neighbours."""


class SurfaceSettings(Settings):
    """The Poisson surface and its samples."""

    clusters: int | None = Field(default=None, ge=1)
    """Clusters of samples by position and normal; unset: one per about 400 samples."""
    trim: float = Field(default=5.0, gt=0.0)
    """Distance from any point, in R, beyond which the surface is dropped unless nearer surface
    encloses it."""
    walls: bool = True
    """Whether plain walls are stood under roof edges where no facade was seen."""


class QualitySettings(Settings):
    """Variants of Eqs. 1 to 5; the defaults find holes and noise best (see the page on quality)."""

    density_weight: Literal["intended", "printed"] = "intended"
    """The weight of Eq. 1 as its text means it, or as it is printed."""
    density_reference: Literal["local", "maximum"] = "local"
    """What a count of neighbours is compared with: what is usual around and everywhere, or the
    maximum of all samples."""
    gradient: Literal["none", "smoothed", "spectral"] = "none"
    """Gradient in the completeness: none, of smoothed normals, or of the Poisson equation."""
    smoothness: Literal["flatness", "mean", "sum"] = "flatness"
    """Smoothness by roughness around a sample, or by normals as a mean or as the printed sum."""
    roughness: float = Field(default=0.06, gt=0.0)
    """Roughness at which ``flatness`` falls, as a share of R."""
    angle_deg: Degrees = Field(default=30.0, gt=0.0, le=180.0)
    """Angle between normals at which ``mean`` and ``sum`` fall."""
    clip_percent: Percent = Field(default=1.0, ge=0.0, lt=50.0)
    """Share of the samples at either end that is clipped before Eq. 5; 0 as printed."""


class AirspaceSettings(Settings):
    """No-fly hull and zones."""

    ceiling: Metres | None = Field(default=None, gt=0.0)
    """Greatest height above the ground under the drone; unset: none."""
    zone_margin: Metres = Field(default=0.0, ge=0.0)
    """Distance kept from all zones and from the ceiling, beyond ``flight.margin``."""
    zones: tuple[ZoneSettings, ...] = ()
    """Prisms that flight keeps out of or in; the settings of each are below."""
    zone_files: tuple[str, ...] = ()
    """GeoJSON files whose polygons are zones too, with ``kind``, ``bottom`` and ``top`` as
    properties, heights above ground."""
    beyond: Metres | None = Field(default=None, gt=0.0, le=2_000.0)
    """How far outside of the scene's box flight is considered, where nothing is known and level
    ground is assumed; unset: d_max."""
    fill_under_roofs: bool = True
    """Whether what lies under a surface that faces up is solid down to the next underside or
    the terrain, since walls are often missing in a first flight's data."""
    unknown: Literal["open", "closed"] = "open"
    """Whether space is flown through, or solid, to which no straight line led from the open sky
    on its way to a raw point."""
    seen_within_deg: Degrees | None = Field(default=None, gt=0.0, lt=90.0)
    """Angle from the vertical of such lines; unset: as far as most photos of the first flight
    saw, or 60 where their poses are not known."""
    hull: Literal["none", "ply", "stl", "obj", "glb"] = "none"
    """Format in which the no-fly hull, where the clearance is d_min, is written as a mesh."""
    most_cells: int = Field(default=200_000_000, ge=1_000, le=2_000_000_000)
    """Cells of the grid that tells inside from outside, one byte each, which bounds the memory."""


class ViewpointSettings(Settings):
    """Which photos to take.

    A setting that begins with ``cover``, ``paper`` or ``smith`` is read by that preset, one that
    begins with ``hits`` or ``pairs`` by preset ``cover`` with objective ``hits`` or
    ``reconstructability``.
    """

    preset: Literal["cover", "paper", "smith"] = "cover"
    """How photos are chosen: as few as cover the surface, the paper's local and global views, or
    a given number moved until they reconstruct the most (the last two to compare with)."""
    objective: Literal["hits", "reconstructability"] = "reconstructability"
    """What ``cover`` counts: photos of each sample, or what pairs of them can triangulate (h)."""
    effort: Literal["quick", "standard", "best"] = "quick"
    """``pairs``: from how many positions and for how long photos are searched."""
    target: float = Field(default=4.0, gt=0.0)
    """``pairs``, ``smith``: wanted reconstructability h of each sample."""
    share: float = Field(default=0.98, gt=0.0, le=1.0)
    """``pairs``, ``smith``: wanted share with that ``target`` of the samples that can reach it."""
    floor: float = Field(default=0.9, ge=0.0, lt=1.0)
    """``pairs``: part of the ``target`` that samples should have which the ``share`` leaves out, or
    which cannot reach all of it; 0: none. A given number of photos (``budget``, or what fits
    into ``minutes``) has none."""
    floor_share: float = Field(default=0.995, gt=0.0, le=1.0)
    """``pairs``: wanted share with that of the samples that can reach it."""
    sharp_views: int = Field(default=1, ge=0, le=20)
    """``pairs``: photos within the wanted GSD of each sample that wants them."""
    sharp_share: float = Field(default=0.85, gt=0.0, le=1.0)
    """``pairs``: share that wants them, of the samples that can have any: those that most
    positions see so."""
    budget: int | None = Field(default=None, ge=1)
    """``pairs``: the best share for so many photos; unset: as many as it takes."""
    minutes: Minutes | None = Field(default=None, gt=0.0)
    """``pairs``: the best share for a flight no longer than this, all sorties with their
    climbs; unset: as long as it takes."""
    pair_range: float = Field(default=1.0, gt=0.0, le=1.0)
    """``pairs``: how far a photo counts, as a share of where it is worth nothing."""
    pair_solver: str = "lns"
    """``pairs``: solver of family ``pairs`` that searches the fewest photos."""
    connected: bool = True
    """``cover``: whether photos are added until all match in one piece, and with ``ties``."""
    link_share: float = Field(default=0.3, ge=0.0, le=1.0)
    """Share of the samples of the smaller view that two matching photos both show."""
    link_least: int = Field(default=15, ge=1)
    """Number of samples that they both show at least."""
    link_turn_deg: Degrees = Field(default=40.0, gt=0.0, le=180.0)
    """Angle between their axes at most."""
    link_scale: float = Field(default=2.0, ge=1.0)
    """Ratio of their scales at most."""
    ties: int = Field(default=3, ge=0)
    """Photos of the first flight that new ones should match, where ``scene.images`` is set."""
    solver: str = "greedy"
    """``hits``: solver of family ``cover`` (``scanwright solvers list`` names them all)."""
    aims: int = Field(default=4, ge=1, le=62)
    """``cover``: directions, the best of them, that each position offers."""
    aim_directions: int = Field(default=62, ge=1, le=64)
    """Directions over the gimbal's range that are tried."""
    hits: int = Field(default=3, ge=1, le=20)
    """``hits``: photos wanted of each sample."""
    sectors: int = Field(default=2, ge=0, le=8)
    """``hits``: different sides that these are wanted from."""
    sector_count: int = Field(default=8, ge=1, le=64)
    """``hits``: sides that are told apart."""
    extra_hits: int = Field(default=1, ge=0, le=20)
    """``hits``: further photos wanted of samples whose quality is low."""
    low_quality_share: float = Field(default=0.25, ge=0.0, le=1.0)
    """``hits``: share of the samples, of the worst quality, that want these."""
    max_incidence_deg: Degrees = Field(default=70.0, gt=0.0, lt=90.0)
    """Largest angle between a sample's normal and a photo that counts as a hit."""
    confidence_angle_deg: Degrees = Field(default=30.0, gt=0.0, le=180.0)
    """Angle at which the orientation term of Eq. 7 falls to 1 / e."""
    confidence_price: float = Field(default=0.2, ge=0.0)
    """``hits``: what a photo of no confidence costs beyond the 1 of one of full confidence."""
    max_candidates: int = Field(default=12_000, ge=10)
    """Free positions at most; where there are more, they are spaced wider."""
    score_threshold: float = Field(default=0.1, ge=0.0, le=1.0)
    """``paper``: quality below which a sample gets a local view."""
    local_views: Literal["unmarked", "each"] = "unmarked"
    """``paper``: local views only while a sample has too few marks, or one each, as printed."""
    exclusion_voxels: int = Field(default=1, ge=0)
    """``paper``: voxels that global views are apart at least."""
    marks: int = Field(default=2, ge=1)
    """``paper``: scanned marks that each sample should have."""
    views: int | None = Field(default=None, ge=1)
    """``smith``: number of photos; unset: by the area."""
    rounds: int = Field(default=4, ge=1)
    """``smith``: how often each photo is moved and turned."""
    iterations: int | None = Field(default=None, ge=1)
    """``cover``: iterations of the solver in all; unset: by ``effort``, or the solver's own."""

    @property
    def by_pairs(self) -> bool:
        """Whether photos are chosen by what pairs of them can triangulate."""
        return self.preset == "cover" and self.objective == "reconstructability"

    @property
    def floors(self) -> bool:
        """Whether samples that need not reach the target are to have a part of it."""
        return self.by_pairs and self.budget is None and self.floor > 0.0

    @model_validator(mode="after")
    def _has_sides_enough(self) -> Self:
        """Refuse more sides than are told apart, where sides are wanted."""
        hits = self.preset == "cover" and self.objective == "hits"
        if hits and self.sectors > self.sector_count:
            raise ValueError(
                f"sectors = {self.sectors} are more than sector_count = {self.sector_count}; "
                "lower the first or raise the second"
            )
        return self

    @model_validator(mode="after")
    def _has_one_limit(self) -> Self:
        """Refuse limits that contradict each other or would not be looked at."""
        if self.minutes is not None and self.budget is not None:
            raise ValueError(
                f"minutes = {self.minutes:g} and budget = {self.budget} are both set; "
                "leave one of them out"
            )
        for name in ("minutes", "budget"):
            value = getattr(self, name)
            if value is not None and not self.by_pairs:
                raise ValueError(
                    f'{name} needs preset "cover" with objective "reconstructability", not '
                    f'"{self.preset}" with "{self.objective}"; change these or leave '
                    f"{name} = {value:g} out"
                )
        return self


class RouteSettings(Settings):
    """The order of the photos."""

    cost: Literal["paper", "seconds"] = "seconds"
    """What a switch from photo to photo costs: the paper's Eq. 11, or its time in flight."""
    solver: str = "two-opt"
    """Solver of family ``tour``."""
    iterations: int | None = Field(default=None, ge=1)
    """Iterations of the solver; unset: its own limit."""
    start: tuple[float, float, float] | None = None
    """Local x, y and z of a place to begin nearest to; unset: a low corner of the scene's box."""
    closed: bool = False
    """Whether the flight returns to its first photo."""
    detours: bool = True
    """Whether a leg whose straight line is blocked costs the way around."""
    rounds: int = Field(default=50, ge=1)
    """Tours at most that are made while the ways around blocked legs are found."""


class FlightSettings(Settings):
    """The curve between photos, and the flight in time."""

    speed: MetresPerSecond = Field(default=4.0, ge=0.01)
    """Greatest speed."""
    margin: Metres = Field(default=FLIGHT_MARGIN, ge=0.001)
    """What the flight keeps beyond d_min, so that rounding in written files cannot use it up."""
    handle: float = Field(default=1.0 / 3.0, gt=0.0, le=0.5)
    """Longest Bezier handle, as a share of the straight line between two photos."""
    solver: str = "rrt-connect"
    """Solver of family ``motion`` that finds ways around what blocks a leg."""
    iterations: int = Field(default=20_000, ge=10)
    """Validity checks of each search for a way around."""
    shoot: Literal["stop", "through"] = "stop"
    """Whether the aircraft rests at each photo or flies through."""
    acceleration: MetresPerSecondSquared = Field(default=2.0, ge=0.01)
    """Greatest acceleration along the curve."""
    lateral_acceleration: MetresPerSecondSquared = Field(default=2.0, ge=0.01)
    """Greatest acceleration across the curve."""
    yaw_rate_deg: DegreesPerSecond = Field(default=60.0, ge=0.01)
    """Greatest rate of yaw."""
    gimbal_rate_deg: DegreesPerSecond = Field(default=60.0, ge=0.01)
    """Greatest rate of the gimbal's pitch."""
    settle_seconds: Seconds = Field(default=1.0, ge=0.0, le=3600.0)
    """Rest before each photo with ``stop``."""
    hold_seconds: Seconds = Field(default=0.1, ge=0.0, le=3600.0)
    """Time before and after each photo that the camera keeps its angles with ``through``."""
    exposure_seconds: Seconds = Field(default=0.001, gt=0.0, le=10.0)
    """Exposure time of a photo, which bounds the speed with ``through``."""
    blur_px: Pixels = Field(default=0.5, gt=0.0)
    """Pixels of the wanted GSD that the aircraft moves in that time at most."""


class SortieSettings(Settings):
    """Flights from take-off to landing; without ``stations`` the plan is one flight."""

    stations: tuple[_Pad, ...] = ()
    """Places of take-off and landing: local x and y, and z where that is not the ground."""
    endurance_seconds: Seconds = Field(default=1500.0, gt=0.0)
    """How long a battery lasts."""
    reserve: float = Field(default=0.25, ge=0.0, lt=1.0)
    """Share of it that must be left at landing."""
    most_waypoints: int | None = Field(default=None, ge=1)
    """Waypoints of a sortie at most; unset: any number."""
    climb_speed: MetresPerSecond = Field(default=2.0, ge=0.01)
    """Speed of climbs from a station and of descents to it."""
    turnaround_seconds: Seconds = Field(default=120.0, ge=0.0)
    """Time on the ground that a sortie costs."""
    method: Literal["best", "split", "routing"] = "best"
    """Whether the tour is cut, other orders are searched, or the better of both is taken."""
    iterations: int | None = Field(default=None, ge=1)
    """Solutions that the search of other orders looks at; unset: by the number of photos."""
    connected: bool = True
    """Whether a sortie whose photos do not match in one piece takes some of other sorties too."""


class Config(Settings):
    """Everything that shapes a plan; the same config, seed and source give the same plan."""

    seed: int = Field(default=0, ge=0)
    """Root of all chance."""
    scene: SceneSettings = SceneSettings()
    camera: CameraSettings = CameraSettings()
    scale: ScaleSettings = ScaleSettings()
    surface: SurfaceSettings = SurfaceSettings()
    quality: QualitySettings = QualitySettings()
    airspace: AirspaceSettings = AirspaceSettings()
    viewpoints: ViewpointSettings = ViewpointSettings()
    route: RouteSettings = RouteSettings()
    flight: FlightSettings = FlightSettings()
    sorties: SortieSettings = SortieSettings()

    def to_toml(self) -> str:
        """Every setting as TOML; settings that are ``None`` are left out (they are derived)."""
        return toml_of(self.model_dump(mode="json", exclude_none=True))


def load_config(path: str | Path | None = None, overrides: Sequence[str] = ()) -> Config:
    """Read settings from a TOML file and from single assignments.

    Parameters
    ----------
    path
        TOML file with any part of the settings; ``None`` starts from the defaults.
    overrides
        Assignments such as ``"route.solver=ortools"``, applied after the file. A value is read as
        TOML where it is TOML and as text otherwise.

    Returns
    -------
    config
        All settings, validated.

    Raises
    ------
    PlannerError
        If the file cannot be read, or a key or value is not known; the message names it.

    """
    tree: dict[str, Any] = {}
    if path is not None:
        try:
            tree = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise PlannerError(
                f"{path}: cannot be read ({error.strerror}); check the path"
            ) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise PlannerError(f"{path}: is not valid TOML ({error}); mend that line") from None
    assigned = [assign(tree, assignment) for assignment in overrides]
    try:
        return Config.model_validate(tree)
    except ValidationError as error:
        keys, sentence = first_mistake(error, Config)
        raise PlannerError(f"{_origin(path, assigned, keys)}: {sentence}") from None


def _origin(path: str | Path | None, assigned: list[tuple[str, ...]], keys: tuple[Any, ...]) -> str:
    """Where a setting was given: in the file, on the command line, or in both."""
    if path is None or any(keys[: len(key)] == key for key in assigned):
        return "--set"
    together = any(key[: len(keys)] == keys for key in assigned)
    return f"{path} with --set" if together else str(path)
