"""Lend a part of a run's limits to one of several solvers."""

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
