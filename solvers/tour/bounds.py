"""Lower bounds on the cost of every tour."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from solvers.arrays import Floats
from solvers.errors import InvalidProblem
from solvers.tour.closing import Closing, closing, limited, quick_upper
from solvers.tour.problem import TourProblem

SAME = 1e-9
"""Share of the cost within which two tours cost the same, where costs are no whole numbers."""

_EPSILON = 2.0**-52  # of a float
_GRAIN_LIMIT = 2.0**50  # whole numbers up to here add up without rounding
_BLUR = 0.05  # share of the grain that the rounding of one price may reach, added up n^2 times
_STEPS = 1500  # more than the ascent needs to come to rest
_CHUNK = 20  # steps between two looks at the clock


@dataclass(frozen=True, slots=True, eq=False)
class Ascent:
    """Where the ascent of Held and Karp came to.

    Parameters
    ----------
    bound
        Lower bound on the cost of a closed tour of ``closing``, rounding allowed for.
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
    the next sum that they can have. An open tour is closed by a place that is not there. What
    floating point may have added is taken off, so that no tour is cheaper.

    Parameters
    ----------
    problem
        Symmetric.
    upper
        Cost of some order, to aim at; by default that of a quick one.
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
    quick = quick_upper(problem)
    whole = closing(problem, quick)
    ascent = Ascent(-math.inf, np.empty(0))
    aim = quick if upper is None else upper
    for ascent in ascents(whole, aim, steps):  # noqa: B007 - the last one is the best
        pass
    return rounded_up(ascent.bound - whole.surcharge, grain(problem.costs, whole.dearest))


def ascents(whole: Closing, upper: float, steps: int) -> Iterator[Ascent]:
    """The ascent to an order of cost ``upper``, a few steps at a time; of four places or more."""
    from solvers.tour.one_tree_kernels import ascend, new_one_tree

    costs = whole.costs
    n = len(costs)
    prices, trial, drift = np.zeros(n), np.zeros(n), np.zeros(n)
    pace, tree = np.array([2.0, 0.0, -np.inf]), new_one_tree(n)
    upper += whole.surcharge
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
    legs = limited(problem)
    costs, dearest = _directed(problem, legs), float(legs.max())
    rows, columns = linear_sum_assignment(costs)
    bound = float(costs[rows, columns].sum())
    bound -= 4.0 * _EPSILON * len(costs) ** 2 * dearest  # some roundings of each path
    return rounded_up(bound, grain(problem.costs, dearest))


def _directed(problem: TourProblem, legs: Floats) -> Floats:
    """Own costs of a directed closed tour with the same best order and cost, shape (n, n).

    An open tour gets one more place, numbered n, between its end and its start. What no tour
    has costs more than a whole one.
    """
    n = problem.size
    wall = (n + 1) * float(legs.max()) or 1.0
    if problem.closed:
        costs = legs.copy()
        np.fill_diagonal(costs, wall)
        return costs
    costs = np.zeros((n + 1, n + 1))
    costs[:n, :n] = legs
    if problem.start is not None:
        costs[n, :n] = wall
        costs[n, problem.start] = 0.0
    if problem.end is not None:
        costs[:n, n] = wall
        costs[problem.end, n] = 0.0
    np.fill_diagonal(costs, wall)
    return costs


def grain(costs: Floats, dearest: float = math.inf) -> float:
    """What all sums of the costs up to the dearest are multiples of.

    0 unless these costs are whole numbers, and small enough for bounds to tell the multiples
    apart in floating point.
    """
    kept = np.where(costs <= dearest, costs, 0.0)
    most = kept.size * float(kept.max(initial=0.0))
    if most > _GRAIN_LIMIT or (kept % 1.0).any():
        return 0.0
    unit = float(np.gcd.reduce(kept.astype(np.int64), axis=None))
    return unit if _EPSILON * most <= _BLUR * unit else 0.0


def rounded_up(bound: float, unit: float) -> float:
    """A bound raised to the next multiple of ``unit``, if that is not 0, and to 0 at least."""
    bound = max(0.0, bound)
    return unit * math.ceil(bound / unit) if unit > 0.0 else bound


def proves(bound: float, cost: float, unit: float) -> bool:
    """Whether no tour is cheaper, as far as costs of that grain can be told apart."""
    return cost <= bound or (unit == 0.0 and cost - bound <= SAME * cost)
