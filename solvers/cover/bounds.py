"""Lower bounds on the price of any cover: by multipliers, quick or close, and by the LP."""

import math

import numpy as np

from solvers.arrays import Floats
from solvers.cover.ascent import Ascent
from solvers.cover.linear import LinearModel, linear_model
from solvers.cover.problem import CoverProblem
from solvers.cover.rows import rows_of

_QUICK_STEPS, _QUICK_WORK = 400, 1e8  # the latter takes about 0.2 s
_ROUNDING = 1e-9  # relative; what floating point may have added


def quick_bound(problem: CoverProblem) -> float:
    """Lower bound for next to no time: mostly under 0.01 s, about 0.2 s at the most.

    As :func:`lagrangian_bound`, stopped after a fixed amount of work, so that it is always
    the same; mostly within 3 percent of the linear relaxation. Infinite if it shows that
    conflicts leave no cover.
    """
    rows = rows_of(problem)
    if not len(rows.wanted):
        return 0.0
    ascent = Ascent(rows)
    ascent.climb(work=_QUICK_WORK, steps=_QUICK_STEPS)
    return provable(problem.prices, ascent.bound)


def lagrangian_bound(problem: CoverProblem, *, steps: int = 2000) -> float:
    """Lower bound by multipliers, mostly within 0.1 percent of the linear relaxation.

    Parameters
    ----------
    problem
        Any cover problem; where conflicts overlap, they are used in part.
    steps
        Most steps of the ascent (see :class:`solvers.cover.ascent.Ascent`), at least 1.

    """
    rows = rows_of(problem)
    if not len(rows.wanted):
        return 0.0
    ascent = Ascent(rows)
    ascent.climb(work=math.inf, steps=steps)
    return provable(problem.prices, ascent.bound)


def lp_bound(problem: CoverProblem, *, seconds: float = math.inf) -> float:
    """Lower bound by the linear relaxation, solved by HiGHS.

    The dual solution goes through the Lagrangian function, whose value is a bound however
    far the tolerances of HiGHS reach.

    Parameters
    ----------
    problem
        Any cover problem.
    seconds
        Time limit.

    Returns
    -------
    bound
        Infinite if even the relaxation has no solution, since conflicts prevent it; minus
        infinity if there is no dual solution at the time limit. Not rounded up to what
        prices can sum to, as the other two bounds are.

    """
    from highspy import HighsModelStatus

    model = linear_model(problem)
    if not len(model.rows.wanted):
        return 0.0
    dual, status = _dual(model, seconds)
    if status == HighsModelStatus.kInfeasible:
        return math.inf
    return -math.inf if dual is None else _value(model, np.maximum(dual, 0.0))


def provable(prices: Floats, bound: float) -> float:
    """Bound less what rounding may have added, and up to the next sum that prices can have."""
    if math.isinf(bound):
        return bound
    bound -= _ROUNDING * abs(bound)
    unit = price_unit(prices)
    return bound if unit is None else unit * math.ceil(bound / unit - 1e-6)


def price_unit(prices: Floats) -> float | None:
    """Largest number of which all prices are multiples, to six decimals; ``None`` if none is.

    A price that is positive and yet would count as none leaves no unit.
    """
    largest = prices.max(initial=0.0)
    for scale in (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6):
        scaled = scale * prices
        if scale * largest < 2**52 and np.allclose(scaled, np.rint(scaled), rtol=1e-13, atol=0.0):
            divisor = np.gcd.reduce(np.rint(scaled).astype(np.int64), initial=0)
            return float(divisor) / scale if divisor else None
    return None


def _dual(model: LinearModel, seconds: float) -> tuple[Floats | None, object]:
    """Dual values of the constraints, and the status of HiGHS."""
    import highspy

    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.setOptionValue("solver", "ipm")
    highs.setOptionValue("run_crossover", "off")
    if math.isfinite(seconds):
        highs.setOptionValue("time_limit", seconds)
    lp = highspy.HighsLp()
    lp.num_row_, lp.num_col_ = model.matrix.shape
    lp.col_cost_, lp.row_lower_ = model.cost, model.lower
    lp.col_lower_, lp.col_upper_ = np.zeros(len(model.cost)), np.ones(len(model.cost))
    lp.row_upper_ = np.full(len(model.lower), highspy.kHighsInf)
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_ = model.matrix.indptr, model.matrix.indices
    lp.a_matrix_.value_ = model.matrix.data
    highs.passModel(lp)
    highs.run()
    solution = highs.getSolution()
    dual = np.array(solution.row_dual) if solution.dual_valid else None
    return dual, highs.getModelStatus()


def _value(model: LinearModel, dual: Floats) -> float:
    """Lagrangian function at the duals; those of conflicts are added to the prices."""
    from solvers.cover import ascent_kernels

    rows, rivals = model.rows, model.rivals
    count, groups = len(rows.wanted), len(rows.group_wanted)
    clash = dual[count + groups :]
    charges = np.repeat(clash, np.diff(rivals.group_starts))
    prices = rows.prices + np.bincount(rivals.members, charges, minlength=model.sets)
    prices.setflags(write=False)
    free = np.full(model.sets, -1, dtype=np.int32)
    free.setflags(write=False)
    want, hits = np.empty(count, np.int32), np.empty(count, np.int32)
    value = ascent_kernels.relax(
        rows._replace(prices=prices, part=free), dual[:count], want, hits, np.empty(model.sets)
    )
    value -= float(clash.sum())
    return value - _ROUNDING * abs(value)
