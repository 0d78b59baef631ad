"""Compiled loops of the Lagrangian relaxation; import only where a solver runs."""

# ruff: noqa: PLR0917 - plain arrays, since compiled code takes no objects

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import compiled
from solvers.cover.rows import Rows

Array = NDArray[Any]


@compiled
def relax(rows: Rows, multipliers: Array, want: Array, hits: Array, reduced: Array) -> float:
    """Value of the Lagrangian function, and what is behind it.

    Fills ``reduced`` with the reduced cost of each set, ``hits`` with how often the sets
    that the relaxation chooses (those of negative reduced cost, one a part) hit each row,
    and ``want`` with the hits that count: the demand of a plain row, and 1 for those rows
    of a group that have the smallest multipliers, as many as the group wants. The
    difference of the last two is a supergradient.
    """
    want[:] = rows.wanted
    hits[:] = 0
    for g in range(len(rows.group_wanted)):
        for _ in range(rows.group_wanted[g]):
            least = -1
            for r in range(rows.group_starts[g], rows.group_starts[g + 1]):
                if want[r] == 0 and (least < 0 or multipliers[r] < multipliers[least]):
                    least = r
            want[least] = 1
    total = 0.0
    for r in range(len(want)):
        total += multipliers[r] * want[r]
    parts = rows.part.max() + 1 if len(rows.part) else 0
    cheapest = np.full(parts, -1, dtype=np.int64)
    for j in range(len(rows.prices)):
        cost = rows.prices[j]
        for at in range(rows.starts[j], rows.starts[j + 1]):
            cost -= multipliers[rows.rows[at]]
        reduced[j] = cost
        if cost < 0.0:
            p = rows.part[j]
            if p >= 0:
                if cheapest[p] < 0 or cost < reduced[cheapest[p]]:
                    cheapest[p] = j
            else:
                total += cost
                for at in range(rows.starts[j], rows.starts[j + 1]):
                    hits[rows.rows[at]] += 1
    for j in cheapest:
        if j >= 0:
            total += reduced[j]
            for at in range(rows.starts[j], rows.starts[j + 1]):
                hits[rows.rows[at]] += 1
    return total


@compiled
def climb(
    rows: Rows, centre: Array, direction: Array, value: float, step: Array, steps: int
) -> float:
    """Go up the Lagrangian function by the volume algorithm; return the value at ``centre``.

    ``centre`` holds the best multipliers, ``direction`` the average of the supergradients,
    and ``step`` the factor of the step, the weight of the newest supergradient, the
    failures in a row and whether all is done (1). All are brought up to date.
    """
    count, failures = len(rows.wanted), int(step[2])
    want, hits = np.empty(count, np.int32), np.empty(count, np.int32)
    reduced = np.empty(len(rows.prices))
    trial = np.empty(count)
    for _ in range(steps):
        square = 0.0
        for r in range(count):
            if centre[r] > 0.0 or direction[r] > 0.0:
                square += direction[r] ** 2
        if square < 1e-12 or step[0] < 1e-4:
            step[3] = 1.0
            break
        length = step[0] * 0.05 * max(value, 1e-9) / square  # aims at 1.05 of the best value
        for r in range(count):
            trial[r] = max(0.0, centre[r] + length * direction[r])
        reached = relax(rows, trial, want, hits, reduced)
        agreement = 0.0
        for r in range(count):
            fresh = want[r] - hits[r]
            agreement += direction[r] * fresh
            direction[r] += step[1] * (fresh - direction[r])
        if reached > value:
            value = reached
            centre[:] = trial
            failures = 0
            if agreement >= 0.0:
                step[0] = min(2.0, 1.1 * step[0])
        else:
            failures += 1
            if failures == 20:
                step[0] *= 0.66
                failures = 0
    step[2] = failures
    return value


@compiled
def core(rows: Rows, order: Array, reduced: Array, spare: int) -> Array:
    """Sets worth looking at: of negative reduced cost, or among the best of a row.

    Goes through the sets in this order, by reduced cost; a row wants its demand, and
    ``spare`` sets more to choose from.
    """
    room = np.maximum(rows.wanted, 1) + spare
    kept = np.zeros(len(rows.prices), np.bool_)
    for j in order:
        short = False
        for at in range(rows.starts[j], rows.starts[j + 1]):
            r = rows.rows[at]
            if room[r] > 0:
                short = True
                room[r] -= 1
        kept[j] = short or reduced[j] < 0.0
    return kept
