"""Compiled changes of a choice: adding, removing and undoing are one call."""

from solvers.compiled import compiled
from solvers.pairs.kernels import grain, pair_value
from solvers.pairs.state import State


@compiled
def worth(s: State, e: int, value: float, fine: int) -> float:
    """Worth of an element at a value and a number of fine hits."""
    target, want = s.limits[0], s.fine_demand[e]
    total = min(value, target) + s.limits[1] * min(fine, want)
    if value >= target and fine >= want:
        total += s.limits[2]
    return float(total)


@compiled
def share_of_gain(s: State, e: int, k: int) -> float:
    """What hit ``k``, if it were taken, would add at element ``e``."""
    fine = s.fine_hits[e]
    more = fine + 1 if s.fine[k] else fine
    change = worth(s, e, s.value[e] + s.partial[k], more) - worth(s, e, s.value[e], fine)
    hits = s.hits[e]
    if hits < 2:
        change += grain(s.limits[3 + hits] * max(s.sight[k, 3], 0.0) * max(s.sight[k, 4], 0.0))
    return change


@compiled
def gain_of(s: State, c: int) -> float:
    """What candidate ``c``, if it were added, would add."""
    total = 0.0
    for at in range(s.indptr[c], s.indptr[c + 1]):
        if s.live[s.element[at]]:
            total += share_of_gain(s, s.element[at], s.place[at])
    return total


@compiled
def loss_of(s: State, c: int) -> tuple[int, float]:
    """Satisfied elements, and worth, that would be lost without the chosen candidate ``c``."""
    lost, total = 0, 0.0
    target = s.limits[0]
    for at in range(s.indptr[c], s.indptr[c + 1]):
        e, k = s.element[at], s.place[at]
        if not s.live[e]:
            continue
        value, fine = s.value[e], s.fine_hits[e]
        less = fine - 1 if s.fine[k] else fine
        lower = value - s.partial[k]
        if lower >= target and less >= s.fine_demand[e]:
            continue
        total += worth(s, e, value, fine) - worth(s, e, lower, less)
        if value >= target and fine >= s.fine_demand[e]:
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
    sign = -1 if s.taken[v] else 1
    s.taken[v] = not s.taken[v]
    target = s.limits[0]
    for at in range(s.indptr[v], s.indptr[v + 1]):
        e, a = s.element[at], s.place[at]
        old, old_fine, want = s.value[e], s.fine_hits[e], s.fine_demand[e]
        new = old + sign * s.partial[a]
        new_fine = old_fine + sign if s.fine[a] else old_fine
        done = min(old, new) >= target and min(old_fine, new_fine) >= want
        open_before = old < target or old_fine < want
        open_after = new < target or new_fine < want
        idle = not s.live[e] or (done and min(s.hits[e], s.hits[e] + sign) > 1)
        for k in range(s.starts[e], s.starts[e + 1]):
            c = s.owner[k]
            pair = 0.0 if k == a else sign * pair_value(a, k, s.sight, s.weights)
            if not idle and not s.taken[c]:
                s.gain[c] -= share_of_gain(s, e, k)
            s.partial[k] += pair
        s.value[e], s.fine_hits[e] = new, new_fine
        s.hits[e] += sign
        if idle:
            continue
        for k in range(s.starts[e], s.starts[e + 1]):
            if not s.taken[s.owner[k]]:
                s.gain[s.owner[k]] += share_of_gain(s, e, k)
        s.totals[0] += int(open_before) - int(open_after)
        s.totals[2] += worth(s, e, new, new_fine) - worth(s, e, old, old_fine)
    s.totals[1] += sign * s.prices[v]
    s.gain[v] = gain_of(s, v)
    for g in range(s.group_ptr[v], s.group_ptr[v + 1]):
        for r in range(s.rival_ptr[s.group[g]], s.rival_ptr[s.group[g] + 1]):
            if s.rival[r] != v:
                s.blocked[s.rival[r]] += sign
