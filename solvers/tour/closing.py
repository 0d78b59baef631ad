"""See every symmetric tour problem as a closed one, by a place that is not there."""

import numpy as np

from solvers.arrays import Floats, read_only
from solvers.tour.problem import Order, TourProblem


def closed_costs(problem: TourProblem) -> Floats:
    """Symmetric costs of a closed tour that has the same best order.

    An open tour gets one more place, numbered n, that joins its two ends: free next to
    an end that is allowed, and next to any other place dearer than all that could be saved.
    Shape (n, n), or (n + 1, n + 1) for an open tour. The closed tour costs what the order
    does and :func:`surcharge` on top.
    """
    if problem.closed:
        return problem.costs
    n = problem.size
    costs = np.zeros((n + 1, n + 1))
    costs[:n, :n] = problem.costs
    fixed = [place for place in (problem.start, problem.end) if place is not None]
    if fixed:
        costs[n, :n] = costs[:n, n] = detour(problem)
        costs[n, fixed] = costs[fixed, n] = 0.0
    read_only(costs)
    return costs


def detour(problem: TourProblem) -> float:
    """Price of joining the absent place to one that is no fixed end: above any whole tour."""
    dearest = float(problem.costs.max())
    return (problem.size + 1) * dearest if dearest > 0.0 else 1.0


def surcharge(problem: TourProblem) -> float:
    """What the best closed tour of :func:`closed_costs` costs beyond the best order.

    One end alone being fixed, the absent place has to be joined to some other place.
    """
    one_end = (problem.start is None) != (problem.end is None)
    return detour(problem) if one_end and not problem.closed else 0.0


def opened(problem: TourProblem, tour: Order) -> Order:
    """Order of the problem's own places from a closed tour of :func:`closed_costs`."""
    if problem.closed:
        first = 0 if problem.start is None else int(np.flatnonzero(tour == problem.start)[0])
        return np.roll(tour, -first)
    gap = int(np.flatnonzero(tour == problem.size)[0])
    order = np.roll(tour, -gap)[1:]
    backwards = (problem.start is not None and order[0] != problem.start) or (
        problem.end is not None and order[-1] != problem.end
    )
    return order[::-1].copy() if backwards else order


def closed(problem: TourProblem, order: Order) -> Order:
    """Closed tour of :func:`closed_costs` from an order of the problem's own places."""
    return order.copy() if problem.closed else np.append(order, problem.size)
