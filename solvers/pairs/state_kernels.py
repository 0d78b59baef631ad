"""Compiled changes of a choice: adding, removing and undoing are one call.

Arrays are taken out of the state before each loop: a field is counted as a new reference
every time that it is read.
"""

# ruff: noqa: PLR0917 - positional arguments, as compiled code takes them

from solvers.compiled import compiled
from solvers.pairs.kernels import grain, pair_value
from solvers.pairs.state import State


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
    partial, fine, wanted = s.partial, s.fine, s.fine_demand
    target = s.limits[0]
    rule = (target, s.limits[1], s.limits[2])
    lost, total = 0, 0.0
    for at in range(s.indptr[c], s.indptr[c + 1]):
        e, k = elements[at], place[at]
        value, now, want = values[e], fine_hits[e], wanted[e]
        lower, less = value - partial[k], now - fine[k]
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
    target, totals = limits[0], s.totals
    rule = (target, limits[1], limits[2])
    sign = -1 if taken[v] else 1
    taken[v] = not taken[v]
    for at in range(s.indptr[v], s.indptr[v + 1]):
        e, a = elements[at], place[at]
        want = s.fine_demand[e]
        old, old_fine, old_hits = values[e], fine_hits[e], hits[e]
        new, new_fine, new_hits = (
            old + sign * partial[a],
            old_fine + sign * fine[a],
            old_hits + sign,
        )
        values[e], fine_hits[e], hits[e] = new, new_fine, new_hits
        old_single = limits[3 + old_hits] if old_hits < 2 else 0.0
        new_single = limits[3 + new_hits] if new_hits < 2 else 0.0
        done = min(old, new) >= target and min(old_fine, new_fine) >= want
        idle = not live[e] or (done and old_single == new_single == 0.0)
        rise = worth(new, new_fine, want, *rule) - worth(old, old_fine, want, *rule)
        for k in range(starts[e], starts[e + 1]):
            if k == a:
                continue
            before = partial[k]
            after = before + sign * pair_value(a, k, sight, weights)
            partial[k] = after
            if idle or taken[owner[k]]:
                continue
            change = worth(new + after, new_fine + fine[k], want, *rule) - rise
            change -= worth(old + before, old_fine + fine[k], want, *rule)
            if old_single != new_single:
                lone = max(sight[k, 3], 0.0) * max(sight[k, 4], 0.0)
                change += grain(new_single * lone) - grain(old_single * lone)
            gain[owner[k]] += change
        if live[e]:
            open_before = old < target or old_fine < want
            totals[0] += int(open_before) - int(new < target or new_fine < want)
            totals[2] += rise
    totals[1] += sign * s.prices[v]
    gain[v] = gain_of(s, v)
    for g in range(s.group_ptr[v], s.group_ptr[v + 1]):
        for r in range(s.rival_ptr[s.group[g]], s.rival_ptr[s.group[g] + 1]):
            if s.rival[r] != v:
                s.blocked[s.rival[r]] += sign
