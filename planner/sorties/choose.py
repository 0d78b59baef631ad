"""Sorties by either method, or the better of both, behind one call."""

from dataclasses import replace

from planner.geometry.arrays import Ints
from planner.sorties.problem import Known, SortieProblem, Split
from planner.sorties.split import split_order


def choose_sorties(
    problem: SortieProblem,
    order: Ints,
    *,
    method: str = "best",
    known: Known | None = None,
    solutions: int | None = None,
) -> Split | None:
    """Photos of each sortie, such that all of them take the least time.

    Parameters
    ----------
    problem
        Times and limits.
    order
        Each photo once, shape (V,): the tour.
    method
        ``"split"`` cuts this order, at its proven optimum; ``"routing"`` searches other orders as
        well and cuts what it finds at the optimum; ``"best"`` does both.
    known
        True seconds of some sorties.
    solutions
        How many solutions the search of other orders looks at.

    Returns
    -------
    split
        Within all limits; with ``"best"`` never worse than either. ``None`` if none was found.

    """
    given = split_order(problem, order, known)
    if method == "split":
        return given
    from planner.sorties.routing import route_sorties

    routed = route_sorties(problem, given, solutions=solutions)
    if routed is not None:
        cut = split_order(problem, routed.order, known)
        routed = None if cut is None else replace(cut, method="routing")
    if method == "routing":
        return routed
    found = [split for split in (given, routed) if split is not None]
    return min(found, key=lambda split: split.cost, default=None)
