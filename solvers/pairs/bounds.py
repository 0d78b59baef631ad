"""What no choice can be cheaper than."""

from typing import Any

import numpy as np

from solvers.arrays import Floats
from solvers.pairs.problem import PairCoverProblem

_SMALL = 3_000  # hits of a problem whose rows are solved as an integer programme
_NODES = 2_000  # of its search tree, looked at
_TOLERANCE = 2e-6  # of the dearest price, by which the programme's bound may be off


def lower_bound(
    problem: PairCoverProblem, *, steps: int = 100, upper: float | None = None
) -> float:
    r"""Bound the price from below by Lagrangian duality.

    Whoever satisfies an element chooses so many of its hits that

    * they are at least ``n``: of ``n`` hits each has at most the sum of its best ``n - 1``
      pairs, and half of the ``n`` largest such sums must reach the target. Where an element
      has many hits, a pair counts as the worse of its two hits at the best angle instead;
    * half the sum of all pairs of each, whether chosen or not, reaches the target in total;
    * as many of them are fine as it wants.

    With prices :math:`\lambda` on these rows the rest falls apart into single candidates and
    the ``wanted`` cheapest elements; every :math:`\lambda \ge 0` gives a valid bound, and
    subgradient steps raise it. A small problem's rows are solved as an integer programme
    instead, which also knows the conflicts. Whole prices round the bound up.

    Parameters
    ----------
    problem
        With a budget the cost is the number of elements missed, of which only 0 is known.
    steps
        Subgradient steps; 0 gives minus infinity.
    upper
        Price of a known solution, which sets the step sizes; by default, of all candidates.

    """
    if steps < 1:
        return -np.inf
    if problem.budget is not None or problem.wanted < 1:
        return 0.0
    rows, demand = _rows(problem)
    if len(problem.indices) <= _SMALL:
        return _rounded(problem, _programme(problem, rows, demand))
    total = float(problem.prices.sum())
    known = total if upper is None or not np.isfinite(upper) else upper
    price = np.zeros(demand.shape)
    price[0] = known / max(1.0, float(demand[0].sum()))
    best, pace, stale = 0.0, 1.0, 0
    for _ in range(steps):
        bound, slope = _dual(problem, rows, demand, price)
        stale = 0 if bound > best else stale + 1
        best = max(best, bound)
        if stale >= 6:
            pace, stale = 0.6 * pace, 0
        length = float((slope**2).sum())
        if length == 0.0 or best >= known:
            break
        price = np.maximum(0.0, price + pace * max(known - bound, 1e-6 * known) / length * slope)
    return _rounded(problem, best)


def _rounded(problem: PairCoverProblem, bound: float) -> float:
    """Round up where all prices are whole."""
    whole = (problem.prices == np.rint(problem.prices)).all()
    return float(np.ceil(bound - 1e-5) + 0.0) if whole else bound


def _programme(problem: PairCoverProblem, rows: list[Any], demand: Floats) -> float:
    """Bound of the integer programme of the rows: which candidates, for which elements."""
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import diags_array, hstack

    sees = [hstack([row.T, -diags_array(want)]) for row, want in zip(rows, demand, strict=True)]
    size = problem.candidates + problem.elements
    limits = [LinearConstraint(matrix.tocsr(), 0.0, np.inf) for matrix in sees]
    wished = np.concatenate([np.zeros(problem.candidates), problem.reachable])
    limits.append(LinearConstraint(wished, problem.wanted, np.inf))
    for group in problem.conflicts:
        rivals = np.zeros(size)
        rivals[group] = 1.0
        limits.append(LinearConstraint(rivals, -np.inf, 1.0))
    scale = float(problem.prices.max(initial=0.0)) or 1.0  # tolerances are absolute
    prices = np.concatenate([problem.prices / scale, np.zeros(problem.elements)])
    found = milp(
        prices,
        integrality=np.ones(size, dtype=np.int64),
        bounds=Bounds(0.0, 1.0),
        constraints=limits,
        options={"node_limit": _NODES},
    )
    bound = found.mip_dual_bound
    return max(0.0, scale * (float(bound) - _TOLERANCE)) if bound is not None else 0.0


def _rows(problem: PairCoverProblem) -> tuple[list[Any], Floats]:
    """Rows as sparse matrices (candidates, elements), and what each demands, shape (3, E)."""
    from scipy.sparse import csr_array

    from solvers.pairs import bound_kernels

    starts, at, _ = problem.by_element
    needed, halves = bound_kernels.fewest(starts, problem.sight, problem.weights, problem.target)
    sums = np.empty(len(at))
    sums[at] = np.minimum(halves / problem.target, 1.0)
    covered = np.bincount(problem.indices, sums, minlength=problem.elements)
    demand = np.stack(
        [np.maximum(needed, problem.fine_demand), covered >= 1.0, problem.fine_demand]
    )
    shape = (problem.candidates, problem.elements)
    values = (np.ones(len(at)), sums, problem.fine.astype(np.float64))
    used = [(row, want) for row, want in zip(values, demand, strict=True) if want.any()]
    matrices = [csr_array((row, problem.indices, problem.indptr), shape=shape) for row, _ in used]
    return matrices, np.where(problem.reachable, [want for _, want in used], 0.0)


def _dual(
    problem: PairCoverProblem, rows: list[Any], demand: Floats, price: Floats
) -> tuple[float, Floats]:
    """Bound at these row prices, shape (rows, E), and its subgradient."""
    reduced = problem.prices - sum(row @ worth for row, worth in zip(rows, price, strict=True))
    taken = (reduced < 0.0).astype(np.float64)
    cost = np.where(problem.reachable, (price * demand).sum(axis=0), np.inf)
    cheapest = np.argsort(cost, kind="stable")[: problem.wanted]
    slope = -np.stack([taken @ row for row in rows])
    slope[:, cheapest] += demand[:, cheapest]
    return float(reduced[reduced < 0.0].sum() + cost[cheapest].sum()), slope
