"""In which order the photos are taken: the socket to the tour solvers."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.config import RouteSettings
from planner.errors import PlannerError
from planner.findings import Finding
from planner.geometry.angles import circular_difference_deg
from planner.geometry.arrays import Floats, Ints, read_only
from planner.route.cost import Pace, switching_cost, switching_seconds
from planner.route.exact import Lengths, Tour, exact_tour, legs_of
from planner.route.ways import FreeWays
from planner.scene.scene import Box
from planner.viewpoints.viewpoints import Viewpoints

if TYPE_CHECKING:
    from solvers.result import Result
    from solvers.tour import TourProblem


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """An order of the viewpoints and what it costs.

    Parameters
    ----------
    order
        Rows of the viewpoints in visiting order, shape (V,).
    spaces
        Part of free space that each of them lies in, in that order, shape (V,): 0 for the part
        with most viewpoints. No leg leads from one part to another, and none counts.
    closed
        Whether the tour returns to its first viewpoint; then each part has a tour that returns.
    cost
        Total switching cost: Eq. 11 summed, or seconds.
    length
        Sum of the chords, metres.
    way_length
        Sum of the shortest free ways, metres; that of the chords where no ways were asked for.
    blocked
        Legs whose chord is blocked.
    yaw_change_deg, pitch_change_deg
        Mean change a switch, degrees; yaw on the circle.
    yaw_total_deg, pitch_total_deg
        Sums of the same.
    rounds
        Solutions until each leg of the tour cost what it should, in the part that took most.
    result
        What the solver says of the part with most viewpoints, with a bound that holds for the
        true costs; ``None`` without viewpoints.
    findings
        Viewpoints in parts of free space that cannot be reached from the first.

    """

    order: Ints
    spaces: Ints
    closed: bool
    cost: float
    length: float
    way_length: float
    blocked: int
    yaw_change_deg: float
    pitch_change_deg: float
    yaw_total_deg: float
    pitch_total_deg: float
    rounds: int
    result: "Result[Ints] | None"
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        order = read_only(self.order, (None,), name="order", dtype=np.int64)
        object.__setattr__(self, "order", order)
        spaces = read_only(self.spaces, order.shape, name="spaces", dtype=np.int64)
        object.__setattr__(self, "spaces", spaces)


def order_viewpoints(
    viewpoints: Viewpoints,
    *,
    settings: RouteSettings,
    box: Box,
    seed: int,
    pace: Pace = Pace(),  # noqa: B008 - an immutable value
    ways: FreeWays | None = None,
) -> Route:
    """Order the viewpoints at the least total switching cost (paper section 3.4).

    The tour starts at the viewpoint nearest to ``settings.start`` or, without one, nearest to
    the lowest corner of the scene's box: the corner with the least coordinates along all three
    axes of the box. A closed tour is given from there too.

    Parameters
    ----------
    viewpoints
        In any order.
    settings
        Cost, solver and ends.
    box
        Bounding box of the scene.
    seed
        Root of the solver's chance.
    pace
        Speeds and rates, for costs in seconds.
    ways
        Ways through free space: a leg that is blocked costs the way around it. Without them, or
        without ``settings.detours``, every leg costs its chord.

    Returns
    -------
    route
        A permutation of the rows and its numbers. Without viewpoints it is empty.

    Raises
    ------
    PlannerError
        If the solver cannot take the problem or fails.

    """

    def costs_of(metres: Floats) -> Floats:
        if settings.cost == "paper":
            return switching_cost(viewpoints.positions, viewpoints.directions, metres)
        angles = viewpoints.yaw_deg, viewpoints.pitch_deg
        return switching_seconds(viewpoints.positions, *angles, pace=pace, lengths=metres)

    def solve_tour(costs: Floats, rows: Ints, best: Ints | None) -> "Result[Ints]":
        first = start_row(viewpoints.positions[rows], settings=settings, box=box)
        closed = settings.closed and len(rows) > 1
        return _solve(TourProblem(costs, closed, start=first), settings, seed, best)

    from solvers.tour import TourProblem

    lengths = Lengths(viewpoints.positions, ways if settings.detours else None)
    waiting, tours = [np.arange(len(viewpoints))] if len(viewpoints) else [], []
    while waiting:
        rows = waiting.pop()
        tour = exact_tour(
            rows, lengths, costs_of, solve_tour, closed=settings.closed, rounds=settings.rounds
        )
        if tour is None:
            waiting += lengths.spaces(rows)
        else:
            tours.append(tour)
    tours.sort(key=lambda tour: (-len(tour.rows), int(tour.rows.min())))
    return _measure(viewpoints, tours, costs_of(lengths.metres), lengths, settings.closed)


def _solve(
    problem: "TourProblem", settings: RouteSettings, seed: int, best: Ints | None
) -> "Result[Ints]":
    from solvers import SolverError, Stop, solve

    stop = Stop() if settings.iterations is None else Stop(iterations=settings.iterations)
    try:
        result = solve(problem, settings.solver, seed=seed, stop=stop, initial=best)
    except SolverError as error:
        words = str(error).rstrip(".")
        cure = "" if "choose another" in words else "; choose another solver"
        raise PlannerError(f"route.solver = {settings.solver!r}: {words}{cure}") from error
    if result.solution is None:  # a solver may end before its first tour
        result = solve(problem, "nearest", seed=seed)
    return result


def start_row(positions: Floats, *, settings: RouteSettings, box: Box) -> int:
    """Row of the viewpoint that the tour starts at; the lowest row where two are as near."""
    corner = box.centre - 0.5 * box.size @ box.axes
    goal = corner if settings.start is None else np.asarray(settings.start)
    return int(np.linalg.norm(positions - goal, axis=1).argmin())


def _measure(
    viewpoints: Viewpoints, tours: list[Tour], costs: Floats, lengths: Lengths, closed: bool
) -> Route:
    """Numbers of an order, worked out from the order itself."""
    none = [np.zeros(0, dtype=np.int64)]
    legs = [legs_of(tour.rows, closed=closed) for tour in tours]
    here = np.concatenate(none + [leg[0] for leg in legs])
    there = np.concatenate(none + [leg[1] for leg in legs])
    yaw, pitch = viewpoints.yaw_deg, viewpoints.pitch_deg
    turns = np.abs(circular_difference_deg(yaw[there], yaw[here])).sum()
    tilts = np.abs(pitch[there] - pitch[here]).sum()
    steps = np.linalg.norm(viewpoints.positions[there] - viewpoints.positions[here], axis=1)
    switches = max(1, len(there))
    return Route(
        order=np.concatenate(none + [tour.rows for tour in tours]),
        spaces=np.repeat(np.arange(len(tours)), [len(tour.rows) for tour in tours]),
        closed=closed and len(here) > 0,
        cost=float(costs[here, there].sum()),
        length=float(steps.sum()),
        way_length=float(lengths.metres[here, there].sum()),
        blocked=int(lengths.blocked[here, there].sum()),
        yaw_change_deg=float(turns) / switches,
        pitch_change_deg=float(tilts) / switches,
        yaw_total_deg=float(turns),
        pitch_total_deg=float(tilts),
        rounds=max((tour.rounds for tour in tours), default=0),
        result=tours[0].result if tours else None,
        findings=tuple(_apart(viewpoints, tour) for tour in tours[1:]),
    )


def _apart(viewpoints: Viewpoints, tour: Tour) -> Finding:
    x, y, z = viewpoints.positions[tour.rows[0]]
    count = len(tour.rows)
    message = (
        f"{count} viewpoint{'s' if count > 1 else ''} around ({x:.1f}, {y:.1f}, {z:.1f}) "
        "cannot be reached from the others without coming too close to something; take-off points "
        "on both sides (sorties.stations) fly them as sorties of their own"
    )
    return Finding("route", "separate-space", message, float(count))
