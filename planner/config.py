"""Settings of a plan: one frozen model a stage, strict TOML in and out."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from planner.assignment import assign
from planner.errors import PlannerError
from planner.toml_text import toml_of

FLIGHT_MARGIN = 0.002
"""What a flight keeps beyond d_min unless it is set otherwise, metres."""

_Corner = tuple[float, float]


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class SceneSettings(_Settings):
    """How the source is read and cleaned.

    ``up`` is the source's vertical axis (``auto`` follows the format: GLB is y-up, the rest z-up).
    ``unit`` is the length of one source unit in metres, or ``auto``.
    ``outlier_neighbours`` and ``outlier_sigma``: a point whose mean distance to so many neighbours
    exceeds the mean by that many standard deviations is dropped.
    ``max_points`` bounds the memory: denser clouds are thinned to it first.
    ``images`` is a file with the poses of the first flight's photos, in the source's coordinates.
    """

    up: Literal["auto", "x", "y", "z"] = "auto"
    unit: float | Literal["auto"] = "auto"
    crs: str | None = None
    outlier_neighbours: int = Field(default=16, ge=2, le=200)
    outlier_sigma: float = Field(default=5.0, gt=0.0)
    normal_neighbours: int = Field(default=16, ge=4, le=200)
    max_points: int = Field(default=4_000_000, ge=1_000)
    images: str | None = Field(default=None, min_length=1)


class CameraSettings(_Settings):
    """A pinhole camera on a gimbal; defaults: 20 megapixels, 84 degrees across the diagonal."""

    width_px: int = Field(default=5472, ge=16)
    height_px: int = Field(default=3648, ge=16)
    diagonal_deg: float = Field(default=84.0, gt=1.0, lt=170.0)
    pitch_min_deg: float = Field(default=-90.0, ge=-90.0, le=90.0)
    pitch_max_deg: float = Field(default=0.0, ge=-90.0, le=90.0)


class ScaleSettings(_Settings):
    """Lengths, metres; ``None`` derives them from the bounding box and the camera."""

    radius: float | None = Field(default=None, gt=0.0)
    radius_share: float = Field(default=0.015, gt=0.0, lt=0.2)
    gsd: float | None = Field(default=None, gt=0.0)
    d_min: float | None = Field(default=None, gt=0.0)
    d_max: float | None = Field(default=None, gt=0.0)
    voxel: float | None = Field(default=None, gt=0.0)
    poisson_depth: int | None = Field(default=None, ge=4, le=11)
    prior_noise: float | None = Field(default=None, ge=0.0)


class SurfaceSettings(_Settings):
    """Poisson surface and its samples.

    ``clusters`` is the wanted number of clusters by position and normal (``None``: one per about
    400 samples). ``trim`` is how many radii from any point the Poisson surface is dropped,
    unless nearer surface encloses it. ``walls`` stands plain walls under roof edges where no
    facade was seen, before the Poisson surface is made.
    """

    clusters: int | None = Field(default=None, ge=1)
    trim: float = Field(default=5.0, gt=0.0)
    walls: bool = True


class QualitySettings(_Settings):
    """Variants of Eqs. 1 to 5; the defaults find holes and noise best (see docs/quality.md).

    ``density_reference`` is what a count of neighbours is compared with: the ``maximum`` of all
    samples, or what is usual around and everywhere (``local``). ``roughness`` is the scale of
    the ``flatness`` smoothness, as a share of R; ``angle_deg`` that of the normals in
    ``mean`` and ``sum``. ``clip_percent`` are ignored at either end before Eq. 5.
    """

    density_weight: Literal["intended", "printed"] = "intended"
    density_reference: Literal["local", "maximum"] = "local"
    gradient: Literal["none", "smoothed", "spectral"] = "none"
    smoothness: Literal["flatness", "mean", "sum"] = "flatness"
    roughness: float = Field(default=0.06, gt=0.0)
    angle_deg: float = Field(default=30.0, gt=0.0, le=180.0)
    clip_percent: float = Field(default=1.0, ge=0.0, lt=50.0)


def _turn(a: _Corner, b: _Corner, c: _Corner) -> float:
    """Twice the signed area of a triangle."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _cross(a: _Corner, b: _Corner, c: _Corner, d: _Corner) -> bool:
    """Whether segments ab and cd cross at a point inside of both."""
    apart = _turn(a, b, c) * _turn(a, b, d), _turn(c, d, a) * _turn(c, d, b)
    return apart[0] < 0.0 and apart[1] < 0.0


class ZoneSettings(_Settings):
    """An upright prism: ``keep_out`` forbids its inside, ``keep_in`` its outside.

    ``crs`` says what the corners are: ``local`` metres, coordinates of the ``source``, or any
    reference system such as EPSG:4326, with x as easting or longitude. ``heights`` says what bottom
    and top are above: the ``local`` zero, that of the ``source``, or the ``ground``; metres.
    """

    kind: Literal["keep_out", "keep_in"] = "keep_out"
    polygon: tuple[tuple[float, float], ...] = Field(min_length=3)
    bottom: float | None = None
    top: float | None = None
    name: str = ""
    crs: str = Field(default="local", min_length=1)
    heights: Literal["local", "source", "ground"] = "local"

    @model_validator(mode="after")
    def _is_a_prism(self) -> Self:
        """Refuse what would forbid nothing, or something else than it seems to."""
        if self.bottom is not None and self.top is not None and self.bottom >= self.top:
            raise ValueError(f"bottom {self.bottom} is not below top {self.top}")
        sides = list(zip(self.polygon, (*self.polygon[1:], self.polygon[0]), strict=True))
        area = sum(a[0] * b[1] - b[0] * a[1] for a, b in sides)
        if abs(area) < (1e-6 if self.crs in {"local", "source"} else 1e-14):
            raise ValueError("the polygon has no area")
        for i, first in enumerate(sides):
            for second in sides[i + 2 : len(sides) - (i == 0)]:
                if _cross(*first, *second):
                    raise ValueError(f"sides {first} and {second} of the polygon cross")
        return self


class AirspaceSettings(_Settings):
    """No-fly hull and zones. ``ceiling`` is metres above the ground under the drone.

    ``zone_margin`` is kept from all zones and from the ceiling, metres, beyond ``flight.margin``.
    ``zone_files`` are GeoJSON files whose polygons are zones too, with ``kind``, ``bottom`` and
    ``top`` as properties, heights above ground.
    ``beyond`` is how far outside of the scene's box flight is considered, metres (``None``: d_max);
    nothing is known there, and level ground is assumed.
    ``fill_under_roofs``: what lies under a surface that faces up counts as solid down to the next
    underside or the terrain, since walls are often missing in a first flight's data.
    ``unknown = "closed"``: space that no straight line within ``seen_within_deg`` of the vertical
    led through from the open sky down to a raw point is solid too (``None``: as far as most photos
    of the first flight saw, or 60 degrees where their poses are not known).
    ``hull`` writes the no-fly hull, where the clearance is d_min, as a mesh of that format.
    ``most_cells`` bounds the memory of the grid that tells inside from outside, one byte a cell.
    """

    ceiling: float | None = Field(default=None, gt=0.0)
    zone_margin: float = Field(default=0.0, ge=0.0)
    zones: tuple[ZoneSettings, ...] = ()
    zone_files: tuple[str, ...] = ()
    beyond: float | None = Field(default=None, gt=0.0)
    fill_under_roofs: bool = True
    unknown: Literal["open", "closed"] = "open"
    seen_within_deg: float | None = Field(default=None, gt=0.0, lt=90.0)
    hull: Literal["none", "ply", "stl", "obj", "glb"] = "none"
    most_cells: int = Field(default=200_000_000, ge=1_000, le=2_000_000_000)


class ViewpointSettings(_Settings):
    """Which photos to take; ``preset`` chooses set cover or the paper's local and global views.

    Preset ``cover``: each position offers its best ``aims`` of ``aim_directions`` directions;
    each sample wants ``hits`` photos from at least ``sectors`` of ``sector_count`` direction
    sectors, the ``low_quality_share`` of worst quality ``extra_hits`` more, none at an incidence
    above ``max_incidence_deg``; a photo costs 1 + ``confidence_price`` (1 - mean confidence).

    Preset ``paper``: samples of a quality below ``score_threshold`` get local views
    (``local_views``: ``each`` its own, as printed, or only while ``unmarked``), then global
    views follow until all have ``marks`` scanned marks, at least ``exclusion_voxels`` apart.

    Preset ``smith``, to compare with: as many photos as ``views`` says (``None``: by the area),
    each moved and turned once in each of ``rounds`` so that the sum of all h up to ``target``
    grows.

    ``confidence_angle_deg`` is where the orientation term of Eq. 7 falls to 1/e.

    ``objective = "reconstructability"``: ``pair_solver`` searches the fewest photos such that a
    ``share`` of the samples that can reach it have a reconstructability h of ``target``, and
    ``sharp_views`` of the photos within the wanted GSD; with a ``budget``, the best share for so
    many photos; with ``minutes``, the best share for a flight (all sorties, with their climbs)
    that lasts no longer.
    A photo counts for h up to ``pair_range`` of the distance at which it is worth nothing.
    With ``connected``, photos are added until the view graph (``link_share``, ``link_least``,
    ``link_turn_deg``, ``link_scale``) is one component and matches so many photos of the first
    flight as ``ties`` says, where their poses are known.
    ``effort`` says from how many positions, in how many iterations (unless ``iterations`` does)
    and in how many rounds of moving the photos.
    """

    preset: Literal["cover", "paper", "smith"] = "cover"
    objective: Literal["hits", "reconstructability"] = "reconstructability"
    effort: Literal["quick", "standard", "best"] = "quick"
    target: float = Field(default=4.0, gt=0.0)
    share: float = Field(default=0.98, gt=0.0, le=1.0)
    sharp_views: int = Field(default=1, ge=0, le=20)
    budget: int | None = Field(default=None, ge=1)
    minutes: float | None = Field(default=None, gt=0.0)
    pair_range: float = Field(default=1.0, gt=0.0, le=1.0)
    pair_solver: str = "lns"
    connected: bool = True
    link_share: float = Field(default=0.3, ge=0.0, le=1.0)
    link_least: int = Field(default=15, ge=1)
    link_turn_deg: float = Field(default=40.0, gt=0.0, le=180.0)
    link_scale: float = Field(default=2.0, ge=1.0)
    ties: int = Field(default=3, ge=0)
    solver: str = "greedy"
    aims: int = Field(default=4, ge=1, le=62)
    aim_directions: int = Field(default=62, ge=1, le=64)
    hits: int = Field(default=3, ge=1, le=20)
    sectors: int = Field(default=2, ge=0, le=8)
    sector_count: int = Field(default=8, ge=1, le=64)
    extra_hits: int = Field(default=1, ge=0, le=20)
    low_quality_share: float = Field(default=0.25, ge=0.0, le=1.0)
    max_incidence_deg: float = Field(default=70.0, gt=0.0, lt=90.0)
    confidence_angle_deg: float = Field(default=30.0, gt=0.0, le=180.0)
    confidence_price: float = Field(default=0.2, ge=0.0)
    max_candidates: int = Field(default=12_000, ge=10)
    score_threshold: float = Field(default=0.1, ge=0.0, le=1.0)
    local_views: Literal["unmarked", "each"] = "unmarked"
    exclusion_voxels: int = Field(default=1, ge=0)
    marks: int = Field(default=2, ge=1)
    views: int | None = Field(default=None, ge=1)
    rounds: int = Field(default=4, ge=1)
    iterations: int | None = Field(default=None, ge=1)

    @property
    def by_pairs(self) -> bool:
        """Whether photos are chosen by what pairs of them can triangulate."""
        return self.preset == "cover" and self.objective == "reconstructability"

    @model_validator(mode="after")
    def _has_one_limit(self) -> Self:
        """Refuse limits that contradict each other or would not be looked at."""
        if self.minutes is not None and self.budget is not None:
            raise ValueError("minutes and budget are both set: leave one of them out")
        for name in ("minutes", "budget"):
            if getattr(self, name) is not None and not self.by_pairs:
                raise ValueError(f'{name} needs preset "cover", objective "reconstructability"')
        return self


class RouteSettings(_Settings):
    """The order of the photos; ``start`` is a viewpoint's local position to begin nearest to.

    ``cost`` is the paper's Eq. 11, or the seconds of the switch at the flight's speeds and rates.
    With ``detours`` a leg whose chord is blocked costs the way around; such legs are found while
    tours are made, in at most ``rounds`` solutions.
    """

    cost: Literal["paper", "seconds"] = "seconds"
    solver: str = "two-opt"
    iterations: int | None = Field(default=None, ge=1)
    start: tuple[float, float, float] | None = None
    closed: bool = False
    detours: bool = True
    rounds: int = Field(default=50, ge=1)


class FlightSettings(_Settings):
    """The curve between photos. ``handle`` is the longest Bezier handle as a share of the chord.

    ``margin`` is what the flight keeps beyond d_min, metres, so that rounding in written files
    cannot use it up. ``iterations`` bounds the validity checks of each search for a way around.

    The flight in time keeps ``speed`` (metres a second), ``acceleration`` along the curve and
    ``lateral_acceleration`` across it (metres a second squared), and the rates of yaw and gimbal
    (degrees a second). ``shoot = "stop"`` rests ``settle_seconds`` before each photo; ``"through"``
    flies on, keeps the camera's angles ``hold_seconds`` before and after each photo, and is so slow
    there that the aircraft moves at most ``blur_px`` of the wanted GSD in ``exposure_seconds``.
    """

    speed: float = Field(default=4.0, ge=0.01)
    margin: float = Field(default=FLIGHT_MARGIN, ge=0.001)
    handle: float = Field(default=1.0 / 3.0, gt=0.0, le=0.5)
    solver: str = "rrt-connect"
    iterations: int = Field(default=20_000, ge=10)
    shoot: Literal["stop", "through"] = "stop"
    acceleration: float = Field(default=2.0, ge=0.01)
    lateral_acceleration: float = Field(default=2.0, ge=0.01)
    yaw_rate_deg: float = Field(default=60.0, ge=0.01)
    gimbal_rate_deg: float = Field(default=60.0, ge=0.01)
    settle_seconds: float = Field(default=1.0, ge=0.0, le=3600.0)
    hold_seconds: float = Field(default=0.1, ge=0.0, le=3600.0)
    exposure_seconds: float = Field(default=0.001, gt=0.0, le=10.0)
    blur_px: float = Field(default=0.5, gt=0.0)


class SortieSettings(_Settings):
    """Flights from take-off to landing; without ``stations`` the plan is one flight.

    ``stations`` are places of take-off and landing: local x and y, and z where that is not the
    ground. A sortie lasts at most ``endurance_seconds`` less the share ``reserve``, has at most
    ``most_waypoints``, climbs and descends at ``climb_speed`` (metres a second), and costs
    ``turnaround_seconds`` on the ground. ``method`` cuts the tour (``split``), searches other
    orders (``routing``, which looks at ``iterations`` solutions), or takes the better. With
    ``connected`` a sortie whose photos do not hang together takes some of other sorties as well.
    """

    stations: tuple[Annotated[tuple[float, ...], Field(min_length=2, max_length=3)], ...] = ()
    endurance_seconds: float = Field(default=1500.0, gt=0.0)
    reserve: float = Field(default=0.25, ge=0.0, lt=1.0)
    most_waypoints: int | None = Field(default=None, ge=1)
    climb_speed: float = Field(default=2.0, ge=0.01)
    turnaround_seconds: float = Field(default=120.0, ge=0.0)
    method: Literal["best", "split", "routing"] = "best"
    iterations: int | None = Field(default=None, ge=1)
    connected: bool = True


class Config(_Settings):
    """Everything that shapes a plan; the same config, seed and source give the same plan."""

    seed: int = Field(default=0, ge=0)
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
    source = "--set" if path is None else str(path)
    tree: dict[str, Any] = {}
    if path is not None:
        try:
            tree = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise PlannerError(
                f"{path}: cannot be read ({error.strerror}); check the path"
            ) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise PlannerError(f"{path}: is not valid TOML ({error}); mend that line") from None
    for assignment in overrides:
        assign(tree, assignment)
    try:
        return Config.model_validate(tree)
    except ValidationError as error:
        raise PlannerError(f"{source}: {_first_fault(error)}") from None


def _first_fault(error: ValidationError) -> str:
    """Say the first thing that is wrong with the settings, and how to mend it, in one line."""
    fault = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "extra_forbidden":
        table: Any = Config()
        for part in fault["loc"][:-1]:
            table = getattr(table, str(part), None)
        known = (
            ", ".join(type(table).model_fields) if isinstance(table, BaseModel) else "fewer keys"
        )
        return f"unknown setting {where}; known here: {known}"
    return f"setting {where} = {fault['input']!r} is refused ({fault['msg']}); change or remove it"
