"""Compiled changes of a choice: adding, removing and undoing are one call.

Arrays are taken out of the state before each loop: a field is counted as a new reference
every time that it is read.
"""

# ruff: noqa: PLR0917 - positional arguments, as compiled code takes them

import numpy as np

from solvers.compiled import compiled
from solvers.pairs.kernels import grain, pair_value, pair_values
from solvers.pairs.state import LATE, Array, State


@compiled
def worth(
    value: float, fine: int, want: int, target: float, fine_worth: float, bonus: float
) -> float:
    """Worth of an element with a value and a number of fine hits, of which it wants some."""
    total = min(value, target) + fine_worth * min(fine, want)
    if value >= target and fine >= want:
        total += bonus
    return float(total)


@compiled
def gain_of(s: State, c: int) -> float:
    """What candidate ``c``, if it were added, would add."""
    elements, place, live, value, fine_hits = s.element, s.place, s.live, s.value, s.fine_hits
    partial, fine, wanted, hits, sight = s.partial, s.fine, s.fine_demand, s.hits, s.sight
    extras, late, goal = s.extras, s.late, s.target
    total = 0.0
    for at in range(s.indptr[c], s.indptr[c + 1]):
        e, k = elements[at], place[at]
        if late[e] > 0 or not live[e]:  # the former have all they want
            continue
        if value[e] >= goal[e] and fine_hits[e] >= wanted[e] and hits[e] >= 2:
            continue
        rule = (goal[e], extras[0], extras[1])
        more = fine_hits[e] + fine[k]
        total += worth(value[e] + partial[k], more, wanted[e], *rule)
        total -= worth(value[e], fine_hits[e], wanted[e], *rule)
        if hits[e] < 2:
            total += grain(extras[2 + hits[e]] * max(sight[3, k], 0.0) * max(sight[4, k], 0.0))
    return float(total)


@compiled
def loss_of(s: State, c: int) -> tuple[int, float]:
    """Satisfied elements, and worth, that would be lost without the chosen candidate ``c``."""
    return loss_within(s, c, len(s.value), np.inf)


@compiled
def loss_within(s: State, c: int, most_lost: int, most: float) -> tuple[int, float]:
    """As :func:`loss_of`; less than all of it once both are at least as much as given."""
    elements, place, values, fine_hits, risk = s.element, s.place, s.value, s.fine_hits, s.risk
    crew_sum, seat, good, wanted = s.crew_sum, s.seat, s.good, s.fine_demand
    goal, fine_worth, bonus = s.target, s.extras[0], s.extras[1]
    lost, total = 0, 0.0
    for at in range(s.indptr[c], s.indptr[c + 1]):
        e = elements[at]
        if risk[e] == 0:
            risk[e] = _risk(s, e)
        if risk[e] == 1 or (risk[e] == 2 and not good[at]):
            continue
        value, now, want, target = values[e], fine_hits[e], wanted[e], goal[e]
        rule = (target, fine_worth, bonus)
        lower, less = value, now - good[at]
        if risk[e] == 3:  # the sum is far away in memory
            lower = value - crew_sum[seat[place[at]]]
        if lower >= target and less >= want:
            continue
        total += worth(value, now, want, *rule) - worth(lower, less, want, *rule)
        if value >= target and now >= want:
            lost += 1
        if lost >= most_lost and total >= most:
            break
    return lost, total


@compiled
def _risk(s: State, e: int) -> int:
    """Whether an element would be worth less without one of its chosen hits; see ``risk``."""
    if not s.live[e]:
        return 1
    target, value, crew_sum = s.target[e], s.value[e], s.crew_sum
    worst = 1 if s.fine_hits[e] > s.fine_demand[e] else 2
    for n in range(s.starts[e], s.starts[e] + s.hits[e]):
        if value - crew_sum[n] < target:
            worst = 3
    return worst


@compiled
def start(s: State) -> None:
    """Gains of the choice as it is, element by element, as they lie side by side in memory."""
    owner, partial, fine, sight, gain = s.owner, s.partial, s.fine, s.sight, s.gain
    extras, goal = s.extras, s.target
    gain[:] = 0.0
    for e in range(len(s.value)):
        value, now, want, hits = s.value[e], s.fine_hits[e], s.fine_demand[e], s.hits[e]
        if not s.live[e] or (value >= goal[e] and now >= want and hits >= 2):
            continue
        rule = (goal[e], extras[0], extras[1])
        base, single = worth(value, now, want, *rule), extras[2 + hits] if hits < 2 else 0.0
        for k in range(s.starts[e], s.starts[e + 1]):
            more = worth(value + partial[k], now + fine[k], want, *rule) - base
            if hits < 2:
                more += grain(single * max(sight[3, k], 0.0) * max(sight[4, k], 0.0))
            gain[owner[k]] += more
    for c in range(len(gain)):
        if s.taken[c]:
            gain[c] = -np.inf


@compiled
def adopt(s: State, candidates: Array, limit: float) -> None:
    """Add candidates to the empty choice, as to flip each that fits and conflicts with none.

    Works element by element, which is far quicker than candidate by candidate.
    """
    if len(candidates) == 0:
        return
    starts, owner, live, taken, totals = s.starts, s.owner, s.live, s.taken, s.totals
    values, hits, fine_hits, late, row = s.value, s.hits, s.fine_hits, s.late, s.row
    crew, sums = (s.crew, s.crew_sight, s.crew_sum, s.seat), (s.partial, s.sight, s.weights, row)
    goal, fine_worth, bonus = s.target, s.extras[0], s.extras[1]
    for c in candidates:
        if totals[1] + s.prices[c] <= limit and s.blocked[c] == 0:
            taken[c] = True
            totals[1] += s.prices[c]
            _block(s, c, 1)
    for e in range(len(values)):
        first, last, want, target = starts[e], starts[e + 1], s.fine_demand[e], goal[e]
        rule = (target, fine_worth, bonus)
        for k in range(first, last):
            if taken[owner[k]]:
                values[e] += _join(*crew, first, hits[e], k, s.sight, s.weights, row)
                hits[e] += 1
                fine_hits[e] += s.fine[k]
        done = values[e] >= target and fine_hits[e] >= want
        late[e] = LATE + 1
        if live[e]:
            totals[0] += done
            totals[2] += worth(values[e], fine_hits[e], want, *rule)
        if live[e] and (not done or hits[e] < 2):
            _renew(first, last, s.crew_sight, hits[e], *sums)
            late[e] = 0
    start(s)


@compiled
def flip(s: State, v: int) -> None:
    """Add candidate ``v`` if it is not chosen, take it out if it is; twice undoes it."""
    elements, place, starts, owner, live = s.element, s.place, s.starts, s.owner, s.live
    partial, fine, sight, weights, taken = s.partial, s.fine, s.sight, s.weights, s.taken
    values, hits, fine_hits, gain, extras = s.value, s.hits, s.fine_hits, s.gain, s.extras
    late, kept, fine_demand, totals, row = s.late, s.kept, s.fine_demand, s.totals, s.row
    risk = s.risk
    crew_sight, crew = s.crew_sight, (s.crew, s.crew_sight, s.crew_sum, s.seat)
    goal, fine_worth, bonus = s.target, extras[0], extras[1]
    adds = not taken[v]
    sign = 1 if adds else -1
    taken[v] = adds
    for at in range(s.indptr[v], s.indptr[v + 1]):
        e, a = elements[at], place[at]
        first, last, want, target = starts[e], starts[e + 1], fine_demand[e], goal[e]
        rule = (target, fine_worth, bonus)
        old, old_fine, old_hits = values[e], fine_hits[e], hits[e]
        if adds:
            more = _join(*crew, first, old_hits, a, sight, weights, row)
        else:
            more = _leave(*crew, first, old_hits, a, weights, row)
        new, new_fine, new_hits = old + sign * more, old_fine + sign * fine[a], old_hits + sign
        values[e], fine_hits[e], hits[e], risk[e] = new, new_fine, new_hits, 0
        done = min(old, new) >= target and min(old_fine, new_fine) >= want
        if not live[e]:
            late[e] = LATE + 1
            continue
        if done and min(old_hits, new_hits) >= 2:
            if not adds and late[e] <= LATE:
                partial[a] = more - _kept_sum(kept[e, : late[e]], a, sight, weights)
            late[e] = _keep(kept[e], late[e], a, adds)
            continue
        if late[e] > min(LATE, old_hits):
            _renew(first, last, crew_sight, min(old_hits, new_hits), partial, sight, weights, row)
            if not adds:  # the crew is already without it
                _count(first, last, sight, a, 1, partial, sight, weights, row)
        elif late[e] > 0:
            _settle(first, last, kept[e, : late[e]], partial, sight, weights, row)
        late[e] = 0
        rise = worth(new, new_fine, want, *rule) - worth(old, old_fine, want, *rule)
        open_before = old < target or old_fine < want
        totals[0] += int(open_before) - int(new < target or new_fine < want)
        totals[2] += rise
        pair_values(sight, a, sight, first, last, weights, row)
        change = (sign, old, old_fine, new, new_fine, want, rise)
        _changes(row, partial[first:last], fine[first:last], change, rule)
        if min(old_hits, new_hits) < 2:
            old_single = extras[2 + old_hits] if old_hits < 2 else 0.0
            new_single = extras[2 + new_hits] if new_hits < 2 else 0.0
            for k in range(first, last):
                lone = max(sight[3, k], 0.0) * max(sight[4, k], 0.0)
                row[k - first] += grain(new_single * lone) - grain(old_single * lone)
        for k in range(first, last):
            gain[owner[k]] += row[k - first]
        if not adds:
            partial[a] = more
    totals[1] += sign * s.prices[v]
    gain[v] = -np.inf if adds else gain_of(s, v)
    _block(s, v, sign)


@compiled
def _block(s: State, v: int, sign: int) -> None:
    """Count one chosen candidate more, or less, that others conflict with."""
    for g in range(s.group_ptr[v], s.group_ptr[v + 1]):
        for r in range(s.rival_ptr[s.group[g]], s.rival_ptr[s.group[g] + 1]):
            if s.rival[r] != v:
                s.blocked[s.rival[r]] += sign


@compiled
def _changes(
    row: Array,
    partial: Array,
    fine: Array,
    change: tuple[int, float, int, float, int, int, float],
    rule: tuple[float, float, float],
) -> None:
    """Turn values of pairs in ``row`` into changes of gains, and add them to ``partial``.

    ``change`` holds the sign, value and fine hits before and after, the fine hits wanted and
    the worth that the element won.
    """
    sign, old, old_fine, new, new_fine, want, rise = change
    target, _, bonus = rule
    for k in range(len(partial)):
        before = partial[k]
        after = before + sign * row[k]
        partial[k] = after
        if want == 0:  # the same as below
            won = min(new + after, target) - min(old + before, target) - rise
            won += bonus if new + after >= target else 0.0
            won -= bonus if old + before >= target else 0.0
        else:
            won = worth(new + after, new_fine + fine[k], want, *rule) - rise
            won -= worth(old + before, old_fine + fine[k], want, *rule)
        row[k] = won


@compiled
def _join(
    crew: Array,
    crew_sight: Array,
    crew_sum: Array,
    seat: Array,
    first: int,
    size: int,
    a: int,
    sight: Array,
    weights: Array,
    row: Array,
) -> float:
    """Put hit ``a`` beside the ``size`` chosen ones from ``first`` on; the sum of its pairs."""
    total, end = 0.0, first + size
    pair_values(sight, a, crew_sight, first, end, weights, row)
    for n in range(size):
        crew_sum[first + n] += row[n]
        total += row[n]
    crew[end], crew_sum[end], seat[a] = a, total, end
    for column in range(5):
        crew_sight[column, end] = sight[column, a]
    return total


@compiled
def _leave(
    crew: Array,
    crew_sight: Array,
    crew_sum: Array,
    seat: Array,
    first: int,
    size: int,
    a: int,
    weights: Array,
    row: Array,
) -> float:
    """Take hit ``a`` out of the ``size`` chosen ones from ``first`` on; the sum of its pairs."""
    place, end = seat[a], first + size - 1
    total = crew_sum[place]
    pair_values(crew_sight, place, crew_sight, first, end + 1, weights, row)
    for n in range(size):
        crew_sum[first + n] -= row[n]
    crew[place], crew_sum[place], seat[crew[end]] = crew[end], crew_sum[end], place
    for column in range(5):
        crew_sight[column, place] = crew_sight[column, end]
    return float(total)


@compiled
def _keep(kept: Array, size: int, a: int, adds: bool) -> int:
    """Keep a change for later, or forget both it and its opposite; new number kept."""
    if size > LATE:
        return size
    opposite = 2 * a + int(adds)
    for n in range(size):
        if kept[n] == opposite:
            kept[n] = kept[size - 1]
            return size - 1
    if size < LATE:
        kept[size] = 2 * a + int(not adds)
    return size + 1


@compiled
def _kept_sum(kept: Array, k: int, sight: Array, weights: Array) -> float:
    """What the changes kept for later bring to hit ``k``."""
    total = 0.0
    for mark in kept:
        a = mark >> 1
        if a != k:
            value = pair_value(sight, a, sight, k, weights)
            total += -value if mark & 1 else value
    return total


@compiled
def _settle(
    first: int, last: int, kept: Array, partial: Array, sight: Array, weights: Array, row: Array
) -> None:
    """Bring the hits not chosen up to date with the changes kept for later."""
    for mark in kept:
        a = mark >> 1
        own = partial[a]  # knows of it already
        _count(first, last, sight, a, -1 if mark & 1 else 1, partial, sight, weights, row)
        partial[a] = own


@compiled
def _renew(
    first: int,
    last: int,
    crew_sight: Array,
    size: int,
    partial: Array,
    sight: Array,
    weights: Array,
    row: Array,
) -> None:
    """Sum up anew what the hits not chosen would bring in pairs with ``size`` of the crew."""
    partial[first:last] = 0.0
    for n in range(first, first + size):
        _count(first, last, crew_sight, n, 1, partial, sight, weights, row)


@compiled
def _count(
    first: int,
    last: int,
    other: Array,
    a: int,
    sign: int,
    partial: Array,
    sight: Array,
    weights: Array,
    row: Array,
) -> None:
    """Add the pairs of hit ``a`` of ``other`` with each hit of an element, times the sign."""
    pair_values(other, a, sight, first, last, weights, row)
    part = partial[first:last]
    for k in range(len(part)):
        part[k] += sign * row[k]


@compiled
def settle(s: State) -> None:
    """Bring every sum up to date, and those of the chosen hits to where the others are."""
    sums = (s.partial, s.sight, s.weights, s.row)
    for e in range(len(s.late)):
        first, last = s.starts[e], s.starts[e + 1]
        if s.late[e] > LATE:
            _renew(first, last, s.crew_sight, s.hits[e], *sums)
        else:
            _settle(first, last, s.kept[e, : s.late[e]], *sums)
        s.late[e] = 0
        for n in range(first, first + s.hits[e]):
            s.partial[s.crew[n]] = s.crew_sum[n]
