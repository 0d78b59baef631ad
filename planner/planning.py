"""From a coarse model to a certified flight: the stages, in the order of the paper's section 3."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from planner.airspace.airspace import Airspace, build_airspace
from planner.airspace.candidates import candidate_positions
from planner.airspace.room import idle_zones, lack_of_room
from planner.airspace.zone_files import local_zones
from planner.config import CameraSettings, Config
from planner.errors import MissingDependency, PlannerError
from planner.findings import Finding
from planner.flight.fly import Flight, plan_flight
from planner.flight.limits import Limits
from planner.flight.sampling import sample_path
from planner.flight.timing import Timeline, fly_in_time
from planner.geometry.arrays import Floats, Ints
from planner.missions.written import WrittenPlan, load_plan
from planner.route.cost import Pace
from planner.route.order import Route, order_viewpoints
from planner.route.ways import FreeWays
from planner.scale import Scale, derive_scale
from planner.scene.load import load_scene
from planner.scene.scene import Scene
from planner.sorties.schedule import Sorties, plan_sorties
from planner.sorties.station import find_stations
from planner.surface.quality import score_quality
from planner.surface.reconstruct import reconstruct_surface
from planner.surface.samples import ScoredSamples, Surface
from planner.viewpoints.camera import Camera
from planner.viewpoints.select import select_viewpoints
from planner.viewpoints.selection import Selection, reassess
from planner.viewpoints.viewpoints import Viewpoints

SAME_PLACE = 1e-3
"""Positions nearer to each other than this, metres, are one: they differ by rounding."""

Listener = Callable[[str, str], None]
Mapper = Callable[..., Any]


class PlanStatus(StrEnum):
    """Whether the plan does all that was asked."""

    COMPLETE = "complete"
    PARTIAL = "partial"


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A flight plan and everything that it follows from.

    Parameters
    ----------
    config
        Settings as given.
    scene
        The place.
    scale
        Lengths with their rules.
    surface, samples
        Surface, and its samples with quality.
    airspace
        Where the drone may be.
    selection
        Chosen viewpoints with what they cover, before ordering.
    viewpoints
        Viewpoints that are flown, in visiting order.
    route
        Costs of the order.
    flight
        The certified curve.
    timeline
        The curve in time.
    rows
        Points of the flight, as ``path.csv`` holds them, shape (n, 7).
    findings
        What the reader must know.
    timing
        Seconds of each stage.
    sorties
        Flights from take-off to landing, where stations are given.

    """

    config: Config
    scene: Scene
    scale: Scale
    surface: Surface
    samples: ScoredSamples
    airspace: Airspace
    selection: Selection
    viewpoints: Viewpoints
    route: Route
    flight: Flight
    timeline: Timeline
    rows: Floats
    findings: tuple[Finding, ...]
    timing: dict[str, float] = field(default_factory=dict)
    sorties: Sorties | None = None

    @property
    def status(self) -> PlanStatus:
        """COMPLETE unless a finding says that something asked for is not done."""
        partial = any(finding.partial for finding in self.findings)
        return PlanStatus.PARTIAL if partial else PlanStatus.COMPLETE

    def save(self, folder: str | Path, *, overwrite: bool = False) -> None:
        """Write the plan folder, whole or not at all, after proving the written files safe.

        Raises
        ------
        PlannerError
            If the folder exists, cannot be written, or the written plan fails its check.

        """
        from planner.report.folder import save_plan

        save_plan(self, folder, overwrite=overwrite)

    @staticmethod
    def load(folder: str | Path) -> WrittenPlan:
        """Read a written plan back; see :func:`planner.missions.written.load_plan`."""
        return load_plan(folder)


def camera_of(settings: CameraSettings) -> Camera:
    """Camera that the settings describe."""
    return Camera.from_field_of_view(**settings.model_dump())


def plan(
    source: Scene | str | Path,
    config: Config | None = None,
    *,
    map: Mapper = map,  # noqa: A002  (it is a map)
    listener: Listener | None = None,
) -> Plan:
    """Plan the flight that photographs all of a scene well enough to reconstruct it.

    Parameters
    ----------
    source
        A scene, or the path of a cloud, mesh or city model.
    config
        Settings; the defaults need no lengths.
    map
        ``map``, or anything that looks like it, to spread independent work.
    listener
        Called with a stage's name and one sentence when it starts or has something to say.

    Returns
    -------
    plan
        COMPLETE, or PARTIAL with findings. Every curve in it is certified.

    Raises
    ------
    PlannerError
        If the source or a setting must be changed first.

    """
    config = Config() if config is None else config
    _require_solvers(config)
    clock = _Clock(listener)
    prior = _study(source, config, clock)
    config = prior.config
    stations = find_stations(
        config.sorties.stations,
        prior.airspace,
        prior.airspace.terrain.height,
        margin=config.flight.margin,
    )
    tried = _attempt(prior, prior.positions, config, map, clock)
    if tried.dropped:
        tried = _refilled(tried, prior, config, map, clock)
    flight, sorties = tried.flight, None
    limits = Limits.of(config.flight, gsd=prior.scale.gsd)
    timeline = fly_in_time(flight.path, flight.viewpoints, limits)
    if stations:
        with clock.stage("sorties"), _solver_words():
            sorties = plan_sorties(
                flight,
                timeline,
                stations,
                prior.airspace,
                tried.matches,
                settings=config.sorties,
                flight_settings=config.flight,
                seed=config.seed,
            )
            flight, timeline = sorties.flight, sorties.timeline
            clock.tell(f"{len(sorties.flown)} sorties, {sorties.seconds[sorties.method]:.0f} s")
    with clock.stage("timing"):
        rows = sample_path(timeline, d_min=prior.scale.d_min)
        clock.tell(f"{timeline.duration:.0f} s, {len(rows)} rows")
    return Plan(
        config=config,
        scene=prior.scene,
        scale=prior.scale,
        surface=prior.surface,
        samples=prior.samples,
        airspace=prior.airspace,
        selection=tried.selection,
        viewpoints=flight.viewpoints,
        route=tried.route,
        flight=flight,
        timeline=timeline,
        rows=rows,
        findings=(
            *idle_zones(prior.airspace),
            *tried.selection.findings,
            *tried.apart,
            *tried.flight.findings,
        ),
        timing=clock.seconds,
        sorties=sorties,
    )


def _require_solvers(config: Config) -> None:
    """Refuse solvers that are not known or not installed before any work is done."""
    from solvers import SolverError, SolverUnavailable
    from solvers.registry import load, require

    for setting, family, name in (
        ("viewpoints.solver", "cover", config.viewpoints.solver),
        ("route.solver", "tour", config.route.solver),
        ("flight.solver", "motion", config.flight.solver),
        ("viewpoints.pair_solver", "pairs", config.viewpoints.pair_solver),
    ):
        try:
            require(load(family, name))
        except SolverUnavailable as error:
            raise MissingDependency(f"{setting}: {error}") from error
        except SolverError as error:
            raise PlannerError(f"{setting} = {name!r}: {error}") from error


@dataclass(frozen=True, slots=True, eq=False)
class _Prior:
    """What is known before photos are chosen (paper sections 3.2 and 3.3.1)."""

    config: Config
    scene: Scene
    camera: Camera
    scale: Scale
    surface: Surface
    samples: ScoredSamples
    airspace: Airspace
    positions: Floats
    voxel: float

    def need(self, count: int, complaint: str) -> None:
        """Refuse to go on with nothing."""
        if not count:
            raise PlannerError(
                f"{self.scene.source or self.scene.name}: {complaint} "
                f"(d_min {self.scale.d_min:.4g} m, d_max {self.scale.d_max:.4g} m); "
                "change scale.d_min, scale.gsd or the zones"
            )


def _study(source: Scene | str | Path, config: Config, clock: "_Clock") -> _Prior:
    """Read the scene, score what is known of it, and find where the drone may be."""
    with clock.stage("scene"):
        scene = source if isinstance(source, Scene) else load_scene(source, config.scene)
        size = " x ".join(f"{length:.1f}" for length in scene.box.size)
        clock.tell(f"{len(scene.cloud):,} points, {size} m")
        for note in scene.notes:
            clock.tell(note)
        local = local_zones(config.airspace, scene)
        config = config.model_copy(update={"airspace": local})
    camera = camera_of(config.camera)
    scale = derive_scale(scene, camera, config.scale)
    for rule in scale.rules:
        clock.tell(f"{rule.name} = {rule.value:.4g} {rule.unit} ({rule.because})")
    with clock.stage("surface"):
        surface = reconstruct_surface(
            scene,
            radius=scale.radius,
            poisson_depth=scale.poisson_depth,
            settings=config.surface,
            normal_neighbours=config.scene.normal_neighbours,
            seed=config.seed,
        )
        clock.tell(f"{len(surface.samples):,} samples on {len(surface.mesh):,} triangles")
    with clock.stage("quality"):
        samples = score_quality(
            surface.samples, scene.cloud, thinned=surface.thinned, settings=config.quality
        )
    with clock.stage("airspace"):
        airspace = build_airspace(
            scene, surface.mesh, d_min=scale.d_min, d_max=scale.d_max, settings=config.airspace
        )
        grid = candidate_positions(
            airspace, box=scene.box, voxel=scale.voxel, limit=config.viewpoints.max_candidates
        )
        clock.tell(f"{len(grid.positions):,} free positions, {grid.voxel:.3g} m apart")
    known = (config, scene, camera, scale, surface, samples, airspace)
    prior = _Prior(*known, grid.positions, grid.voxel)
    if not len(grid.positions):
        prior.need(0, f"no position is free and near enough: {lack_of_room(airspace)}")
    return prior


@contextmanager
def _solver_words() -> Iterator[None]:
    """Pass on what a solver refuses or fails at in one line."""
    from solvers import SolverError

    try:
        yield
    except SolverError as error:
        raise PlannerError(f"a solver gave up ({error}); choose another") from error


def _stop_if_interrupted(results: Iterable[Any]) -> None:
    """End the plan if a solver was interrupted: its answer is only what it had by then."""
    from solvers import StopReason

    if any(
        result is not None and result.stop_reason is StopReason.INTERRUPTED for result in results
    ):
        raise KeyboardInterrupt


@dataclass(frozen=True, slots=True, eq=False)
class _Attempt:
    """One choice of photos with the flight through them."""

    selection: Selection
    route: Route
    flight: Flight
    chosen: Viewpoints

    @property
    def dropped(self) -> int:
        """Number of chosen viewpoints that no safe flight reaches."""
        return len(self.chosen) - len(self.flight.kept)

    @property
    def apart(self) -> tuple[Finding, ...]:
        """Which parts of space are separate, if that cost viewpoints."""
        return self.route.findings if self.dropped else ()

    @property
    def matches(self) -> Ints:
        """Pairs of photos that can be matched, numbered as the flight does, shape (E, 2)."""
        edges = self.selection.graph.edges
        if self.dropped:
            return edges  # the flown photos were assessed again, in flying order
        place = np.empty(len(self.chosen), dtype=np.int64)
        place[self.route.order[self.flight.kept]] = np.arange(len(self.chosen))
        return np.asarray(place[edges])

    @property
    def covered(self) -> int:
        """Number of samples that the flown photos cover."""
        return self.selection.reason_counts()["covered"]


def _attempt(
    prior: _Prior, positions: Floats, config: Config, spread: Mapper, clock: "_Clock"
) -> _Attempt:
    """Choose photos among these positions, order them, and fly through them."""
    scale, mesh, samples = prior.scale, prior.surface.mesh, prior.samples
    distances = {"d_min": scale.d_min, "d_max": scale.d_max, "gsd": scale.gsd}
    with _solver_words():
        with clock.stage("viewpoints"):
            selection = select_viewpoints(
                positions,
                mesh,
                samples,
                prior.camera,
                settings=config.viewpoints,
                **distances,
                voxel=prior.voxel,
                seed=config.seed,
                map=spread,
                airspace=prior.airspace,
            )
            clock.tell(f"{len(selection.viewpoints)} viewpoints")
        prior.need(len(selection.viewpoints), "no free position sees any of the surface")
        with clock.stage("route"):
            chosen = selection.viewpoints.rounded()
            ways = FreeWays(prior.airspace, margin=config.flight.margin)
            route = order_viewpoints(
                chosen,
                settings=config.route,
                box=prior.scene.box,
                seed=config.seed,
                pace=Pace.of(config.flight),
                ways=ways,
            )
            chosen = chosen.take(route.order)
            clock.tell(f"length {route.way_length:.0f} m, switching cost {route.cost:.3f}")
        with clock.stage("flight"):
            flight = plan_flight(
                chosen,
                prior.airspace,
                settings=config.flight,
                closed=config.route.closed,
                seed=config.seed,
                ways=ways,
            )
            prior.need(len(flight.kept), "no photo can be flown to safely")
            clock.tell(f"{len(flight.path)} certified pieces, {len(flight.repaired)} legs repaired")
    _stop_if_interrupted((*selection.results, route.result, *flight.results))
    if len(flight.kept) < len(chosen):
        selection = reassess(
            selection,
            flight.viewpoints,
            mesh,
            samples,
            prior.camera,
            settings=config.viewpoints,
            **distances,
        )
    return _Attempt(selection, route, flight, chosen)


def _refilled(
    tried: _Attempt, prior: _Prior, config: Config, spread: Mapper, clock: "_Clock"
) -> _Attempt:
    """Try once more without the places that could not be flown to; keep what covers more."""
    try:
        again = _attempt(prior, _away_from(prior.positions, tried), config, spread, clock)
    except PlannerError as error:
        clock.tell(f"no second choice of photos: {error}")
        return tried
    return max(again, tried, key=lambda attempt: (attempt.covered, -attempt.dropped))


def _away_from(positions: Floats, tried: _Attempt) -> Floats:
    """Positions without those that were chosen and could not be flown to."""
    from scipy.spatial import cKDTree

    dropped = np.delete(tried.chosen.positions, tried.flight.kept, axis=0)
    near = np.asarray(cKDTree(dropped).query(positions)[0])
    return positions[near > SAME_PLACE]


class _Clock:
    """Times stages and passes on what they say."""

    def __init__(self, listener: Listener | None) -> None:
        self._listener = listener
        self._stage = "plan"
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time one stage."""
        self._stage = name
        self.tell("")
        start = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def tell(self, sentence: str) -> None:
        """Pass a sentence of the running stage to the listener."""
        if self._listener is not None:
            self._listener(self._stage, sentence)
