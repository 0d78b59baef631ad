"""Small problems of every family whose optimum is found by trying everything.

They are the awkward ones on purpose: fixed ends, ties, zeros, extremes, doubles, sizes from
one up, and problems without any solution.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from solvers.arrays import Floats
from solvers.cover.problem import CoverProblem
from solvers.errors import InvalidProblem, InvalidSolution
from solvers.motion.boxes import Boxes
from solvers.motion.problem import MotionProblem
from solvers.pairs.problem import PairCoverProblem
from solvers.problem import Problem
from solvers.tour.problem import TourProblem


@dataclass(frozen=True, slots=True, eq=False)
class KnownProblem:
    """A problem and its true optimum, infinite where there is no solution."""

    name: str
    problem: Problem[Any]
    optimum: float


@lru_cache
def known_problems(family: str) -> tuple[KnownProblem, ...]:
    """Every small problem of a family; the same objects in each call.

    Raises
    ------
    InvalidProblem
        If there is no such family.

    """
    if family == "motion":
        cases = _motions()
    elif family == "tour":
        cases = _solved_by_hand(_tours(), lambda p: itertools.permutations(range(p.size)))
    elif family == "cover":
        cases = _solved_by_hand(_covers(), lambda p: _subsets(p.sets))
    elif family == "pairs":
        cases = _solved_by_hand(_pairs(), lambda p: _subsets(p.candidates))
    else:
        raise InvalidProblem(f"there is no battery for family {family!r}.")
    return tuple(KnownProblem(f"{family} {name}", *case) for name, case in cases.items())


@lru_cache
def larger_problem(family: str) -> Problem[Any]:
    """A plain problem that takes solvers a moment, to try their limits on."""
    rng = np.random.default_rng(3)
    if family == "motion":
        from solvers.motion.instances import random_boxes

        return random_boxes(2).problem
    if family == "tour":
        return TourProblem(_distances(rng.random((40, 2))))
    if family == "cover":
        return CoverProblem(rng.random((60, 80)) < 0.1, rng.integers(1, 9, 60), 2)
    if family == "pairs":
        return pair_problem(30, 40, 0.5)
    raise InvalidProblem(f"there is no battery for family {family!r}.")


def _subsets(size: int) -> Iterator[tuple[int, ...]]:
    return (c for k in range(size + 1) for c in itertools.combinations(range(size), k))


def _solved_by_hand(
    problems: dict[str, Any], candidates: Any
) -> dict[str, tuple[Problem[Any], float]]:
    solved: dict[str, tuple[Problem[Any], float]] = {}
    for name, problem in problems.items():
        best = math.inf
        for candidate in candidates(problem):
            try:
                best = min(best, problem.evaluate(np.array(candidate, dtype=np.int64))[1])
            except InvalidSolution:
                continue
        solved[name] = problem, best
    return solved


def _covers() -> dict[str, CoverProblem]:
    from scipy.sparse import csr_array

    rng = np.random.default_rng(11)
    hits = csr_array((rng.random((9, 8)) < 0.45).astype(np.int32))
    sectors = rng.integers(0, 3, hits.nnz)
    prices = rng.integers(1, 6, 9) / 2.0
    groups = [[0, 1, 2], [2, 5], [6, 7]]
    dense = hits.toarray()
    return {
        "priced": CoverProblem(hits, prices),
        "ties": CoverProblem(hits),
        "twice": CoverProblem(hits, prices, 2),
        "some twice, some never": CoverProblem(hits, prices, [2, 0, 1, 2, 0, 1, 2, 1]),
        "more than there is": CoverProblem(hits, prices, 99),
        "free": CoverProblem(hits, 0.0),
        "some free": CoverProblem(hits, np.where(np.arange(9) % 3, prices, 0.0)),
        "huge prices": CoverProblem(hits, 1e9 * prices),
        "tiny prices": CoverProblem(hits, 1e-9 * prices),
        "the same sets again": CoverProblem(
            np.repeat(dense[:5], 2, axis=0), np.repeat(prices, 2)[:10]
        ),
        "one set": CoverProblem([[1, 1]], 3.0),
        "two sets": CoverProblem([[1, 0], [1, 1]], [1.0, 3.0]),
        "three sets": CoverProblem([[1, 1, 0], [0, 1, 1], [1, 1, 1]], [1.0, 1.0, 1.5]),
        "an element that nothing hits": CoverProblem([[1, 0], [1, 0]], [2.0, 1.0]),
        "sectors": CoverProblem(hits, prices, 2, sectors=sectors, sector_demand=2),
        "sectors alone": CoverProblem(hits, prices, 0, sectors=sectors, sector_demand=2),
        "conflicts": CoverProblem(hits, prices, conflicts=groups),
        "impossible": CoverProblem(np.eye(3), conflicts=[[0, 1]]),
        "nothing wanted": CoverProblem(hits, prices, 0),
    }


def _pairs() -> dict[str, PairCoverProblem]:
    return {
        "priced": pair_problem(7, 5, 0.8, prices=np.array([2.0, 1, 3, 1, 2, 1, 2])),
        "ties": pair_problem(7, 5, 0.8),
        "free": pair_problem(6, 4, 0.9, prices=0.0),
        "huge prices": pair_problem(6, 4, 0.9, prices=1e9),
        "tiny prices": pair_problem(6, 4, 0.9, prices=1e-9),
        "a share": pair_problem(7, 5, 0.8, share=0.5),
        "a budget": pair_problem(7, 5, 0.8, budget=2.0),
        "no budget at all": pair_problem(6, 4, 0.9, budget=0.0),
        "conflicts": pair_problem(7, 5, 0.9, conflicts=[[0, 1], [1, 2, 3]]),
        "impossible": pair_problem(2, 2, 1.0, conflicts=[[0, 1]]),
        "two candidates": pair_problem(2, 2, 1.0),
        "out of reach": pair_problem(1, 2, 1.0),
    }


def pair_problem(
    candidates: int, elements: int, share_hit: float, *, seed: int = 23, **wanted: Any
) -> PairCoverProblem:
    """Candidates on a circle about elements near its middle; the pairs at 20 degrees count most."""
    from scipy.sparse import csr_array

    rng = np.random.default_rng(seed)
    turn = np.deg2rad(20.0) * np.arange(candidates)
    eyes = np.column_stack([np.cos(turn), np.sin(turn), np.full(candidates, 0.3)])
    targets = rng.uniform(-0.1, 0.1, (elements, 3))
    hit = rng.random((candidates, elements)) < share_hit
    who, what = np.nonzero(hit)
    rays = eyes[who] - targets[what]
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    chord = np.linspace(0.0, 2.0, 201)
    weights = np.exp(-(((chord - 2.0 * np.sin(np.deg2rad(10.0))) / 0.2) ** 2))
    covers = csr_array(hit.astype(np.int32))
    return PairCoverProblem(covers, rays, weights=weights, target=0.9, **wanted)


def _tours() -> dict[str, TourProblem]:
    rng = np.random.default_rng(5)
    places = rng.random((7, 2))
    costs = _distances(places)
    twice = _distances(np.repeat(places[:3], 2, axis=0))
    return {
        "closed": TourProblem(costs),
        "open": TourProblem(costs, closed=False),
        "closed from 3": TourProblem(costs, start=3),
        "open from 2": TourProblem(costs, closed=False, start=2),
        "open to 4": TourProblem(costs, closed=False, end=4),
        "open from 5 to 0": TourProblem(costs, closed=False, start=5, end=0),
        "asymmetric": TourProblem(rng.random((6, 6))),
        "asymmetric from 4": TourProblem(rng.random((6, 6)), start=4),
        "asymmetric open": TourProblem(rng.random((6, 6)), closed=False, start=1),
        "asymmetric from 0 to 5": TourProblem(rng.random((6, 6)), closed=False, start=0, end=5),
        "no triangle inequality": TourProblem(_symmetric(rng.random((7, 7)) ** 6)),
        "one place": TourProblem([[0.0]]),
        "two places": TourProblem(costs[:2, :2], closed=False),
        "two places and back": TourProblem(costs[:2, :2]),
        "three places": TourProblem(costs[:3, :3], start=1),
        "three places in a row": TourProblem(costs[:3, :3], closed=False, start=2, end=1),
        "four places": TourProblem(costs[:4, :4]),
        "four places open": TourProblem(costs[:4, :4], closed=False, start=0, end=3),
        "five places open": TourProblem(costs[:5, :5], closed=False),
        "ties": TourProblem(np.ones((6, 6))),
        "ties open": TourProblem(np.ones((6, 6)), closed=False),
        "zero": TourProblem(np.zeros((5, 5))),
        "some zero": TourProblem(_symmetric(rng.integers(0, 2, (7, 7)))),
        "repeated places": TourProblem(twice),
        "repeated places open": TourProblem(twice, closed=False, start=1),
        "on a line": TourProblem(_distances(np.arange(7.0)[:, None])),
        "huge": TourProblem(1e12 * costs),
        "tiny": TourProblem(1e-12 * costs),
    }


def _distances(places: Floats) -> Floats:
    return np.asarray(np.linalg.norm(places[:, None] - places[None, :], axis=2))


def _symmetric(costs: Any) -> Any:
    return np.triu(costs, 1) + np.triu(costs, 1).T


def _motions() -> dict[str, tuple[Problem[Any], float]]:
    around = 2.0 * math.hypot(3.0, 3.0) + 2.0
    box = [[[4.0, 2.0], [6.0, 8.0]]]
    ring = [[[3, 3], [5, 3.5]], [[3, 4.5], [5, 5]], [[3, 3], [3.5, 5]], [[4.5, 3], [5, 5]]]
    high = math.hypot(around, 4.0)
    return {
        "round a box": (_motion(box, [1, 5], [9, 5]), around),
        "round a box in space": (_motion(box, [1, 5, 2], [9, 5, 6]), high),
        "along a box": (_motion(box, [4, 1], [4, 9]), 8.0),
        "straight": (_motion(box, [1, 1], [9, 1]), 8.0),
        "there already": (_motion(box, [1, 1], [1, 1]), 0.0),
        "huge": (_motion(box, [1, 5], [9, 5], 1e6), 1e6 * around),
        "tiny": (_motion(box, [1, 5], [9, 5], 1e-3), 1e-3 * around),
        "start in a box": (_motion(box, [5, 5], [9, 1]), math.inf),
        "goal in a closed ring": (_motion(ring, [1, 1], [4, 4]), math.inf),
    }


def _motion(boxes: Any, start: Any, goal: Any, scale: float = 1.0) -> MotionProblem:
    solids = Boxes(scale * np.array(boxes, dtype=np.float64))
    bounds = scale * np.array([[0.0] * len(start), [10.0] * len(start)])
    first, last = (scale * np.array(end, dtype=np.float64) for end in (start, goal))
    checks = solids.is_free, solids.edge_is_free
    return MotionProblem(first, last, bounds, *checks, step=0.5 * scale)
