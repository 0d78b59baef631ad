"""Which viewpoints can be flown together, when some legs have no safe way."""

from collections.abc import Callable

from planner.geometry.arrays import Ints


def unbroken_runs(rows: Ints, broken: list[bool], *, closed: bool) -> list[list[int]]:
    """Stretches of the order whose inner legs all have a way.

    Parameters
    ----------
    rows
        Viewpoints in order, shape (K,).
    broken
        Whether each leg lacks a way: K - 1 legs, or K if closed.
    closed
        Whether the last leg leads back to the first viewpoint.

    Returns
    -------
    runs
        Every row once, in order; a closed tour's last stretch goes on into the first.

    """
    runs: list[list[int]] = [[]]
    for k, row in enumerate(rows.tolist()):
        runs[-1].append(row)
        if k < len(rows) - 1 and broken[k]:
            runs.append([])
    if closed and len(runs) > 1 and not broken[-1]:
        runs[0] = runs.pop() + runs[0]
    return runs


def largest_group(
    runs: list[list[int]], joined: Callable[[list[int], list[int]], bool]
) -> set[int]:
    """Rows of the largest set of runs that can reach one another.

    To be joined by a safe way is an equivalence, so each run is held against the largest one
    only, and the rest among themselves only while they could still be more.

    Parameters
    ----------
    runs
        Disjoint lists of rows, at least one.
    joined
        Whether a safe way between two runs was found.

    Returns
    -------
    rows
        The larger group, the first where two are as large.

    """
    best: list[list[int]] = []
    rest = sorted(runs, key=len, reverse=True)
    while _count(rest) > _count(best):
        hub, *others = rest
        reached = [run for run in others if joined(hub, run)]
        group = [hub, *reached]
        if _count(group) > _count(best):
            best = group
        rest = [run for run in others if run not in reached]
    return {row for run in best for row in run}


def _count(runs: list[list[int]]) -> int:
    return sum(map(len, runs))
