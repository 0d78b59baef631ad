"""Compiled state of a local search: sets go in and out; import only where a solver runs."""

from typing import Any, NamedTuple

from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.cover.rows import Columns, Rows

Array = NDArray[Any]


class State(NamedTuple):
    """A choice under way, and what is known about changing it.

    A *need* is a plain row, or a group of rows; plain rows come first. The *score* of a set
    is by how much weight it would fill open needs, or, if chosen, by how much weight they
    would open without it.
    """

    chosen: Array
    """Which sets are chosen, bool (sets,)."""
    picks: Array
    """The chosen sets that may be dropped, in the first ``size[0]`` places, int32 (sets,)."""
    slot: Array
    """Place of each chosen set in ``picks``, or -1 if it may not be dropped, int32 (sets,)."""
    score: Array
    """Score of each set, int64 (sets,)."""
    stamp: Array
    """Step at which each set was last moved, int64 (sets,)."""
    fresh: Array
    """Whether anything changed around a set since it was dropped, bool (sets,)."""
    sets: Array
    """Sets of each row as in ``Columns``, the chosen ones in front, int32 (entries,)."""
    entries: Array
    """Entry of each of these, int32 (entries,)."""
    place: Array
    """Where each entry stands in these two, int32 (entries,)."""
    hits: Array
    """How many chosen sets hit each row, int32 (rows,)."""
    distinct: Array
    """How many rows of each group are hit, int32 (groups,)."""
    group: Array
    """Group of each row, or -1, int32 (rows,)."""
    weight: Array
    """Weight of each need, int64 (needs,)."""
    open: Array
    """Needs that are not met, in the first ``size[1]`` places, int32 (needs,)."""
    spot: Array
    """Place of each open need in ``open``, int32 (needs,)."""
    size: Array
    """Number of sets in ``picks``, of open needs, and of steps so far, int64 (3,)."""


@compiled
def _move(state: State, entry: int, target: int) -> None:
    """Bring an entry to another place of its row, by exchange."""
    source = state.place[entry]
    if source != target:
        other = state.entries[target]
        state.sets[source], state.sets[target] = state.sets[target], state.sets[source]
        state.entries[source], state.entries[target] = other, entry
        state.place[other], state.place[entry] = source, target


@compiled
def _raise(state: State, start: int, end: int, weight: int) -> None:
    """Change the score of the sets in these places, which are not chosen."""
    for at in range(start, end):
        j = state.sets[at]
        state.score[j] += weight
        state.fresh[j] = True


@compiled
def _close(state: State, need: int) -> None:
    state.size[1] -= 1
    last = state.open[state.size[1]]
    state.open[state.spot[need]] = last
    state.spot[last] = state.spot[need]


@compiled
def _reopen(state: State, need: int) -> None:
    state.open[state.size[1]] = need
    state.spot[need] = state.size[1]
    state.size[1] += 1


@compiled
def _group_changed(rows: Rows, columns: Columns, state: State, r: int, opened: bool) -> None:
    """Carry to the other rows of a group that one more, or one less, of them is hit.

    Called with ``state.distinct`` as it was before one more was hit, or as it is after one
    less is: the change matters at the demand (open or met) and just above (spare or not).
    """
    g = state.group[r]
    plain = rows.group_starts[0]
    weight = state.weight[plain + g] if opened else -state.weight[plain + g]
    spare = state.distinct[g] == rows.group_wanted[g]
    for other in range(rows.group_starts[g], rows.group_starts[g + 1]):
        start = columns.starts[other]
        if other == r:
            continue
        if spare and state.hits[other] == 1:
            state.score[state.sets[start]] += weight
        elif not spare and state.hits[other] == 0:
            _raise(state, start, columns.starts[other + 1], weight)


@compiled
def add(rows: Rows, columns: Columns, state: State, j: int) -> None:
    """Choose set ``j``."""
    plain = rows.group_starts[0]
    loss = 0
    for entry in range(rows.starts[j], rows.starts[j + 1]):
        r = rows.rows[entry]
        start, end, hits = columns.starts[r], columns.starts[r + 1], state.hits[r]
        _move(state, entry, start + hits)
        state.hits[r] += 1
        g = state.group[r]
        if g < 0:
            if hits < rows.wanted[r]:
                loss += state.weight[r]
                if hits + 1 == rows.wanted[r]:
                    _raise(state, start + hits + 1, end, -state.weight[r])
                    _close(state, r)
            elif hits == rows.wanted[r]:
                for at in range(start, start + hits):
                    state.score[state.sets[at]] -= state.weight[r]
            continue
        wanted, weight = rows.group_wanted[g], state.weight[plain + g]
        if hits == 0:
            if state.distinct[g] < wanted:
                loss += weight
                _raise(state, start + 1, end, -weight)
                if state.distinct[g] + 1 == wanted:
                    _close(state, plain + g)
                    _group_changed(rows, columns, state, r, False)
            elif state.distinct[g] == wanted:
                _group_changed(rows, columns, state, r, False)
            state.distinct[g] += 1
        elif hits == 1 and state.distinct[g] <= wanted:
            state.score[state.sets[start]] -= weight
    state.chosen[j] = True
    state.score[j] = loss
    state.picks[state.size[0]] = j
    state.slot[j] = state.size[0]
    state.size[0] += 1
    state.stamp[j] = state.size[2]


@compiled
def drop(rows: Rows, columns: Columns, state: State, j: int) -> None:
    """Give up chosen set ``j``."""
    plain = rows.group_starts[0]
    gain = 0
    for entry in range(rows.starts[j], rows.starts[j + 1]):
        r = rows.rows[entry]
        start, end, hits = columns.starts[r], columns.starts[r + 1], state.hits[r]
        _move(state, entry, start + hits - 1)
        state.hits[r] -= 1
        g = state.group[r]
        if g < 0:
            if hits <= rows.wanted[r]:
                gain += state.weight[r]
                if hits == rows.wanted[r]:
                    _raise(state, start + hits, end, state.weight[r])
                    _reopen(state, r)
            elif hits == rows.wanted[r] + 1:
                for at in range(start, start + hits - 1):
                    state.score[state.sets[at]] += state.weight[r]
            continue
        wanted, weight = rows.group_wanted[g], state.weight[plain + g]
        if hits == 1:
            state.distinct[g] -= 1
            if state.distinct[g] < wanted:
                gain += weight
                _raise(state, start + 1, end, weight)
                if state.distinct[g] + 1 == wanted:
                    _reopen(state, plain + g)
                    _group_changed(rows, columns, state, r, True)
            elif state.distinct[g] == wanted:
                _group_changed(rows, columns, state, r, True)
        elif hits == 2 and state.distinct[g] <= wanted:
            state.score[state.sets[start]] += weight
    state.chosen[j] = False
    state.score[j] = gain
    state.size[0] -= 1
    last = state.picks[state.size[0]]
    state.picks[state.slot[j]] = last
    state.slot[last] = state.slot[j]
    state.stamp[j] = state.size[2]
    state.fresh[j] = False


@compiled
def weigh(rows: Rows, columns: Columns, state: State, need: int, more: int) -> None:
    """Change the weight of a need by ``more``."""
    plain = rows.group_starts[0]
    state.weight[need] += more
    if need < plain:
        if state.hits[need] <= rows.wanted[need]:
            end = columns.starts[need] + state.hits[need]  # met: only the chosen would be missed
            if state.hits[need] < rows.wanted[need]:
                end = columns.starts[need + 1]
            for at in range(columns.starts[need], end):
                state.score[state.sets[at]] += more
        return
    g = need - plain
    if state.distinct[g] > rows.group_wanted[g]:
        return
    for r in range(rows.group_starts[g], rows.group_starts[g + 1]):
        start = columns.starts[r]
        if state.hits[r] == 1:
            state.score[state.sets[start]] += more
        elif state.hits[r] == 0 and state.distinct[g] < rows.group_wanted[g]:
            for at in range(start, columns.starts[r + 1]):
                state.score[state.sets[at]] += more
