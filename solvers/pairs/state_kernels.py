"""Compiled changes of a choice: adding, removing and undoing are one call.

Arrays are taken out of the state before each loop: a field is counted as a new reference
every time that it is read.
"""

# ruff: noqa: PLR0917 - positional arguments, as compiled code takes them

from solvers.compiled import compiled
from solvers.pairs.kernels import grain, pair_value
from solvers.pairs.state import Array, State


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
    limits = s.limits
    rule = (limits[0], limits[1], limits[2])
    total = 0.0
    for at in range(s.indptr[c], s.indptr[c + 1]):
        e, k = elements[at], place[at]
        if not live[e]:
            continue
        if value[e] >= limits[0] and fine_hits[e] >= wanted[e] and hits[e] >= 2:
            continue  # whose sums may be kept for later
        more = fine_hits[e] + fine[k]
        total += worth(value[e] + partial[k], more, wanted[e], *rule)
        total -= worth(value[e], fine_hits[e], wanted[e], *rule)
        if hits[e] < 2:
            total += grain(limits[3 + hits[e]] * max(sight[k, 3], 0.0) * max(sight[k, 4], 0.0))
    return float(total)


@compiled
def loss_of(s: State, c: int) -> tuple[int, float]:
    """Satisfied elements, and worth, that would be lost without the chosen candidate ``c``."""
    elements, place, live, values, fine_hits = s.element, s.place, s.live, s.value, s.fine_hits
    crew_sum, seat, fine, wanted = s.crew_sum, s.seat, s.fine, s.fine_demand
    target = s.limits[0]
    rule = (target, s.limits[1], s.limits[2])
    lost, total = 0, 0.0
    for at in range(s.indptr[c], s.indptr[c + 1]):
        e, k = elements[at], place[at]
        value, now, want = values[e], fine_hits[e], wanted[e]
        lower, less = value - crew_sum[seat[k]], now - fine[k]
        if not live[e] or (lower >= target and less >= want):
            continue
        total += worth(value, now, want, *rule) - worth(lower, less, want, *rule)
        if value >= target and now >= want:
            lost += 1
    return lost, total


@compiled
def start(s: State) -> None:
    """Gains of the empty choice."""
    for c in range(len(s.taken)):
        s.gain[c] = gain_of(s, c)


@compiled
def flip(s: State, v: int) -> None:
    """Add candidate ``v`` if it is not chosen, take it out if it is; twice undoes it."""
    elements, place, starts, owner, live = s.element, s.place, s.starts, s.owner, s.live
    partial, fine, sight, weights, taken = s.partial, s.fine, s.sight, s.weights, s.taken
    values, hits, fine_hits, gain, limits = s.value, s.hits, s.fine_hits, s.gain, s.limits
    late, kept, fine_demand, totals = s.late, s.kept, s.fine_demand, s.totals
    crew = (s.crew, s.crew_sight, s.crew_sum, s.seat)
    target = limits[0]
    rule, bonus = (target, limits[1], limits[2]), limits[2]
    adds = not taken[v]
    sign = 1 if adds else -1
    taken[v] = adds
    for at in range(s.indptr[v], s.indptr[v + 1]):
        e, a = elements[at], place[at]
        first, last, want = starts[e], starts[e + 1], fine_demand[e]
        old, old_fine, old_hits = values[e], fine_hits[e], hits[e]
        if adds:
            more = _join(*crew, first, old_hits, a, sight, weights)
        else:
            more = _leave(*crew, first, old_hits, a, weights)
            partial[a] = more - _kept_sum(kept[e, : late[e]], a, sight, weights)
        new, new_fine, new_hits = old + sign * more, old_fine + sign * fine[a], old_hits + sign
        values[e], fine_hits[e], hits[e] = new, new_fine, new_hits
        done = min(old, new) >= target and min(old_fine, new_fine) >= want
        if not live[e] or (done and min(old_hits, new_hits) >= 2):
            if late[e] == kept.shape[1]:
                _settle(first, last, kept[e], taken, owner, partial, sight, weights)
                late[e] = 0
            late[e] = _keep(kept[e], late[e], a, adds)
            continue
        if late[e] > 0:
            _settle(first, last, kept[e, : late[e]], taken, owner, partial, sight, weights)
            late[e] = 0
        rise = worth(new, new_fine, want, *rule) - worth(old, old_fine, want, *rule)
        open_before = old < target or old_fine < want
        totals[0] += int(open_before) - int(new < target or new_fine < want)
        totals[2] += rise
        old_single = limits[3 + old_hits] if old_hits < 2 else 0.0
        new_single = limits[3 + new_hits] if new_hits < 2 else 0.0
        for k in range(first, last):
            c = owner[k]
            if taken[c] or k == a:
                continue
            before = partial[k]
            after = before + sign * pair_value(sight, a, sight, k, weights)
            partial[k] = after
            if want == 0:  # the same as below
                change = min(new + after, target) - min(old + before, target) - rise
                if new + after >= target:
                    change += bonus
                if old + before >= target:
                    change -= bonus
            else:
                change = worth(new + after, new_fine + fine[k], want, *rule) - rise
                change -= worth(old + before, old_fine + fine[k], want, *rule)
            if old_single != new_single:
                lone = max(sight[k, 3], 0.0) * max(sight[k, 4], 0.0)
                change += grain(new_single * lone) - grain(old_single * lone)
            gain[c] += change
    totals[1] += sign * s.prices[v]
    if not adds:
        gain[v] = gain_of(s, v)
    for g in range(s.group_ptr[v], s.group_ptr[v + 1]):
        for r in range(s.rival_ptr[s.group[g]], s.rival_ptr[s.group[g] + 1]):
            if s.rival[r] != v:
                s.blocked[s.rival[r]] += sign


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
) -> float:
    """Put hit ``a`` beside the ``size`` chosen ones from ``first`` on; the sum of its pairs."""
    total, end = 0.0, first + size
    for n in range(first, end):
        value = pair_value(sight, a, crew_sight, n, weights)
        crew_sum[n] += value
        total += value
    crew[end], crew_sum[end], seat[a] = a, total, end
    for column in range(5):
        crew_sight[end, column] = sight[a, column]
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
) -> float:
    """Take hit ``a`` out of the ``size`` chosen ones from ``first`` on; the sum of its pairs."""
    place, end = seat[a], first + size - 1
    total = crew_sum[place]
    for n in range(first, end + 1):
        if n != place:
            crew_sum[n] -= pair_value(crew_sight, place, crew_sight, n, weights)
    crew[place], crew_sum[place], seat[crew[end]] = crew[end], crew_sum[end], place
    for column in range(5):
        crew_sight[place, column] = crew_sight[end, column]
    return float(total)


@compiled
def _keep(kept: Array, size: int, a: int, adds: bool) -> int:
    """Keep a change for later, or forget both it and its opposite; new number kept."""
    opposite = 2 * a + int(adds)
    for n in range(size):
        if kept[n] == opposite:
            kept[n] = kept[size - 1]
            return size - 1
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
    first: int,
    last: int,
    kept: Array,
    taken: Array,
    owner: Array,
    partial: Array,
    sight: Array,
    weights: Array,
) -> None:
    """Bring the hits not chosen up to date with the changes kept for later."""
    for k in range(first, last):
        if not taken[owner[k]]:
            partial[k] += _kept_sum(kept, k, sight, weights)


@compiled
def settle(s: State) -> None:
    """Bring every sum up to date, and those of the chosen hits to where the others are."""
    for e in range(len(s.late)):
        first, last, kept = s.starts[e], s.starts[e + 1], s.kept[e, : s.late[e]]
        _settle(first, last, kept, s.taken, s.owner, s.partial, s.sight, s.weights)
        s.late[e] = 0
        for n in range(first, first + s.hits[e]):
            s.partial[s.crew[n]] = s.crew_sum[n]
