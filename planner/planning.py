"""From a coarse model to a certified flight: the stages, in the order of the paper's section 3."""

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from planner.airspace.airspace import Airspace
from planner.airspace.room import idle_zones
from planner.attempts import Mapper, study
from planner.budget import TimeLimit, best_outing
from planner.clock import Clock, Listener
from planner.config import Config
from planner.findings import Finding
from planner.flight.fly import Flight
from planner.flight.sampling import sample_path
from planner.flight.timing import Timeline
from planner.foresight import refuse_settings
from planner.geometry.arrays import Floats
from planner.missions.written import WrittenPlan, load_plan
from planner.route.order import Route
from planner.scale import Scale
from planner.scene.scene import Scene
from planner.sorties.sorties import Sorties
from planner.sorties.station import find_stations, outside_scan
from planner.surface.samples import ScoredSamples, Surface
from planner.viewpoints.selection import Selection
from planner.viewpoints.viewpoints import Viewpoints


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
        Viewpoints that are flown, in visiting order; those of other parts of free space, which
        only sorties reach, come last.
    route
        Costs of the order.
    flight
        The certified curve.
    timeline
        The curve in time.
    rows
        Points of the flight, as ``path.csv`` holds them, shape (n, 7).
    lost
        Places of chosen photos that no safe flight reaches, shape (n, 3), metres.
    findings
        What the reader must know.
    timing
        Seconds of each stage.
    sorties
        Flights from take-off to landing, where stations are given.
    limit
        What a limit on the minutes of flight did, where there is one.

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
    lost: Floats
    findings: tuple[Finding, ...]
    timing: dict[str, float] = field(default_factory=dict)
    sorties: Sorties | None = None
    limit: TimeLimit | None = None

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
    TypeError
        If ``config`` is no :class:`Config`.

    """
    config = Config() if config is None else config
    if not isinstance(config, Config):
        raise TypeError(f"config must be a Config, as load_config reads it, got {config!r}.")
    config = refuse_settings(config)
    clock = Clock(listener)
    prior = study(source, config, clock)
    config = prior.config
    stations = find_stations(
        config.sorties.stations,
        prior.airspace,
        prior.airspace.terrain.height,
        margin=config.flight.margin,
        remedy="move it"
        if config.airspace.unknown == "open"
        else 'move it to where the scan has points, or set airspace.unknown = "open"',
    )
    outing, limit = best_outing(prior, stations, config, map, clock)
    tried, flight, timeline = outing.tried, outing.flight, outing.timeline
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
        viewpoints=outing.viewpoints,
        route=tried.route,
        flight=flight,
        timeline=timeline,
        rows=rows,
        lost=tried.lost,
        findings=(
            *idle_zones(prior.airspace),
            *outside_scan(stations, prior.airspace.obstacle_distance, prior.scale.d_min),
            *tried.selection.findings,
            *tried.findings,
            *(limit.findings if limit is not None else ()),
        ),
        timing=clock.seconds,
        sorties=outing.sorties,
        limit=limit,
    )
