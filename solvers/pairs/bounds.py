"""What no choice can be cheaper than."""

import numpy as np

from solvers.arrays import Floats
from solvers.pairs.problem import PairCoverProblem

_SMALL = 3_000  # hits of a problem whose rows are solved as an integer programme
_NODES = 50  # of its search tree, looked at
_TOLERANCE = 2e-6  # of the dearest price, by which the programme's bound may be off
_REACH = 0.5  # by which a step aims above the best bound so far, at first
_SHRINK = 0.8  # of that after steps that led nowhere
_PATIENCE = 5  # such steps
_MOMENTUM = 0.8  # of the way of the step before


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
    deflected subgradient steps (Camerini, Fratta and Maffioli, 1975, doi:10.1007/BFb0120697)
    towards a level above it raise it. A small problem's rows are solved as an integer programme
    instead, which also knows the conflicts. Whole prices round the bound up.

    Parameters
    ----------
    problem
        With a budget the cost is the number of elements missed, of which only 0 is known.
    steps
        Subgradient steps; 0 gives minus infinity.
    upper
        Price of a known solution, at which the search can end.

    """
    if steps < 1:
        return -np.inf
    paid = problem.prices[problem.prices > 0.0]
    if problem.budget is not None or problem.wanted < 1 or not len(paid):
        return 0.0
    sums, demand = _rows(problem)
    if len(problem.indices) <= _SMALL:
        return _rounded(problem, _programme(problem, sums, demand))
    known = np.inf if upper is None else upper
    worth = _first(problem, demand)
    way, best, reach, stale = np.zeros(demand.shape), 0.0, _REACH, 0
    for _ in range(steps):
        bound, slope = _dual(problem, sums, demand, worth)
        stale = 0 if bound > best * (1.0 + 1e-4) else stale + 1
        best = max(best, bound)
        if stale >= _PATIENCE:
            reach, stale = _SHRINK * reach, 0
        way = slope + _MOMENTUM * way
        length = float((way**2).sum())
        if length == 0.0 or best >= known:
            break
        wished = (1.0 + reach) * max(best, float(paid.min()))
        worth = np.maximum(0.0, worth + (wished - bound) / length * way)
    return _rounded(problem, best)


def _first(problem: PairCoverProblem, demand: Floats) -> Floats:
    """Highest equal price of all wanted hits at which no candidate pays for itself, (E, 3)."""
    open_hits = (demand[problem.indices, 0] > 0.0).astype(np.float64)
    count = np.add.reduceat(np.append(open_hits, 0.0), problem.indptr[:-1])
    count[np.diff(problem.indptr) == 0] = 0.0
    worth = np.zeros(demand.shape)
    worth[demand[:, 0] > 0.0, 0] = (problem.prices / np.maximum(count, 1.0)).min()
    return worth


def _rounded(problem: PairCoverProblem, bound: float) -> float:
    """Round up where all prices are whole."""
    whole = (problem.prices == np.rint(problem.prices)).all()
    return float(np.ceil(bound - 1e-5) + 0.0) if whole else bound


def _programme(problem: PairCoverProblem, sums: Floats, demand: Floats) -> float:
    """Bound of the integer programme of the rows: which candidates, for which elements."""
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import csr_array, diags_array, hstack

    shape = (problem.candidates, problem.elements)
    sees = []
    for values, want in zip((np.ones(len(sums)), sums, problem.fine), demand.T, strict=True):
        if want.any():
            row = csr_array(
                (np.asarray(values, dtype=np.float64), problem.indices, problem.indptr), shape=shape
            )
            sees.append(csr_array(hstack([row.T, -diags_array(want)])))
    size = problem.candidates + problem.elements
    limits = [LinearConstraint(matrix, 0.0, np.inf) for matrix in sees]
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


def _rows(problem: PairCoverProblem) -> tuple[Floats, Floats]:
    """What each hit gives the second row, (nnz,), and what each row demands, shape (E, 3).

    To the first row each hit gives 1, to the third each fine one.
    """
    from solvers.pairs import bound_kernels

    starts, at, _ = problem.by_element
    needed, halves = bound_kernels.fewest(starts, problem.sight, problem.weights, problem.target)
    sums = np.empty(len(at))
    sums[at] = np.minimum(halves / problem.target[problem.indices[at]], 1.0)
    covered = np.bincount(problem.indices, sums, minlength=problem.elements)
    fine = problem.fine_demand
    demand = np.column_stack([np.maximum(needed, fine), covered >= 1.0, fine]).astype(np.float64)
    demand[~problem.reachable] = 0.0
    return sums, demand


def _dual(
    problem: PairCoverProblem, sums: Floats, demand: Floats, worth: Floats
) -> tuple[float, Floats]:
    """Bound at these prices of rows, shape (E, 3), and its subgradient."""
    from solvers.pairs import bound_kernels

    slope = np.empty(demand.shape)
    hits = (problem.indptr, problem.indices, sums, problem.fine)
    bound = bound_kernels.relaxed(*hits, problem.prices, worth, slope)
    cost = np.where(problem.reachable, (worth * demand).sum(axis=1), np.inf)
    cheapest = np.argsort(cost, kind="stable")[: problem.wanted]
    slope[cheapest] += demand[cheapest]
    return float(bound + cost[cheapest].sum()), slope
