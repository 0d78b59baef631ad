"""The stages one after the other: what is known, and one choice of photos with its flight."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner.airspace.airspace import Airspace, build_airspace
from planner.airspace.candidates import candidate_positions
from planner.airspace.room import lack_of_room
from planner.airspace.zone_files import local_zones
from planner.clock import Clock
from planner.config import Config
from planner.errors import PlannerError, Unattainable
from planner.findings import Finding
from planner.flight.fly import Flight, plan_flight
from planner.foresight import refuse_place
from planner.geometry.arrays import Floats, Ints
from planner.route.cost import Pace
from planner.route.order import Route, order_viewpoints
from planner.route.ways import FreeWays
from planner.scale import Scale, derive_scale
from planner.scene.load import load_scene, with_images
from planner.scene.scene import Scene
from planner.sorties.parts import Part, parts_left, parts_to_fly
from planner.sorties.station import Station
from planner.surface.quality import score_quality
from planner.surface.reconstruct import other_samples, reconstruct_surface
from planner.surface.samples import ScoredSamples, Surface, SurfaceSamples
from planner.viewpoints.camera import Camera, camera_of
from planner.viewpoints.select import select_viewpoints
from planner.viewpoints.selection import Selection, reassess
from planner.viewpoints.viewpoints import Viewpoints

_GUARDS = 5  # of the chance in this stage
_DRAWS = 4  # samples that guard the photos, for each that they are planned by

Mapper = Callable[..., Any]
"""``map`` and what looks like it."""


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
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
    guards: SurfaceSamples | None

    @property
    def reference(self) -> float:
        """Distance at which a photo is worth nothing, metres: twice what just meets the GSD."""
        return 2.0 * self.scale.gsd * self.camera.focal_px

    def need(self, count: int, complaint: str, *, first: str = "") -> None:
        """Refuse to go on with nothing; ``first`` is what to try before all else."""
        if not count:
            raise Unattainable(
                f"{self.scene.source or self.scene.name}: {complaint} "
                f"(d_min {self.scale.d_min:.4g} m, d_max {self.scale.d_max:.4g} m); "
                f"{first}change scale.d_min, scale.gsd or the zones"
            )


def study(source: Scene | str | Path, config: Config, clock: Clock) -> Prior:
    """Read the scene, score what is known of it, and find where the drone may be."""
    with clock.stage("scene"):
        if isinstance(source, Scene):
            scene = with_images(source, config.scene)
        else:
            scene = load_scene(source, config.scene)
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
    refuse_place(config, scene, scale)
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
        guards = _guards(surface, scene, config)
    with clock.stage("quality"):
        samples = score_quality(
            surface.samples, scene.cloud, thinned=surface.thinned, settings=config.quality
        )
    with clock.stage("airspace"):
        airspace = build_airspace(
            scene, surface.mesh, d_min=scale.d_min, d_max=scale.d_max, settings=config.airspace
        )
        grid = candidate_positions(
            airspace,
            box=scene.box,
            voxel=scale.voxel,
            limit=config.viewpoints.max_candidates,
            margin=config.flight.margin,
        )
        clock.tell(f"{len(grid.positions):,} free positions, {grid.voxel:.3g} m apart")
    known = (config, scene, camera, scale, surface, samples, airspace)
    prior = Prior(*known, grid.positions, grid.voxel, guards)
    if not len(grid.positions):
        lack = lack_of_room(airspace, margin=config.flight.margin)
        prior.need(0, f"no position is free and near enough: {lack}")
    return prior


def _guards(surface: Surface, scene: Scene, config: Config) -> SurfaceSamples | None:
    """Other samples of the surface, where the fewest photos for a share are sought by pairs."""
    if not config.viewpoints.by_pairs or config.viewpoints.budget is not None:
        return None
    draw = np.random.SeedSequence(config.seed, spawn_key=(_GUARDS,))
    seeds = draw.generate_state(_DRAWS).tolist()
    return other_samples(surface, scene.ground, settings=config.surface, seeds=seeds)


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """One choice of photos with the flights through them: one a part of free space.

    Parts whose flight keeps no photo are left out; the findings tell of them too.
    """

    selection: Selection
    route: Route
    flights: tuple[Flight, ...]
    parts: tuple[Part, ...]
    chosen: Viewpoints
    findings: tuple[Finding, ...]

    @property
    def kept(self) -> Ints:
        """Rows of the chosen viewpoints that are flown, flight after flight."""
        return np.concatenate([flight.kept for flight in self.flights])

    @property
    def viewpoints(self) -> Viewpoints:
        """All that are flown, flight after flight, where they are flown."""
        first, *others = (flight.viewpoints for flight in self.flights)
        for views in others:
            first = first.joined(views)
        return first

    @property
    def dropped(self) -> int:
        """Number of chosen viewpoints that no safe flight reaches."""
        return len(self.chosen) - len(self.kept)

    @property
    def lost(self) -> Floats:
        """Places of the chosen viewpoints that are not flown, shape (n, 3), metres."""
        return np.delete(self.chosen.positions, self.kept, axis=0)

    @property
    def astray(self) -> Floats:
        """Those of ``lost`` in parts of free space that are flown, shape (n, 3), metres."""
        spaces = self.route.spaces
        lost = np.delete(np.arange(len(spaces)), self.kept)
        return self.chosen.positions[lost[np.isin(spaces[lost], spaces[self.kept])]]

    @property
    def matches(self) -> Ints:
        """Pairs of photos that can be matched, numbered as the flight does, shape (E, 2)."""
        edges = self.selection.graph.edges
        if self.dropped:
            return edges  # the flown photos were assessed again, in flying order
        place = np.empty(len(self.chosen), dtype=np.int64)
        place[self.route.order[self.kept]] = np.arange(len(self.chosen))
        return np.asarray(place[edges])

    @property
    def covered(self) -> int:
        """Number of samples that the flown photos cover."""
        return self.selection.reason_counts()["covered"]


def attempt(
    prior: Prior,
    positions: Floats,
    config: Config,
    spread: Mapper,
    clock: Clock,
    *,
    stations: tuple[Station, ...] = (),
) -> Attempt:
    """Choose photos among these positions, order them, and fly through them."""
    scale, mesh, samples = prior.scale, prior.surface.mesh, prior.samples
    distances = {"d_min": scale.d_min, "d_max": scale.d_max, "gsd": scale.gsd}
    with solver_words():
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
                margin=config.flight.margin,
                images=prior.scene.images,
                guards=prior.guards,
            )
            clock.tell(f"{len(selection.viewpoints)} viewpoints")
        _need_photos(prior, selection, config)
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
            unit = " s" if config.route.cost == "seconds" else ""
            clock.tell(f"length {route.way_length:.0f} m, switching cost {route.cost:.3f}{unit}")
        with clock.stage("flight"):
            parts = parts_to_fly(route.spaces, chosen.positions, stations, ways)
            flights = [
                plan_flight(
                    chosen,
                    prior.airspace,
                    settings=config.flight,
                    closed=config.route.closed,
                    seed=config.seed,
                    ways=ways,
                    only=part.rows,
                )
                for part in parts
            ]
            flown = [k for k, flight in enumerate(flights) if len(flight.kept)]
            prior.need(len(flown), "no photo can be flown to safely")
            pieces = sum(len(flight.path) for flight in flights)
            repaired = sum(len(flight.repaired) for flight in flights)
            clock.tell(f"{pieces} certified pieces, {repaired} legs repaired")
    searches = [result for flight in flights for result in flight.results]
    stop_if_interrupted((*selection.results, route.result, *searches))
    tried = Attempt(
        selection,
        route,
        tuple(flights[k] for k in flown),
        tuple(parts[k] for k in flown),
        chosen,
        _told(route, chosen, parts, flights),
    )
    if tried.dropped:
        selection = reassess(
            selection,
            tried.viewpoints,
            mesh,
            samples,
            prior.camera,
            settings=config.viewpoints,
            **distances,
            images=prior.scene.images,
        )
        tried = replace(tried, selection=selection)
    return tried


def _need_photos(prior: Prior, selection: Selection, config: Config) -> None:
    """Refuse to go on without photos, naming the target only where it decides."""
    complaint, first = f"preset {config.viewpoints.preset!r} finds no photo worth taking", ""
    if not selection.wish.stages[3].any():
        complaint = "no free position sees any of the surface"
    elif selection.wish.pairs is not None:
        wanted = f"viewpoints.target {selection.wish.pairs.target:g}"
        complaint = f"no photos that are possible reach {wanted}"
        first = "lower viewpoints.target, or "
    prior.need(len(selection.viewpoints), complaint, first=first)


def _told(
    route: Route, chosen: Viewpoints, parts: tuple[Part, ...], flights: list[Flight]
) -> tuple[Finding, ...]:
    """Which parts of space are not flown, if that cost viewpoints, and what the flights say."""
    dropped = len(chosen) - sum(len(flight.kept) for flight in flights)
    left = parts_left(route.spaces, chosen.positions, parts, route.findings) if dropped else ()
    return (*left, *(finding for flight in flights for finding in flight.findings))


def refilled(
    tried: Attempt,
    prior: Prior,
    config: Config,
    spread: Mapper,
    clock: Clock,
    *,
    stations: tuple[Station, ...] = (),
) -> Attempt:
    """Try once more without the places that could not be flown to; keep what covers more.

    Where all that was lost is a part of free space that cannot be reached, other photos in there
    would be lost as well, so nothing else is tried.
    """
    if not len(tried.astray):
        return tried
    try:
        places = _away_from(prior.positions, tried.astray)
        again = attempt(prior, places, config, spread, clock, stations=stations)
    except PlannerError as error:
        clock.tell(f"no second choice of photos: {error}")
        return tried
    return max(again, tried, key=lambda attempt: (attempt.covered, -attempt.dropped))


def _away_from(positions: Floats, places: Floats) -> Floats:
    """Positions without the nearest one to each of these places: photos are moved about them."""
    from scipy.spatial import cKDTree

    return np.delete(positions, cKDTree(positions).query(places)[1], axis=0)


@contextmanager
def solver_words() -> Iterator[None]:
    """Pass on what a solver refuses or fails at in one line."""
    from solvers import SolverError

    try:
        yield
    except SolverError as error:
        raise PlannerError(f"a solver gave up ({error}); choose another") from error


def stop_if_interrupted(results: Iterable[Any]) -> None:
    """End the plan if a solver was interrupted: its answer is only what it had by then."""
    from solvers import StopReason

    if any(
        result is not None and result.stop_reason is StopReason.INTERRUPTED for result in results
    ):
        raise KeyboardInterrupt
