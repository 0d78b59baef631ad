"""Search for the most that may be asked for at a bounded cost, with few trials."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Trial(Generic[T]):
    """What came of asking for a number of things.

    Parameters
    ----------
    asked
        The number.
    cost
        What the answer costs; infinite if there is none.
    answer
        The answer.

    """

    asked: int
    cost: float
    answer: T


def trials_within(
    whole: Trial[T], trial: Callable[[int], Trial[T]], limit: float, *, least: int, most_trials: int
) -> list[Trial[T]]:
    """Try smaller numbers than one whose answer costs too much.

    The next number is where the straight line between the dearest answer within the limit and the
    cheapest one beyond it meets the limit; an end that stays twice in a row counts half as much
    (the Illinois variant of false position), since costs need not follow a line. The search ends
    when no number is left in between, or when what is left of the limit is less than one more
    would cost on average. If nothing was within the limit by then, numbers are halved.

    Parameters
    ----------
    whole
        The largest number, whose cost exceeds ``limit``.
    trial
        Asks for a number.
    limit
        Largest cost.
    least
        Smallest number that may be asked for.
    most_trials
        Trials after which the search ends if one of them was within the limit.

    Returns
    -------
    trials
        In the order in which they were made. If none is within the limit, the last asked
        for ``least``.

    """
    made: list[Trial[T]] = []
    low, high = least - 1, whole.asked
    room, excess = limit, whole.cost - limit  # of the two ends, weighed
    last = 0.0
    while high - low > 1:
        late = len(made) >= most_trials
        if late and low >= least:
            break
        gap = high - low
        step = 0.5 * gap if late or math.isinf(excess) else gap * room / (room + excess)
        found = trial(low + min(max(int(step), 1), gap - 1))
        made.append(found)
        miss = found.cost - limit
        if miss > 0.0:
            high, excess = found.asked, miss
            room *= 0.5 if last > 0.0 else 1.0
        else:
            low, room = found.asked, -miss
            excess *= 0.5 if last < 0.0 else 1.0
            if room < found.cost / found.asked:
                break
        last = miss
    return made
