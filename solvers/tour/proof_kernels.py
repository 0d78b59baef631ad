"""Compiled branch and bound over the edges of 1-trees; import only where used."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.tour.branch_kernels import Trees, ascend, imply
from solvers.tour.edge_kernels import FREE, IN, OUT, Decisions, Edges, decide, forget

Array = NDArray[Any]


class Frames(NamedTuple):
    """The branch under way: one frame a decision, deepest last; room for so many."""

    prices: Array
    """Prices of the places at the node, (most, n)."""
    bound: Array
    """Lower bound at the node, (most,)."""
    edge: Array
    """Edge that the node branches on, int32 (most,)."""
    first: Array
    """Decision tried first, int8 (most,)."""
    second: Array
    """Whether the other decision is being tried, bool (most,)."""
    mark: Array
    """Decisions made at the node, int64 (most,)."""
    at: Array
    """Depth, or -1 at the end; 1 where the node at that depth is still to be looked at, (2,)."""


def new_frames(most: int, places: int) -> Frames:
    """Only the root, still to be looked at."""
    return Frames(
        np.empty((most, places)),
        np.empty(most),
        np.empty(most, dtype=np.int32),
        np.empty(most, dtype=np.int8),
        np.empty(most, dtype=np.bool_),
        np.empty(most, dtype=np.int64),
        np.array([0, 1], dtype=np.int64),
    )


def with_room(frames: Frames) -> Frames:
    """The same branch, or a copy with twice the room if it is full."""
    most, places = frames.prices.shape
    if frames.at[0] < most:
        return frames
    larger = new_frames(2 * most, places)
    for old, new in zip(frames[:-1], larger[:-1], strict=True):
        new[:most] = old
    larger.at[:] = frames.at
    return larger


@compiled
def _look(
    edges: Edges, decided: Decisions, trees: Trees, cutoff: float, upper: float, steps: int
) -> tuple[float, bool]:
    """Bound at a node after all that it implies, infinite if no tour is left; whether a tour."""
    for _ in range(4):
        bound, tour = ascend(edges, decided, trees, trees.prices, cutoff, upper, steps)
        if bound >= cutoff or tour:
            break
        before = decided.made[0]
        for k in range(imply(edges, decided, trees, bound, cutoff)):
            edge = abs(trees.implied[k]) - 1
            if not decide(edges, decided, edge, IN if trees.implied[k] > 0 else OUT):
                return np.inf, False
        if decided.made[0] - before < 5 + len(trees.prices) // 10:
            break
    return bound, tour


@compiled
def _choose(
    edges: Edges,
    decided: Decisions,
    trees: Trees,
    bound: float,
    cutoff: float,
    upper: float,
    tries: int,
    steps: int,
) -> int:
    """Edge to branch on, or -1 if none is free: the one that raises both bounds most.

    Looked at are those that about half of the recent 1-trees had, dear ones first.
    """
    mark = decided.made[0]
    score = np.where(decided.state == FREE, (0.5 - np.abs(trees.share - 0.5)) * edges.cost, -1.0)
    share, prices = trees.share.copy(), np.empty_like(trees.prices)
    room = cutoff - bound
    chosen, most = -1, -1.0
    for _ in range(tries):
        edge = int(np.argmax(score))
        if score[edge] < 0.0:
            break
        score[edge] = -1.0
        worth = 1.0
        for wanted in (IN, OUT):
            if decide(edges, decided, edge, wanted):
                prices[:] = trees.prices
                after, _ = ascend(edges, decided, trees, prices, cutoff, upper, steps)
            else:
                after = np.inf
            forget(edges, decided, mark)
            worth *= max(min(after - bound, room), 1e-6 * room)
        if worth > most:
            chosen, most = edge, worth
    trees.share[:] = share
    return chosen


@compiled
def prove(
    edges: Edges,
    decided: Decisions,
    trees: Trees,
    frames: Frames,
    upper: Array,
    tour: Array,
    grain: float,
    slack: float,
    nodes: int,
    steps: int,
    tries: int,
    trial_steps: int,
) -> int:
    """Go on with the search, depth first; how many nodes were looked at.

    Parameters
    ----------
    edges, decided, trees, frames
        Where the search stands; ``frames.at[0]`` is -1 once it is over. It also comes back
        where ``frames`` is full.
    upper
        Cost of the best tour known, lowered when a better one is found, shape (1,).
    tour
        Edges of that better tour, bool (m,).
    grain, slack
        A node is done when its bound is above ``upper`` less ``grain``, or within ``slack``
        of it.
    nodes
        Most nodes to look at now.
    steps
        Subgradient steps at a node.
    tries, trial_steps
        Edges to try before branching, and the steps of each trial.

    """
    looked = 0
    while frames.at[0] >= 0:
        depth = frames.at[0]
        cutoff = upper[0] - grain + slack if grain > 0.0 else upper[0] - slack
        if frames.at[1] == 1:
            if looked == nodes or depth == len(frames.bound):
                return looked
            looked += 1
            frames.at[1] = 0
            if depth > 0:
                trees.prices[:] = frames.prices[depth - 1]
            bound, found = _look(edges, decided, trees, cutoff, upper[0], steps)
            if found and bound < cutoff:
                total = 0.0
                for edge in range(len(edges.cost)):
                    if trees.best[edge]:
                        total += edges.cost[edge]
                if total < upper[0]:
                    upper[0] = total
                    tour[:] = trees.best
            elif bound < cutoff:
                edge = _choose(edges, decided, trees, bound, cutoff, upper[0], tries, trial_steps)
                if edge >= 0:
                    frames.prices[depth] = trees.prices
                    frames.bound[depth] = bound
                    frames.edge[depth] = edge
                    frames.first[depth] = IN if trees.share[edge] >= 0.5 else OUT
                    frames.second[depth] = False
                    frames.mark[depth] = decided.made[0]
                    frames.at[0] = depth + 1
                    frames.at[1] = decide(edges, decided, edge, frames.first[depth])
                    continue
        # the node is done: try the other decision at the one above, or go up further
        frames.at[0] = depth - 1
        if depth == 0:
            break
        above = depth - 1
        forget(edges, decided, frames.mark[above])
        if not frames.second[above] and frames.bound[above] < cutoff:
            frames.second[above] = True
            frames.at[0] = depth
            other = OUT if frames.first[above] == IN else IN
            frames.at[1] = decide(edges, decided, frames.edge[above], other)
    return looked


@compiled
def open_bound(frames: Frames, upper: float) -> float:
    """Lower bound over all that is left to search, at most ``upper``."""
    bound = upper
    for k in range(frames.at[0]):
        if not frames.second[k] or k == frames.at[0] - 1:
            bound = min(bound, frames.bound[k])
    return bound
