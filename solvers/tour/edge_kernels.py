"""Compiled book-keeping of edges that must or must not be in a tour; import only where used."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled

Array = NDArray[Any]

FREE, IN, OUT = 0, 1, 2
"""What is decided about an edge."""


class Edges(NamedTuple):
    """The edges that may be in a better tour than the one known."""

    one: Array
    """First place of each edge, int32 (m,)."""
    other: Array
    """Second place of each edge, int32 (m,)."""
    cost: Array
    """Cost of each edge, (m,)."""
    starts: Array
    """Where the edges of each place begin in ``at``, int32 (n + 1,)."""
    at: Array
    """Edges by place, int32 (2 m,)."""


class Decisions(NamedTuple):
    """What has been decided, in the order in which it was."""

    state: Array
    """``FREE``, ``IN`` or ``OUT``, int8 (m,)."""
    taken: Array
    """How many edges at each place are in, int32 (n,)."""
    left: Array
    """How many edges at each place are not out, int32 (n,)."""
    trail: Array
    """Edges decided, oldest first, int32 (m,)."""
    made: Array
    """How many, int64 (1,)."""
    todo: Array
    """Room for decisions that follow: edge + 1 for in, its negative for out, int32."""


def new_edges(one: Array, other: Array, cost: Array, n: int) -> Edges:
    """Edges between n places."""
    count = len(one)
    ends = np.concatenate([one, other])
    by_place = np.argsort(ends, kind="stable")
    starts = np.searchsorted(ends[by_place], np.arange(n + 1)).astype(np.int32)
    at = (by_place % max(1, count)).astype(np.int32)
    return Edges(one.astype(np.int32), other.astype(np.int32), cost.astype(float), starts, at)


def no_decisions(edges: Edges) -> Decisions:
    """Everything free."""
    count, n = len(edges.cost), len(edges.starts) - 1
    return Decisions(
        np.zeros(count, dtype=np.int8),
        np.zeros(n, dtype=np.int32),
        np.diff(edges.starts).astype(np.int32),
        np.empty(count + 1, dtype=np.int32),
        np.zeros(1, dtype=np.int64),
        np.empty(2 * count + 4 * n + 8, dtype=np.int32),  # a place lists its edges twice at most
    )


@compiled
def _other_end(edges: Edges, edge: int, place: int) -> int:
    return int(edges.other[edge] if edges.one[edge] == place else edges.one[edge])


@compiled
def _far_end(edges: Edges, decided: Decisions, edge: int, place: int) -> tuple[int, int]:
    """End of the path of edges that are in, from ``place`` on away from ``edge``; its length.

    Where the path comes back to ``edge``, that is its other end.
    """
    home = _other_end(edges, edge, place)
    came, length = edge, 0
    while decided.taken[place] == 2 and place != home:
        onward = -1
        for k in range(edges.starts[place], edges.starts[place + 1]):
            if decided.state[edges.at[k]] == IN and edges.at[k] != came:
                onward = edges.at[k]
        if onward < 0:
            break
        came = onward
        place = _other_end(edges, came, place)
        length += 1
    return place, length


@compiled
def _push_free(edges: Edges, decided: Decisions, place: int, sign: int, count: int) -> int:
    """Put every free edge of a place on the list of decisions to make."""
    for k in range(edges.starts[place], edges.starts[place + 1]):
        edge = edges.at[k]
        if decided.state[edge] == FREE:
            decided.todo[count] = sign * (edge + 1)
            count += 1
    return count


@compiled
def decide(edges: Edges, decided: Decisions, edge: int, wanted: int) -> bool:
    """Decide about an edge and all that follows; ``False`` if no tour is left.

    Each place has two edges, and no circle is shorter than the tour. After ``False`` the
    decisions are inconsistent until :func:`forget`.
    """
    n = len(decided.taken)
    todo = decided.todo
    todo[0] = edge + 1 if wanted == IN else -edge - 1
    count = 1
    while count > 0:
        count -= 1
        edge = abs(todo[count]) - 1
        wanted = IN if todo[count] > 0 else OUT
        if decided.state[edge] == wanted:
            continue
        if decided.state[edge] != FREE:
            return False
        a, b = edges.one[edge], edges.other[edge]
        decided.state[edge] = wanted
        decided.trail[decided.made[0]] = edge
        decided.made[0] += 1
        if wanted == OUT:
            decided.left[a] -= 1
            decided.left[b] -= 1
            if decided.left[a] < 2 or decided.left[b] < 2:
                return False
            if decided.left[a] == 2:
                count = _push_free(edges, decided, a, 1, count)
            if decided.left[b] == 2:
                count = _push_free(edges, decided, b, 1, count)
            continue
        decided.taken[a] += 1
        decided.taken[b] += 1
        if decided.taken[a] > 2 or decided.taken[b] > 2:
            return False
        if decided.taken[a] == 2:
            count = _push_free(edges, decided, a, -1, count)
        if decided.taken[b] == 2:
            count = _push_free(edges, decided, b, -1, count)
        end, before = _far_end(edges, decided, edge, a)
        if end == b:
            if before + 1 < n:
                return False
            continue
        start, after = _far_end(edges, decided, edge, b)
        if before + after + 1 < n - 1:  # the edge between the ends of the path would close it
            for k in range(edges.starts[end], edges.starts[end + 1]):
                closing = edges.at[k]
                if _other_end(edges, closing, end) == start and decided.state[closing] == FREE:
                    todo[count] = -closing - 1
                    count += 1
    return True


@compiled
def forget(edges: Edges, decided: Decisions, mark: int) -> None:
    """Take back all decisions but the first ``mark``."""
    while decided.made[0] > mark:
        decided.made[0] -= 1
        edge = decided.trail[decided.made[0]]
        a, b = edges.one[edge], edges.other[edge]
        if decided.state[edge] == IN:
            decided.taken[a] -= 1
            decided.taken[b] -= 1
        else:
            decided.left[a] += 1
            decided.left[b] += 1
        decided.state[edge] = FREE
