"""In which order the photos are taken: the socket to the tour solvers."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.config import RouteSettings
from planner.geometry.angles import circular_difference_deg
from planner.geometry.arrays import Floats, Ints, read_only
from planner.route.cost import switching_cost, switching_seconds
from planner.scene.scene import Box
from planner.viewpoints.viewpoints import Viewpoints

if TYPE_CHECKING:
    from solvers.result import Result


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """An order of the viewpoints and what it costs.

    Parameters
    ----------
    order
        Rows of the viewpoints in visiting order, shape (V,).
    closed
        Whether the tour returns to its first viewpoint.
    cost
        Total switching cost: Eq. 11 summed, or seconds.
    length
        Straight length of the tour, metres.
    yaw_change_deg, pitch_change_deg
        Mean change a switch, degrees; yaw on the circle.
    yaw_total_deg, pitch_total_deg
        Sums of the same.
    result
        What the solver says, its bound included; ``None`` without viewpoints.

    """

    order: Ints
    closed: bool
    cost: float
    length: float
    yaw_change_deg: float
    pitch_change_deg: float
    yaw_total_deg: float
    pitch_total_deg: float
    result: "Result[Ints] | None"

    def __post_init__(self) -> None:
        order = read_only(self.order, (None,), name="order", dtype=np.int64)
        object.__setattr__(self, "order", order)


def order_viewpoints(
    viewpoints: Viewpoints, *, settings: RouteSettings, box: Box, seed: int
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

    Returns
    -------
    route
        A permutation of the rows and its numbers. Without viewpoints it is empty.

    """
    costs = _costs(viewpoints, settings)
    if len(viewpoints) == 0:
        return _measure(viewpoints, np.zeros(0, dtype=np.int64), costs, settings.closed, None)
    from solvers import Stop, solve
    from solvers.tour import TourProblem

    first = start_row(viewpoints.positions, settings=settings, box=box)
    closed = settings.closed and len(viewpoints) > 1
    problem = TourProblem(costs, closed, start=first)
    stop = Stop() if settings.iterations is None else Stop(iterations=settings.iterations)
    result = solve(problem, settings.solver, seed=seed, stop=stop)
    if result.solution is None:  # a solver may end before its first tour
        result = solve(problem, "nearest", seed=seed)
    order = np.arange(len(viewpoints)) if result.solution is None else result.solution
    return _measure(viewpoints, order, costs, closed, result)


def start_row(positions: Floats, *, settings: RouteSettings, box: Box) -> int:
    """Row of the viewpoint that the tour starts at; the lowest row where two are as near."""
    corner = box.centre - 0.5 * box.size @ box.axes
    goal = corner if settings.start is None else np.asarray(settings.start)
    return int(np.linalg.norm(positions - goal, axis=1).argmin())


def _costs(viewpoints: Viewpoints, settings: RouteSettings) -> Floats:
    if settings.cost == "paper":
        return switching_cost(viewpoints.positions, viewpoints.directions)
    return switching_seconds(
        viewpoints.positions,
        viewpoints.yaw_deg,
        viewpoints.pitch_deg,
        speed=settings.speed,
        turn_rate_deg=settings.turn_rate_deg,
        stop_seconds=settings.stop_seconds,
    )


def _measure(
    viewpoints: Viewpoints,
    order: Ints,
    costs: Floats,
    closed: bool,
    result: "Result[Ints] | None",
) -> Route:
    """Numbers of an order, worked out from the order itself."""
    there = np.concatenate([order[1:], order[:1] if closed else order[:0]])
    here = order[: len(there)]
    yaw, pitch = viewpoints.yaw_deg, viewpoints.pitch_deg
    turns = np.abs(circular_difference_deg(yaw[there], yaw[here])).sum()
    tilts = np.abs(pitch[there] - pitch[here]).sum()
    steps = np.linalg.norm(viewpoints.positions[there] - viewpoints.positions[here], axis=1)
    switches = max(1, len(there))
    return Route(
        order=order,
        closed=closed,
        cost=float(costs[here, there].sum()),
        length=float(steps.sum()),
        yaw_change_deg=float(turns) / switches,
        pitch_change_deg=float(tilts) / switches,
        yaw_total_deg=float(turns),
        pitch_total_deg=float(tilts),
        result=result,
    )
