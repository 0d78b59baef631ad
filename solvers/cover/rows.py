"""A cover problem as rows of demand: the plain arrays that compiled loops work on."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import read_only
from solvers.cover.problem import CoverProblem

Array = NDArray[Any]


class Rows(NamedTuple):
    r"""What the chosen sets must give, row by row, without elements that want nothing.

    Plain rows come first: row ``r`` wants ``wanted[r]`` of the sets that hold it. Then come
    groups of rows, one group for each element that wants two sectors or more and in it one
    row for each sector that can see the element: of group ``g``, the rows from
    ``group_starts[g]`` up to ``group_starts[g + 1]``, at least ``group_wanted[g]`` must be
    hit. An element that wants one sector wants one hit, and gets a plain row.

    Of the sets with the same number in ``part`` at most one may be chosen; -1 is free.
    Parts are disjoint, so that overlapping conflicts are here in part only: enough for a
    bound, not for a choice.
    """

    starts: Array
    """Start of each set's rows in ``rows``, int64 (sets + 1,)."""
    rows: Array
    """Rows of each set, int32 (entries,)."""
    prices: Array
    """Price of each set, float64 (sets,)."""
    wanted: Array
    """Demand of each plain row and 0 for those in groups, int32 (rows,)."""
    group_starts: Array
    """First row of each group and the end of the last, int64 (groups + 1,)."""
    group_wanted: Array
    """How many rows of each group must be hit, int32 (groups,)."""
    part: Array
    """Number of the part that each set is in, or -1, int32 (sets,)."""


class Columns(NamedTuple):
    """The same entries row by row."""

    starts: Array
    """Start of each row's entries, int64 (rows + 1,)."""
    sets: Array
    """Set of each entry, int32 (entries,)."""
    entries: Array
    """Where in ``Rows.rows`` the entry stands, int32 (entries,)."""


class Rivals(NamedTuple):
    """Which sets are in conflict: cliques of each set, and sets of each clique."""

    starts: Array
    """Start of each set's cliques in ``groups``, int64 (sets + 1,)."""
    groups: Array
    """Cliques of each set, int64."""
    group_starts: Array
    """Start of each clique's sets in ``members``, int64 (cliques + 1,)."""
    members: Array
    """Sets of each clique, int64."""


def rivals_of(problem: CoverProblem) -> Rivals:
    """Conflicts of a problem."""
    sizes = np.array([len(group) for group in problem.conflicts], dtype=np.int64)
    members = np.concatenate([*problem.conflicts, np.empty(0, dtype=np.int64)])
    owner = np.repeat(np.arange(len(sizes)), sizes)
    return _rivals(owner, members, cliques=len(sizes), sets=problem.sets)


def rows_of(problem: CoverProblem) -> Rows:
    """Rows of a problem; shares its arrays where it can."""
    directed = problem.sector_demand > 1
    demand = np.maximum(problem.demand, np.minimum(problem.sector_demand, 1))
    plain = (demand > 0) & ~(directed & (demand <= problem.sector_demand))
    starts: Array = problem.indptr
    rows: Array = problem.indices
    group_starts, group_wanted = np.array([0]), np.empty(0, dtype=np.int64)
    if not plain.all() or directed.any():
        number = np.cumsum(plain, dtype=np.int64) - 1
        owner = np.repeat(np.arange(problem.sets), np.diff(problem.indptr))
        at = np.flatnonzero(plain[problem.indices])
        rows, owners = number[problem.indices[at]], owner[at]
        if directed.any():
            at = np.flatnonzero(directed[problem.indices])
            sectors = np.zeros(0) if problem.sectors is None else problem.sectors[at]
            code = problem.indices[at].astype(np.int64) * problem.sector_count + sectors
            pairs, pair = np.unique(code, return_inverse=True)
            first = np.flatnonzero(np.diff(pairs // problem.sector_count, prepend=-1))
            group_starts = np.append(first, len(pairs))
            group_wanted = problem.sector_demand[directed]
            rows = np.concatenate((rows, number[-1] + 1 + pair))
            owners = np.concatenate((owners, owner[at]))
        order = np.argsort(owners, kind="stable")
        rows = rows[order]
        starts = np.searchsorted(owners[order], np.arange(problem.sets + 1))
    wanted = np.concatenate((demand[plain], np.zeros(group_starts[-1])))
    return Rows(
        _sealed(starts, np.int64),
        _sealed(rows, np.int32),
        problem.prices,
        _sealed(wanted, np.int32),
        _sealed(np.count_nonzero(plain) + group_starts, np.int64),
        _sealed(group_wanted, np.int32),
        _sealed(_parts(problem), np.int32),
    )


def columns_of(rows: Rows) -> Columns:
    """Entries of the rows, sets ascending in each."""
    at = np.argsort(rows.rows, kind="stable")
    owner = np.repeat(np.arange(len(rows.prices), dtype=np.int32), np.diff(rows.starts))
    starts = np.searchsorted(rows.rows[at], np.arange(len(rows.wanted) + 1))
    return Columns(_sealed(starts, np.int64), _sealed(owner[at], np.int32), _sealed(at, np.int32))


def restricted(rows: Rows, sets: Array) -> Rows:
    """Rows with only some of the sets, in the order given; what is wanted stays."""
    lengths = np.diff(rows.starts)[sets]
    starts = np.concatenate(([0], np.cumsum(lengths)))
    at = np.repeat(rows.starts[sets] - starts[:-1], lengths) + np.arange(starts[-1])
    return rows._replace(
        starts=_sealed(starts, np.int64),
        rows=_sealed(rows.rows[at], np.int32),
        prices=_sealed(rows.prices[sets], np.float64),
        part=_sealed(rows.part[sets], np.int32),
    )


def restricted_rivals(rivals: Rivals, sets: Array) -> Rivals:
    """Conflicts among some of the sets, by their new numbers."""
    number = np.full(len(rivals.starts) - 1, -1, dtype=np.int64)
    number[sets] = np.arange(len(sets))
    members = number[rivals.members]
    owner = np.repeat(np.arange(len(rivals.group_starts) - 1), np.diff(rivals.group_starts))
    owner, members = owner[members >= 0], members[members >= 0]
    return _rivals(owner, members, cliques=len(rivals.group_starts) - 1, sets=len(sets))


def _rivals(owner: Array, members: Array, *, cliques: int, sets: int) -> Rivals:
    """Conflicts from pairs of clique and set, cliques ascending."""
    by_set = np.argsort(members, kind="stable")
    return Rivals(
        _sealed(np.searchsorted(members[by_set], np.arange(sets + 1)), np.int64),
        _sealed(owner[by_set], np.int64),
        _sealed(np.searchsorted(owner, np.arange(cliques + 1)), np.int64),
        _sealed(members, np.int64),
    )


def _parts(problem: CoverProblem) -> Array:
    """Disjoint parts of the conflicts, the largest first; a single set is free."""
    part = np.full(problem.sets, -1, dtype=np.int32)
    count = 0
    for group in sorted(problem.conflicts, key=len, reverse=True):
        free = group[part[group] < 0]
        if len(free) > 1:
            part[free] = count
            count += 1
    return part


def _sealed(array: Array, kind: Any) -> Array:
    """Read-only and of one type always, so that each loop is compiled once."""
    sealed = np.ascontiguousarray(array, dtype=kind)
    return read_only(sealed if sealed is not array else sealed.view())
