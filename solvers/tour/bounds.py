"""Lower bounds on the cost of every tour."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from solvers.arrays import Floats
from solvers.errors import InvalidProblem
from solvers.tour.closing import closed_costs, surcharge
from solvers.tour.nearest import first_places, nearest_order
from solvers.tour.problem import TourProblem

_GRAIN_LIMIT = 2.0**50  # whole numbers up to here add up without rounding
_STEPS = 1500  # more than the ascent needs to come to rest
_CHUNK = 20  # steps between two looks at the clock


@dataclass(frozen=True, slots=True, eq=False)
class Ascent:
    """Where the ascent of Held and Karp came to.

    Parameters
    ----------
    bound
        Lower bound on the cost of a closed tour of ``closed_costs``.
    prices
        Prices of the places that give it, shape (n,) or, for an open tour, (n + 1,).

    """

    bound: float
    prices: Floats


def held_karp_bound(
    problem: TourProblem, *, upper: float | None = None, steps: int = _STEPS
) -> float:
    """Lower bound of Held and Karp, by subgradient ascent on 1-trees.

    Usually within 1 % of the optimum. Where all costs are whole numbers, it is rounded up to
    the next sum that they can have. An open tour is closed by a place that is not there.

    Parameters
    ----------
    problem
        Symmetric.
    upper
        Cost of some order, to aim at; by default that of a nearest-neighbour order.
    steps
        Most steps of the ascent, n^2 operations each.

    Raises
    ------
    InvalidProblem
        If the costs are asymmetric.

    References
    ----------
    Held and Karp, 1971, doi:10.1007/BF01584070.

    """
    if not problem.symmetric:
        raise InvalidProblem("the Held-Karp bound needs symmetric costs; see `assignment_bound`.")
    answer = problem.trivial()
    if answer is not None and answer.solution is not None:
        return problem.cost(answer.solution)
    if upper is None:
        upper = problem.cost(nearest_order(problem, next(first_places(problem))))
    ascent = Ascent(-math.inf, np.empty(0))
    for ascent in ascents(problem, upper, steps):  # noqa: B007 - the last one is the best
        pass
    return rounded_up(ascent.bound - surcharge(problem), grain(problem.costs))


def ascents(problem: TourProblem, upper: float, steps: int) -> Iterator[Ascent]:
    """The ascent, a few steps at a time; problem symmetric and of four places or more."""
    from solvers.tour.one_tree_kernels import ascend, new_one_tree

    costs = closed_costs(problem)
    n = len(costs)
    prices, trial, drift = np.zeros(n), np.zeros(n), np.zeros(n)
    pace, tree = np.array([2.0, 0.0, -np.inf]), new_one_tree(n)
    upper += surcharge(problem)
    for done in range(0, max(1, steps), _CHUNK):
        some = max(1, min(_CHUNK, steps - done))
        bound = ascend(costs, prices, trial, drift, pace, upper, some, tree)
        yield Ascent(bound, prices)
        if pace[0] <= 0.0:
            break


def assignment_bound(problem: TourProblem) -> float:
    """Lower bound by the cheapest way to leave and reach each place once; any costs.

    Good for asymmetric costs; for symmetric ones the bound of Held and Karp is far better.
    """
    from scipy.optimize import linear_sum_assignment

    answer = problem.trivial()
    if answer is not None and answer.solution is not None:
        return problem.cost(answer.solution)
    costs = directed_costs(problem)
    np.fill_diagonal(costs, (len(costs) + 1) * costs.max() + 1.0)
    rows, columns = linear_sum_assignment(costs)
    return rounded_up(float(costs[rows, columns].sum()), grain(problem.costs))


def directed_costs(problem: TourProblem) -> Floats:
    """Own, writable costs of a directed closed tour with the same best order and cost.

    An open tour gets one more place, numbered n, between its end and its start.
    """
    if problem.closed:
        return problem.costs.copy()
    n = problem.size
    wall = (n + 1) * float(problem.costs.max()) + 1.0
    costs = np.zeros((n + 1, n + 1))
    costs[:n, :n] = problem.costs
    if problem.start is not None:
        costs[n, :n] = wall
        costs[n, problem.start] = 0.0
    if problem.end is not None:
        costs[:n, n] = wall
        costs[problem.end, n] = 0.0
    return costs


def grain(costs: Floats) -> float:
    """What all sums of these costs are multiples of; 0 unless the costs are whole numbers."""
    if costs.size * float(costs.max(initial=0.0)) > _GRAIN_LIMIT or (costs % 1.0).any():
        return 0.0
    return float(np.gcd.reduce(costs.astype(np.int64), axis=None))


def rounded_up(bound: float, unit: float) -> float:
    """A bound raised to the next multiple of ``unit``, if that is not 0, and to 0 at least."""
    bound = max(0.0, bound)
    return unit * math.ceil(bound / unit - 1e-6) if unit > 0.0 else bound
