"""Lead a leg around what stands in its way: the socket to the motion solvers."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.airspace.space import Space
from planner.config import FlightSettings
from planner.flight.path import JOINT_DECIMALS
from planner.geometry.arrays import Floats
from planner.route.ways import FreeWay

if TYPE_CHECKING:
    from solvers.motion import MotionProblem
    from solvers.result import Result

NEARBY = 0.3
"""Margin of the box that is searched first, as a share of the chord."""

GLANCE = 0.1
"""Share of the validity checks that the search of that box may take."""

POLISH = 0.01
"""Share of the validity checks that looking for a shorter way than a known one may take."""


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """Outcome of the search for a way around.

    Parameters
    ----------
    points
        Corners from the leg's start to its end, shape (n, 3), metres, or ``None`` without any.
    results
        What the solver said, one result a search.

    """

    points: Floats | None
    results: "tuple[Result[Floats], ...]"


def find_way(
    start: Floats,
    end: Floats,
    airspace: Space,
    *,
    settings: FlightSettings,
    seed: int,
    guess: FreeWay | None = None,
) -> Way:
    """Search for a polyline that keeps its distance, by a motion solver with exact edge checks.

    A box around the two places is searched first, as ways are shorter there, then all of the
    space. A way that is known is where the solver starts: it may shorten it or find another one
    nearby, but never answers with a longer one. The dice depend on the two places and the seed
    alone, and the way back is the way there: so neither the order of the legs nor what else is
    flown changes the result.

    Parameters
    ----------
    start, end
        Free points, shape (3,), metres.
    airspace
        Solids and zones.
    settings
        Margin, name of the solver and its number of validity checks.
    seed
        Root of all chance.
    guess
        What the roadmap knows. If that is that there is no way, only the box is searched.

    Returns
    -------
    way
        Its points are ``None`` if the solver found nothing within its checks.

    """
    swapped = tuple(end) < tuple(start)
    first, last = (end, start) if swapped else (start, end)
    known = guess.points if guess is not None else None
    if known is not None and swapped:
        known = known[::-1]
    results = _search(
        first,
        last,
        airspace,
        settings,
        _seed(first, last, seed),
        known=known,
        apart=guess is not None and guess.apart,
    )
    points = results[-1].solution
    if points is not None and swapped:
        points = points[::-1]
    return Way(points, tuple(results))


def _search(
    first: Floats,
    last: Floats,
    airspace: Space,
    settings: FlightSettings,
    seed: int,
    *,
    known: Floats | None,
    apart: bool,
) -> "list[Result[Floats]]":
    """Results of the searches nearby and, if there is no way, everywhere."""
    from solvers import Stop, solve
    from solvers.motion import MotionProblem

    required, margin = airspace.d_min + settings.margin, settings.margin
    around = np.stack([first, last]) if known is None else known
    ends = np.stack([around.min(axis=0), around.max(axis=0)])
    pad = max(NEARBY * float(np.linalg.norm(last - first)), 6.0 * required)
    low, high = np.minimum(airspace.bounds[0], ends[0]), np.maximum(airspace.bounds[1], ends[1])
    near = np.stack([np.maximum(low, ends[0] - pad), np.minimum(high, ends[1] + pad)])
    results = []
    glance = max(1, int((GLANCE if known is None else POLISH) * settings.iterations))
    for box, checks in ((near, glance), (np.stack([low, high]), settings.iterations)):
        problem = MotionProblem(
            first,
            last,
            box,
            lambda point: point_is_free(point, airspace, required, margin),
            lambda a, b: edge_is_free(a, b, airspace, required, margin),
            step=required,
        )
        stop = Stop(iterations=checks)
        start = known if known is not None and _holds(problem, known) else None
        results.append(solve(problem, settings.solver, seed=seed, stop=stop, initial=start))
        if results[-1].solution is not None or apart:
            break
    return results


def _holds(problem: "MotionProblem", way: Floats) -> bool:
    """Whether a way that was found by other means is one by this problem's own checks."""
    from solvers import InvalidSolution

    try:
        problem.evaluate(way)
    except InvalidSolution:
        return False
    return True


def point_is_free(point: Floats, airspace: Space, required: float, margin: float) -> bool:
    """Whether one point, shape (3,), is so far from solids and zones."""
    spot = point[None]
    return bool(airspace.clearance(spot)[0] >= required and airspace.zone_margin(spot)[0] >= margin)


def edge_is_free(a: Floats, b: Floats, airspace: Space, required: float, margin: float) -> bool:
    """Whether the whole straight edge is; one of its ends must be known to be."""
    return airspace.capsule_clearance_at_least(a, b, required) and airspace.zone_margin_at_least(
        a, b, margin
    )


def _seed(first: Floats, last: Floats, root: int) -> int:
    """Seed that depends on the two places, not on when their leg is looked at."""
    places = np.round(np.concatenate([first, last]) * 10.0**JOINT_DECIMALS).astype(np.int64)
    words = places.view(np.uint32).tolist()
    return int(np.random.SeedSequence(root, spawn_key=tuple(words)).generate_state(1)[0])
