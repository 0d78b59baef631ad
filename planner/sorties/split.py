"""The best way to cut a given order of photos into sorties."""

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.sorties.problem import TIE, Known, SortieProblem, Split


def split_order(problem: SortieProblem, order: Ints, known: Known | None = None) -> Split | None:
    """Cut an order into sorties at the least total time: a shortest path, so the optimum.

    The nodes of the split graph are the places between photos. An arc from before photo i to
    behind photo j is the sortie from the best station through photos i to j, if that keeps the
    limits. The method is that of Beasley, "Route first - cluster second methods for vehicle
    routing", Omega 11(4), 1983, 403-408 (doi:10.1016/0305-0483(83)90033-6).

    Parameters
    ----------
    problem
        Times and limits.
    order
        Each photo once, shape (V,).
    known
        True seconds of some sorties, which count instead of the sums; if finite, these sorties
        have no more waypoints than they may.

    Returns
    -------
    split
        No other cut of this order takes less time; ``None`` if no cut keeps the limits. Of
        equals, the one whose last sorties are longest, from the first station.

    """
    count = len(order)
    best = np.full(count + 1, np.inf)
    best[0] = 0.0
    origin, station = np.zeros(count + 1, dtype=np.int64), np.zeros(count + 1, dtype=np.int64)
    run = np.r_[0.0, np.cumsum(problem.legs[order[:-1], order[1:]])]
    points = np.r_[0, np.cumsum(problem.points[order[:-1], order[1:]])]
    flown = _flown(order, known or {})
    for i in range(count):
        if not np.isfinite(best[i]):
            continue
        for home in range(len(problem.out)):
            ends = problem.out_points[home, order[i]] + problem.back_points[home, order[i:]]
            enough = _enough(1 + ends + points[i:] - points[i], problem)
            seconds = (
                problem.out[home, order[i]] + (run[i:] - run[i]) + problem.back[home, order[i:]]
            )
            for j, true in flown.get((home, i), ()):
                seconds[j - i], enough[j - i] = true, np.isfinite(true)
            allowed = enough & (seconds <= problem.endurance + TIE)
            total = np.where(allowed, best[i] + seconds + problem.turnaround, np.inf)
            better = np.flatnonzero(total < best[i + 1 :])
            best[i + 1 + better] = total[better]
            origin[i + 1 + better], station[i + 1 + better] = i, home
    if not np.isfinite(best[count]):
        return None
    return _traced(order, origin, station, float(best[count]))


def _enough(waypoints: Ints, problem: SortieProblem) -> Bools:
    """Whether sorties of so many waypoints keep their limit."""
    if problem.most is None:
        return np.ones(len(waypoints), dtype=np.bool_)
    return np.asarray(waypoints <= problem.most)


def _flown(order: Ints, known: Known) -> dict[tuple[int, int], list[tuple[int, float]]]:
    """Known sorties that are stretches of this order: last photo and seconds by station, first."""
    place: Floats | Ints = np.zeros(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    found: dict[tuple[int, int], list[tuple[int, float]]] = {}
    for (home, photos), seconds in known.items():
        first = int(place[photos[0]])
        if order[first : first + len(photos)].tolist() == list(photos):
            found.setdefault((home, first), []).append((first + len(photos) - 1, seconds))
    return found


def _traced(order: Ints, origin: Ints, station: Ints, cost: float) -> Split:
    """Sorties of the shortest path, read from its end."""
    sorties, homes, end = [], [], len(order)
    while end:
        start = int(origin[end])
        sorties.append(order[start:end])
        homes.append(int(station[end]))
        end = start
    return Split(tuple(sorties[::-1]), tuple(homes[::-1]), cost, "split")
