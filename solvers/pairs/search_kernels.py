"""Compiled steps of a search: fill, prune, and ruin one neighbourhood."""

# ruff: noqa: PLR0917 - positional arguments, as compiled code takes them

import numpy as np

from solvers.compiled import compiled
from solvers.pairs.state import GRAIN, Array, State
from solvers.pairs.state_kernels import flip, loss_within

_BLOCK = 128  # candidates passed over together where none of them gains enough


@compiled
def best_addition(s: State, limit: float, banned: int) -> int:
    """Candidate of most gain for its price that fits below the price limit, or -1."""
    gain, blocked, prices = s.gain, s.blocked, s.prices
    best, best_key = -1, 0.0
    room = limit - s.totals[1]
    for first in range(0, len(gain), _BLOCK):
        last, low, worthy = min(first + _BLOCK, len(gain)), best_key * (1.0 - 1e-9), 0
        some, paid = gain[first:last], prices[first:last]
        for n in range(last - first):  # several at once
            worthy += 1 if some[n] >= max(low * paid[n], 0.5 / GRAIN) else 0
        if worthy == 0:
            continue
        for c in range(first, last):
            if gain[c] <= 0.0 or blocked[c] > 0 or c == banned or prices[c] > room:
                continue
            key = gain[c] / prices[c] if prices[c] > 0.0 else np.inf
            if key > best_key:
                best, best_key = c, key
    return best


@compiled
def best_single(s: State, limit: float, banned: int) -> int:
    """Candidate whose hits are worth most by themselves at open elements, or -1.

    For when no single addition makes a pair of any worth.
    """
    elements, place, live, value, sight = s.element, s.place, s.live, s.value, s.sight
    best, best_key = -1, 0.0
    room, target, indptr = limit - s.totals[1], s.target, s.indptr
    for c in range(len(s.taken)):
        if s.taken[c] or s.blocked[c] > 0 or c == banned or s.prices[c] > room:
            continue
        total = 0.0
        for at in range(indptr[c], indptr[c + 1]):
            if live[elements[at]] and value[elements[at]] < target[elements[at]]:
                total += max(sight[3, place[at]], 0.0) * max(sight[4, place[at]], 0.0)
        if total <= 0.0:
            continue
        key = total / s.prices[c] if s.prices[c] > 0.0 else np.inf
        if key > best_key:
            best, best_key = c, key
    return best


@compiled
def fill(s: State, wanted: int, limit: float, banned: int, log: Array, count: int) -> int:
    """Add by exact gain until so many elements are satisfied or nothing fits or helps.

    The changes are written to ``log`` from ``count``; returns the new count.
    """
    while s.totals[0] < wanted and count < len(log):
        c = best_addition(s, limit, banned)
        if c < 0:
            c = best_single(s, limit, banned)
        if c < 0:
            break
        flip(s, c)
        log[count] = c
        count += 1
    return count


@compiled
def least_loss(s: State) -> tuple[int, int]:
    """Chosen candidate that loses least for its price, and satisfied elements lost with it."""
    best, best_lost, best_key = -1, 0, np.inf
    for c in range(len(s.taken)):
        if s.taken[c]:
            price = s.prices[c]
            # A little more than can be of use, so that rounding of the quotient does not matter.
            lost, loss = loss_within(s, c, 0, best_key * price * (1.0 + 1e-9))
            key = loss / price if price > 0.0 else np.inf
            if best < 0 or key < best_key:
                best, best_lost, best_key = c, lost, key
    return best, best_lost


@compiled
def prune(s: State, wanted: int) -> None:
    """Drop what costs fewest satisfied elements, then least worth, while enough remain."""
    while True:
        best, best_lost, best_loss = -1, 0, 0.0
        for c in range(len(s.taken)):
            if not s.taken[c] or s.prices[c] == 0.0:
                continue
            most = best_loss * s.prices[c] * (1.0 + 1e-9) if best >= 0 else np.inf
            lost, loss = loss_within(s, c, best_lost, most)
            key = loss / s.prices[c]
            if best < 0 or lost < best_lost or (lost == best_lost and key < best_loss):
                best, best_lost, best_loss = c, lost, key
        if best < 0 or s.totals[0] - best_lost < wanted:
            return
        flip(s, best)


@compiled
def neighbours(s: State, centre: int, count: int) -> Array:
    """Choose the candidates that share most elements with a chosen one, itself first."""
    elements, starts, hits, crew, owner = s.element, s.starts, s.hits, s.crew, s.owner
    shared = np.zeros(len(s.taken), dtype=np.int32)
    met = np.empty(len(s.taken), dtype=np.int32)
    size = 0
    for at in range(s.indptr[centre], s.indptr[centre + 1]):
        e = elements[at]
        for n in range(starts[e], starts[e] + hits[e]):
            c = owner[crew[n]]
            if shared[c] == 0:
                met[size] = c
                size += 1
            shared[c] += 1
    found = np.empty(count, dtype=np.int64)
    found[0], shared[centre] = centre, 0
    for n in range(1, count):
        best = -1
        for c in met[:size]:
            more = best < 0 or shared[c] > shared[best] or (shared[c] == shared[best] and c < best)
            best = c if more else best
        if best < 0 or shared[best] == 0:
            return found[:n]
        found[n], shared[best] = best, 0
    return found


@compiled
def ruin(s: State, dice: Array, most: int, log: Array) -> int:
    """Take out 1 to ``most`` chosen neighbours by four dice in [0, 1); returns how many."""
    chosen = np.flatnonzero(s.taken)
    if not len(chosen):
        return 0
    centre = chosen[int(dice[0] * len(chosen))]
    size = 1 + int(dice[1] * most)
    near = neighbours(s, centre, 2 * size)
    skip = dice[2]
    count = 0
    for n in range(len(near)):
        # The centre goes; of the others every one with a chance of about one half.
        skip = (skip * 997.0 + 0.31) % 1.0
        if n == 0 or (skip < 0.5 and count < size):
            flip(s, near[n])
            log[count] = near[n]
            count += 1
    return count


@compiled
def improve(
    s: State, dice: Array, most: int, wanted: int, limit: float, lean: bool, best: Array
) -> float:
    """Ruin and fill again, once for each row of dice, within the price ``limit``.

    A step that makes the choice worth less is undone. A lean search copies every choice that
    satisfies enough elements to ``best``, drops the candidate of least loss, and goes on below
    its price; the others end there. Returns the new price limit.
    """
    log = np.empty(len(s.taken) + 2 * most + 1, dtype=np.int64)
    for row in range(len(dice)):
        before = s.totals[2]
        count = ruin(s, dice[row], most, log)
        banned = log[0] if count > 0 and dice[row, 3] < 0.5 else -1
        count = fill(s, wanted, limit, banned, log, count)
        if s.totals[0] >= wanted:
            if not lean:
                break
            limit = drop(s, wanted, best)
        elif s.totals[2] < before:
            for n in range(count - 1, -1, -1):
                flip(s, log[n])
    return limit


@compiled
def drop(s: State, wanted: int, best: Array) -> float:
    """Drop by least loss until too few are satisfied; the last good choice goes to ``best``.

    Returns just below its price.
    """
    price = s.totals[1]
    while s.totals[0] >= wanted and s.totals[1] > 0.0:
        price = s.totals[1]
        best[:] = s.taken
        flip(s, least_loss(s)[0])
    return float(price * (1.0 - 1e-9))
