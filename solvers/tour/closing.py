"""See every symmetric tour problem as a closed one, by a place that is not there."""

from typing import NamedTuple

import numpy as np

from solvers.arrays import Floats, read_only
from solvers.tour.nearest import first_places, nearest_order
from solvers.tour.problem import Order, TourProblem

_ABOVE = 1.0 + 1e-6  # what makes a limit on legs dearer than the tour that it comes from
_SAVED = 1e-10  # share of the dearest leg below which a saving is no saving
_NEIGHBOURS = 8  # of a descent


class Closing(NamedTuple):
    """A closed tour problem that has the same best order as an open one, or as itself.

    No order as cheap as one that is known has a leg dearer than that order, so such legs are
    made only a little dearer than it. That keeps the numbers close together: one leg of
    1e12 would swallow the digits of all others.
    """

    costs: Floats
    """Symmetric costs, shape (n, n), or (n + 1, n + 1) for an open tour."""
    surcharge: float
    """What the best closed tour costs beyond the best order: not 0 if one end is fixed."""
    dearest: float
    """Most that a leg costs."""


def closing(problem: TourProblem, upper: float | None = None) -> Closing:
    """Close a symmetric problem.

    An open tour gets one more place, numbered n, that joins its two ends: free next to
    an end that is allowed, and next to any other place dearer than a whole tour. Where one
    end alone is fixed, that place has to be joined to some other one, which is the surcharge.

    Parameters
    ----------
    problem
        Symmetric.
    upper
        Cost of some order; by default that of a quick one.

    """
    legs = limited(problem, upper)
    dearest = float(legs.max())
    if problem.closed:
        return Closing(legs, 0.0, dearest)
    n = problem.size
    costs = np.zeros((n + 1, n + 1))
    costs[:n, :n] = legs
    fixed = [place for place in (problem.start, problem.end) if place is not None]
    detour = (n + 1) * dearest if dearest > 0.0 else 1.0
    if fixed:
        costs[n, :n] = costs[:n, n] = detour
        costs[n, fixed] = costs[fixed, n] = 0.0
    read_only(costs)
    return Closing(costs, detour if len(fixed) == 1 else 0.0, dearest)


def closed_costs(problem: TourProblem) -> Floats:
    """Costs of :func:`closing`."""
    return closing(problem).costs


def limited(problem: TourProblem, upper: float | None = None) -> Floats:
    """Costs, none much above that of a whole order: ``upper``, or else that of a quick one.

    The best order and its cost stay as they are; costs may be asymmetric.
    """
    upper = quick_upper(problem) if upper is None else upper
    return _limited(problem.costs, upper)


def quick_upper(problem: TourProblem) -> float:
    """Cost of a nearest-neighbour order, mended by 3-opt where a few legs make most of it."""
    order = nearest_order(problem, next(first_places(problem)))
    cost = problem.cost(order)
    while 4.0 * _dearest_leg(problem, order) > cost > 0.0 and problem.symmetric:
        order = _mended(problem, order, cost)
        before, cost = cost, min(cost, problem.cost(order))
        if cost > 0.5 * before:
            break
    return cost


def _dearest_leg(problem: TourProblem, order: Order) -> float:
    legs = problem.costs[order, np.roll(order, -1)]
    return float((legs if problem.closed else legs[:-1]).max())


def _limited(costs: Floats, upper: float) -> Floats:
    limit = _ABOVE * upper if upper > 0.0 else 1.0
    if float(costs.max()) <= limit:
        return costs
    own = np.minimum(costs, limit)
    read_only(own)
    return own


def _mended(problem: TourProblem, order: Order, cost: float) -> Order:
    """Order after 3-opt moves that save more than rounding takes."""
    from solvers.tour.candidates import nearest_lists
    from solvers.tour.search_kernels import new_walk, settle

    costs, _, dearest = closing(problem, cost)
    walk = new_walk(closed(problem, order))
    near = nearest_lists(costs, min(_NEIGHBOURS, len(costs) - 1))
    settle(costs, near, walk, _SAVED * dearest)
    return opened(problem, walk.tour.astype(np.int64))


def opened(problem: TourProblem, tour: Order) -> Order:
    """Order of the problem's own places from a closed tour of :func:`closing`."""
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
    """Closed tour of :func:`closing` from an order of the problem's own places."""
    return order.copy() if problem.closed else np.append(order, problem.size)
