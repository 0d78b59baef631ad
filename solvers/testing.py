"""Conformance battery: what every solver must do, built in or plugged in.

``check_solver(MySolver(), "tour")`` runs every check of a family on small problems whose
optimum is found by trying everything. Written for the authors of solvers; used on every
registered one by this project's own tests.
"""

import itertools
import math
import pickle
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from solvers.arrays import Floats
from solvers.cover.problem import CoverProblem
from solvers.errors import InvalidProblem, InvalidSolution
from solvers.front import solve
from solvers.motion.problem import MotionProblem
from solvers.problem import Problem, Solver
from solvers.registry import load, require
from solvers.result import Result, Status, StopReason
from solvers.stop import Stop
from solvers.tour.problem import TourProblem

Check = Callable[[Solver, str], None]

_ENOUGH = Stop(iterations=300, seconds=5.0)
_ROUNDING = 1e-6


class ConformanceFailure(AssertionError):
    """A solver broke a rule of its contract."""


def check_solver(solver: str | Solver, family: str) -> tuple[str, ...]:
    """Run the battery of a family on a solver; return the names of the checks passed.

    Raises
    ------
    ConformanceFailure
        At the first rule that the solver breaks; the message says on which problem.
    SolverUnavailable
        If a package that it needs is missing.

    """
    for check in CHECKS.values():
        check(load(family, solver), family)
    return tuple(CHECKS)


def never_beats_the_optimum(solver: Solver, family: str) -> None:
    """Costs from the optimum up, bounds from the optimum down, proofs only of the truth."""
    for name, problem, optimum in _small_problems(family):
        result = _solved(solver, problem)
        if result is None:
            continue
        slack = _ROUNDING * max(1e-9, abs(optimum)) if math.isfinite(optimum) else 0.0
        _demand(result.cost >= optimum - slack, f"{name}: cost {result.cost} below {optimum}")
        _demand(result.bound <= optimum + slack, f"{name}: bound {result.bound} above {optimum}")
        if result.status is Status.OPTIMAL:
            _demand(result.cost <= optimum + slack, f"{name}: {result.cost} is not optimal")
        if result.status is Status.INFEASIBLE:
            _demand(math.isinf(optimum), f"{name}: called infeasible, costs {optimum}")
        if getattr(solver, "exact", False) and result.stop_reason is StopReason.FINISHED:
            known = Status.OPTIMAL if math.isfinite(optimum) else Status.INFEASIBLE
            _demand(result.status is known, f"{name}: exact solver says {result.status}")


def finds_something(solver: Solver, family: str) -> None:
    """Every plain problem that has a solution gets one."""
    for name, problem, optimum in _small_problems(family):
        if math.isfinite(optimum) and "conflicts" not in problem.features:
            result = _solved(solver, problem)
            if result is not None:
                _demand(result.solution is not None, f"{name}: found nothing")
                _demand(
                    math.isclose(problem.evaluate(result.solution)[1], result.cost),
                    f"{name}: the cost is not that of the solution",
                )


def repeats_by_seed(solver: Solver, family: str) -> None:
    """Same seed, same solution and same trace."""
    for name, problem, _ in _small_problems(family):
        first = _solved(solver, problem, seed=7, stop=Stop(iterations=25))
        second = _solved(solver, problem, seed=7, stop=Stop(iterations=25))
        if first is None or second is None:
            continue
        _demand(_same(first.solution, second.solution), f"{name}: another solution")
        steps = [[(p.iteration, p.cost) for p in result.trace] for result in (first, second)]
        _demand(steps[0] == steps[1], f"{name}: another trace")


def trace_falls_to_the_cost(solver: Solver, family: str) -> None:
    """The trace falls strictly and ends at the cost of the result."""
    for name, problem, _ in _small_problems(family):
        result = _solved(solver, problem)
        if result is not None and result.trace:
            costs = [point.cost for point in result.trace]
            _demand(all(a > b for a, b in itertools.pairwise(costs)), f"{name}: trace rises")
            _demand(costs[-1] == result.cost, f"{name}: trace ends at {costs[-1]}")


def keeps_to_limits(solver: Solver, family: str) -> None:
    """Each field of ``Stop`` that it does not declare to ignore ends the run."""
    _, problem, _ = next(_small_problems(family))
    limits: dict[str, Any] = {"iterations": 1, "stall": 1, "target": 1e12, "seconds": 0.5}
    for field, value in limits.items():
        if field in getattr(solver, "ignores", ()):
            continue
        result = _solved(solver, problem, stop=Stop(**{field: value}))
        if result is None:
            continue
        if field == "iterations":
            _demand(result.iterations <= 1, f"{result.iterations} iterations instead of one")
        _demand(result.seconds < 10.0, f"Stop({field}={value}) took {result.seconds:.1f} s")


def leaves_the_problem_alone(solver: Solver, family: str) -> None:
    """The arrays of the problem are the same afterwards."""
    for name, problem, _ in _small_problems(family):
        before = _arrays(problem)
        _solved(solver, problem, stop=Stop(iterations=5))
        _demand(before == _arrays(problem), f"{name}: the problem was changed")


def interrupt_keeps_the_incumbent(solver: Solver, family: str) -> None:
    """Ctrl-C at the first improvement gives that improvement back."""

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    for name, problem, optimum in _small_problems(family):
        if math.isinf(optimum) or problem.trivial() is not None:
            continue
        result = _solved(solver, problem, listener=interrupt)
        if result is None or not result.trace:
            continue
        _demand(result.stop_reason is StopReason.INTERRUPTED, f"{name}: interrupt swallowed")
        _demand(result.cost == result.trace[0].cost, f"{name}: incumbent lost")


def never_worse_than_its_start(solver: Solver, family: str) -> None:
    """A warm start is taken, and at least kept."""
    for name, problem, _ in _small_problems(family):
        first = _solved(solver, problem, seed=1)
        if first is None or first.solution is None:
            continue
        again = _solved(solver, problem, initial=first.solution, stop=Stop(iterations=5))
        if again is not None:
            _demand(again.cost <= first.cost, f"{name}: {again.cost} after {first.cost}")


def pickles(solver: Solver, _family: str) -> None:
    """Travels to another process."""
    twin = pickle.loads(pickle.dumps(solver))  # noqa: S301 - made one line above
    _demand(twin.name == solver.name, "another name after pickling")


CHECKS: dict[str, Check] = {
    check.__name__: check
    for check in (
        never_beats_the_optimum,
        finds_something,
        repeats_by_seed,
        trace_falls_to_the_cost,
        keeps_to_limits,
        leaves_the_problem_alone,
        interrupt_keeps_the_incumbent,
        never_worse_than_its_start,
        pickles,
    )
}
"""Name -> check, for a test that wants one line for each."""


def _solved(solver: Solver, problem: Any, **options: Any) -> Result[Any] | None:
    """Result, or ``None`` where the solver refuses problems or limits of this kind."""
    require(solver)
    stop = options.pop("stop", _ENOUGH)
    refused = frozenset(getattr(solver, "cannot", ())) & problem.features
    refused |= frozenset(
        {"limit"} if stop.limits <= frozenset(getattr(solver, "ignores", ())) else ()
    )
    if not refused:
        return solve(problem, solver, stop=stop, **options)
    try:
        solve(problem, solver, stop=stop, **options)
    except InvalidProblem:
        return None
    raise ConformanceFailure(f"{solver.name}: took what it declares to refuse: {sorted(refused)}")


def _demand(kept: object, otherwise: str) -> None:
    if not kept:
        raise ConformanceFailure(otherwise)


def _same(one: Any, other: Any) -> bool:
    if one is None or other is None:
        return one is other
    return bool(np.array_equal(one, other))


def _arrays(problem: Any) -> dict[str, bytes]:
    return {
        name: value.tobytes()
        for name, value in vars(problem).items()
        if isinstance(value, np.ndarray)
    }


def _small_problems(family: str) -> Iterator[tuple[str, Problem[Any], float]]:
    """Name, problem and true optimum (infinite if there is no solution)."""
    make = {"cover": _covers, "tour": _tours, "motion": _motions}.get(family)
    if make is None:
        raise InvalidProblem(f"there is no battery for family {family!r} yet.")
    for name, problem, optimum in make():
        yield f"{family} {name}", problem, optimum


def _cheapest(problem: Problem[Any], candidates: Iterator[Any]) -> float:
    best = math.inf
    for candidate in candidates:
        try:
            best = min(best, problem.evaluate(np.array(candidate, dtype=np.int64))[1])
        except InvalidSolution:
            continue
    return best


def _covers() -> Iterator[tuple[str, Problem[Any], float]]:
    from scipy.sparse import csr_array

    rng = np.random.default_rng(11)
    hits = csr_array((rng.random((9, 8)) < 0.45).astype(np.int32))
    sectors = rng.integers(0, 3, hits.nnz)
    prices = rng.integers(1, 6, 9) / 2.0
    groups = [[0, 1, 2], [2, 5], [6, 7]]
    cases: dict[str, CoverProblem] = {
        "priced": CoverProblem(hits, prices),
        "unit prices": CoverProblem(hits),
        "twice": CoverProblem(hits, prices, 2),
        "more than there is": CoverProblem(hits, prices, 99),
        "free": CoverProblem(hits, 0.0),
        "huge prices": CoverProblem(hits, 1e9 * prices),
        "sectors": CoverProblem(hits, prices, 2, sectors=sectors, sector_demand=2),
        "sectors alone": CoverProblem(hits, prices, 0, sectors=sectors, sector_demand=2),
        "conflicts": CoverProblem(hits, prices, conflicts=groups),
        "impossible": CoverProblem(np.eye(3), conflicts=[[0, 1]]),
        "nothing wanted": CoverProblem(hits, prices, 0),
    }
    for name, problem in cases.items():
        sizes = range(problem.sets + 1)
        choices = (c for k in sizes for c in itertools.combinations(range(problem.sets), k))
        yield name, problem, _cheapest(problem, choices)


def _tours() -> Iterator[tuple[str, Problem[Any], float]]:
    rng = np.random.default_rng(5)
    places = rng.random((7, 2))
    costs = _distances(places)
    twice = _distances(np.repeat(places[:3], 2, axis=0))
    cases: dict[str, TourProblem] = {
        "closed": TourProblem(costs),
        "open": TourProblem(costs, closed=False),
        "closed from 3": TourProblem(costs, start=3),
        "open from 2": TourProblem(costs, closed=False, start=2),
        "open to 4": TourProblem(costs, closed=False, end=4),
        "open from 5 to 0": TourProblem(costs, closed=False, start=5, end=0),
        "asymmetric": TourProblem(rng.random((6, 6))),
        "asymmetric open": TourProblem(rng.random((6, 6)), closed=False, start=1),
        "one place": TourProblem([[0.0]]),
        "two places": TourProblem(costs[:2, :2], closed=False),
        "three places": TourProblem(costs[:3, :3], start=1),
        "four places": TourProblem(costs[:4, :4]),
        "ties": TourProblem(np.ones((6, 6))),
        "zero": TourProblem(np.zeros((5, 5))),
        "repeated places": TourProblem(twice),
        "huge": TourProblem(1e12 * costs),
        "tiny": TourProblem(1e-12 * costs),
    }
    for name, problem in cases.items():
        yield name, problem, _cheapest(problem, itertools.permutations(range(problem.size)))


def _distances(places: Floats) -> Floats:
    return np.asarray(np.linalg.norm(places[:, None] - places[None, :], axis=2))


def _motions() -> Iterator[tuple[str, Problem[Any], float]]:
    bounds = [[0.0, 0.0], [10.0, 10.0]]
    around = 2.0 * math.hypot(3.0, 3.0) + 2.0
    yield "round a box", MotionProblem([1, 5], [9, 5], bounds, _outside, _clear, step=0.5), around
    yield "straight", MotionProblem([1, 1], [9, 1], bounds, _outside, _clear, step=0.5), 8.0
    yield (
        "start in a box",
        MotionProblem([5, 5], [9, 1], bounds, _outside, _clear, step=1),
        math.inf,
    )


_BOX = np.array([[4.0, 2.0], [6.0, 8.0]])


def _outside(point: Floats) -> bool:
    return not bool(((point > _BOX[0]) & (point < _BOX[1])).all())


def _clear(a: Floats, b: Floats) -> bool:
    """Whether the edge misses the open box (slabs, exact but for rounding)."""
    enter, leave = 0.0, 1.0
    for axis in range(2):
        along = b[axis] - a[axis]
        if along == 0.0:
            if not _BOX[0, axis] < a[axis] < _BOX[1, axis]:
                return True
            continue
        at = sorted((side - a[axis]) / along for side in _BOX[:, axis])
        enter, leave = max(enter, at[0]), min(leave, at[1])
    return enter >= leave
