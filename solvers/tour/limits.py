"""How far a run is from its limits, and lending a part of them to one of several solvers."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from solvers.result import StopReason
from solvers.run import Run


@contextmanager
def part(run: Run[Any], share: float, *, most: int | None = None) -> Iterator[None]:
    """For a while, leave only a share of what the limits leave, of time and of iterations.

    Parameters
    ----------
    run
        Whose limits.
    share
        Share of what is left, in (0, 1].
    most
        Most iterations all the same, at least 1.

    """
    whole = run.stop
    seconds, iterations = whole.seconds, whole.iterations
    if seconds is not None:
        seconds = run.elapsed + max(1e-6, share * (seconds - run.elapsed))
    if iterations is not None:
        iterations = run.iteration + max(1, int(share * (iterations - run.iteration)))
    if most is not None:
        iterations = min(iterations or run.iteration + most, run.iteration + most)
    run.stop = replace(whole, seconds=seconds, iterations=iterations)
    try:
        yield
    finally:
        run.stop = whole
    run.stop_reason = StopReason.FINISHED  # the end of a part is not that of the run


def progress(run: Run[Any], cycle: int) -> float:
    """Share of the run that is over, from 0 to 1.

    Without a limit on iterations or seconds, it goes from 0 to 1 again and again, every
    ``cycle`` iterations.
    """
    stop = run.stop
    if stop.iterations is None and stop.seconds is None:
        return run.iteration % cycle / cycle
    over = 0.0 if stop.iterations is None else run.iteration / stop.iterations
    if stop.seconds is not None and math.isfinite(stop.seconds):
        over = max(over, run.elapsed / stop.seconds)
    return min(1.0, over)
