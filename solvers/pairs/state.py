"""A choice of candidates with all sums over its pairs, ready for compiled code."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from solvers.pairs.problem import PairCoverProblem

Array = NDArray[Any]

GRAIN = 2.0**32
"""Values are whole multiples of 1 / ``GRAIN``: in double precision their sums are exact up to
2**21, in any order."""

BONUS = 0.5
FINE_WORTH = 0.25
START = (0.25, 0.125)
LATE = 16
"""Changes that an element may keep for later; with one more, all its sums are made anew."""


class State(NamedTuple):
    """What a search keeps; every sum follows each change of the choice exactly.

    The worth of an element is ``min(value, target)``, plus ``fine_worth`` for each fine hit
    that it wants, plus ``bonus`` once it is satisfied; elements out of reach have none. As
    single hits earn nothing, the first two also count by nearness times facing.

    Most elements have more than they need: whoever is added there gains nothing, before and after
    a change. Such a change is only noted, and the sums of the hits not chosen follow when their
    element is in need again, or never if the change is taken back first.

    Attributes
    ----------
    indptr, element, place, good
        Hits of each candidate: row starts (C + 1,), element, place by element, and whether it is
        fine (nnz,).
    starts, owner, sight, fine
        Hits of each element: row starts (E + 1,), candidate, ray with nearness and facing
        (5, nnz), and whether it is fine.
    weights, prices, live, fine_demand, target, extras
        Pair weights; price of each candidate; elements in reach, their fine hits wanted and
        their targets; and worth of a fine hit, bonus and worth of the first and second single hit.
    group_ptr, group, rival_ptr, rival
        Conflict groups of each candidate, and candidates of each group.
    partial
        What each hit that is not chosen would bring its element in pairs with the chosen ones,
        by element (nnz,), without the changes kept for later. Those of chosen hits mean nothing.
    value, hits, fine_hits
        Value, chosen hits and chosen fine hits of each element, (E,).
    crew, crew_sight, crew_sum, seat
        The chosen hits of each element from its start on, their rays with nearness and facing,
        (5, nnz), and the sums of their pairs with the others, (nnz,), so that they lie side by
        side; and where among them each chosen hit is.
    late, kept
        How many changes each element keeps for later, (E,), and which, (E, LATE): twice the hit,
        plus one if it was taken out; one more than LATE where they are no longer kept, and what
        the hits not chosen would bring is to be summed up anew.
    risk
        Whether any one chosen hit is needed by each element, (E,): 0 if that is not known, 1 if
        none is, 2 if the fine ones are, 3 if others may be too.
    taken, gain, blocked
        Whether each candidate is chosen, the worth it would add if not (minus infinity if it
        is), and how many chosen ones it conflicts with, (C,).
    totals
        Elements satisfied, price and worth.
    row
        Room for a number a hit of any one element.

    """

    indptr: Array
    element: Array
    place: Array
    good: Array
    starts: Array
    owner: Array
    sight: Array
    fine: Array
    weights: Array
    prices: Array
    live: Array
    fine_demand: Array
    target: Array
    extras: Array
    group_ptr: Array
    group: Array
    rival_ptr: Array
    rival: Array
    partial: Array
    value: Array
    hits: Array
    fine_hits: Array
    crew: Array
    crew_sight: Array
    crew_sum: Array
    seat: Array
    late: Array
    kept: Array
    risk: Array
    taken: Array
    gain: Array
    blocked: Array
    totals: Array
    row: Array


def empty_state(
    problem: "PairCoverProblem", *, bonus: float = BONUS, fine_worth: float = FINE_WORTH
) -> State:
    """State of the empty choice.

    Parameters
    ----------
    problem
        What to choose for.
    bonus, fine_worth
        Worth of a satisfied element beyond its value, and of a wanted fine hit, in times the
        highest target.

    """
    from solvers.pairs import state_kernels

    starts, at, owner = problem.by_element
    place = np.empty(len(at), dtype=np.int32)
    place[at] = np.arange(len(at), dtype=np.int32)
    target = problem.target
    extras = np.array([fine_worth, bonus, *START]) * target.max(initial=0.0)
    sizes = np.array([len(group) for group in problem.conflicts], dtype=np.int64)
    members = np.concatenate([*problem.conflicts, np.empty(0, dtype=np.int64)])
    by_candidate = np.argsort(members, kind="stable")
    reached = np.searchsorted(members[by_candidate], np.arange(problem.candidates + 1))
    state = State(
        indptr=problem.indptr,
        element=problem.indices,
        place=place,
        good=problem.fine,
        starts=starts,
        owner=owner,
        sight=problem.sight,
        fine=problem.fine[at],
        weights=problem.weights,
        prices=problem.prices,
        live=problem.reachable,
        fine_demand=problem.fine_demand,
        target=np.ceil(target * GRAIN) / GRAIN,
        extras=np.floor(extras * GRAIN) / GRAIN,
        group_ptr=reached.astype(np.int64),
        group=np.repeat(np.arange(len(sizes)), sizes)[by_candidate].astype(np.int64),
        rival_ptr=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        rival=members.astype(np.int64),
        partial=np.zeros(len(at)),
        value=np.zeros(problem.elements),
        hits=np.zeros(problem.elements, dtype=np.int64),
        fine_hits=np.zeros(problem.elements, dtype=np.int64),
        crew=np.empty(len(at), dtype=np.int32),
        crew_sight=np.empty((5, len(at)), dtype=np.float32),
        crew_sum=np.empty(len(at)),
        seat=np.empty(len(at), dtype=np.int32),
        late=np.zeros(problem.elements, dtype=np.int64),
        kept=np.empty((problem.elements, LATE), dtype=np.int64),
        risk=np.zeros(problem.elements, dtype=np.uint8),
        taken=np.zeros(problem.candidates, dtype=np.bool_),
        gain=np.zeros(problem.candidates),
        blocked=np.zeros(problem.candidates, dtype=np.int64),
        totals=np.zeros(3),
        row=np.empty(int(np.diff(starts).max(initial=0))),
    )
    state_kernels.start(state)
    return state
