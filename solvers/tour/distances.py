"""Costs as TSPLIB defines them, and its ways to write a matrix.

Reinelt, "TSPLIB: a traveling salesman problem library" (1991), doi:10.1287/ijoc.3.4.376, and
the description of the format, "TSPLIB 95".
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import Floats

_EARTH = 6378.388  # km, radius of the format's sphere
_PI = 3.141592  # as the format has it; more digits would give other optima

METRICS = {
    "EUC_2D": 2,
    "EUC_3D": 3,
    "CEIL_2D": 2,
    "MAN_2D": 2,
    "MAN_3D": 3,
    "MAX_2D": 2,
    "MAX_3D": 3,
    "GEO": 2,
    "ATT": 2,
}
"""Kinds of distance between coordinates, and how many of these a place has."""

MATRICES = (
    "FULL_MATRIX",
    "UPPER_ROW",
    "LOWER_ROW",
    "UPPER_DIAG_ROW",
    "LOWER_DIAG_ROW",
    "UPPER_COL",
    "LOWER_COL",
    "UPPER_DIAG_COL",
    "LOWER_DIAG_COL",
)
"""Orders in which a file may list the entries of a matrix."""


def metric_costs(kind: str, places: Floats) -> Floats:
    """Whole-numbered costs between places, shape (n, n), for a kind of :data:`METRICS`."""
    costs = np.empty((len(places), len(places)))
    rule = _RULES[kind.partition("_")[0]]
    if kind == "GEO":
        places = _radians(places)
    for i, place in enumerate(places):  # a row at a time: the differences need n times less room
        costs[i] = rule(places - place, places, place)
    np.fill_diagonal(costs, 0.0)
    return costs


def entries(form: str, n: int) -> int:
    """How many numbers a matrix of that form has."""
    if form == "FULL_MATRIX":
        return n * n
    return n * (n + 1) // 2 if "DIAG" in form else n * (n - 1) // 2


def filled(form: str, n: int, numbers: Floats) -> Floats:
    """Matrix (n, n) from the numbers of a form of :data:`MATRICES`, symmetric if triangular."""
    if form == "FULL_MATRIX":
        return numbers.reshape(n, n)
    offset = 0 if "DIAG" in form else 1
    upper = form.startswith("UPPER") == form.endswith("ROW")  # columns of one are rows of the other
    rows = np.triu_indices(n, offset) if upper else np.tril_indices(n, -offset)
    costs = np.zeros((n, n))
    costs[rows] = numbers
    costs.T[rows] = numbers
    return costs


Rule = Callable[[Floats, Floats, Floats], NDArray[np.float64]]


def _nearest(values: Floats) -> Floats:
    whole: Floats = np.floor(values + 0.5)
    return whole


def _euclidean(steps: Floats, _places: Floats, _place: Floats) -> Floats:
    return _nearest(np.sqrt((steps**2).sum(axis=1)))


def _ceiling(steps: Floats, _places: Floats, _place: Floats) -> Floats:
    whole: Floats = np.ceil(np.sqrt((steps**2).sum(axis=1)))
    return whole


def _manhattan(steps: Floats, _places: Floats, _place: Floats) -> Floats:
    return _nearest(np.abs(steps).sum(axis=1))


def _maximum(steps: Floats, _places: Floats, _place: Floats) -> Floats:
    whole: Floats = _nearest(np.abs(steps)).max(axis=1)
    return whole


def _pseudo_euclidean(steps: Floats, _places: Floats, _place: Floats) -> Floats:
    length = np.sqrt((steps**2).sum(axis=1) / 10.0)
    whole = _nearest(length)
    return np.where(whole < length, whole + 1.0, whole)


def _geographical(_steps: Floats, places: Floats, place: Floats) -> Floats:
    east = np.cos(places[:, 1] - place[1])
    apart, along = np.cos(places[:, 0] - place[0]), np.cos(places[:, 0] + place[0])
    cosine = 0.5 * ((1.0 + east) * apart - (1.0 - east) * along)
    whole: Floats = np.floor(_EARTH * np.arccos(np.clip(cosine, -1.0, 1.0)) + 1.0)
    return whole


def _radians(places: Floats) -> Floats:
    """From ``DDD.MM``, degrees and minutes, to radians."""
    degrees = np.trunc(places)
    return _PI * (degrees + 5.0 * (places - degrees) / 3.0) / 180.0


_RULES: dict[str, Rule] = {
    "EUC": _euclidean,
    "CEIL": _ceiling,
    "MAN": _manhattan,
    "MAX": _maximum,
    "GEO": _geographical,
    "ATT": _pseudo_euclidean,
}
