"""The clock, dice, incumbent and diary that every solver works with."""

import math
import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np

from solvers.errors import InvalidSolution
from solvers.result import StopReason, TracePoint
from solvers.stop import Stop

S = TypeVar("S")


class Run(Generic[S]):
    """One run of one solver on one problem.

    A solver asks :meth:`proceed` whether to go on, and hands every candidate to
    :meth:`offer`, which checks it, costs it and keeps it if it is the best so far.

    Attributes
    ----------
    rng
        The only source of chance.
    seed
        What ``rng`` was made from, for back ends with dice of their own.
    initial
        Warm start, already offered, or ``None``.
    bound
        Proven lower bound; raise it as soon as one is known.
    best, best_cost
        The incumbent, or ``None`` and infinity.
    iteration
        Iterations counted so far; a back end that counts for itself sets it.

    """

    def __init__(
        self,
        evaluate: Callable[[Any], tuple[S, float]],
        *,
        stop: Stop,
        seed: int,
        listener: Callable[[TracePoint], None] | None = None,
    ) -> None:
        self._evaluate = evaluate
        self._listener = listener
        self._start = time.perf_counter()
        self._last_gain = 0
        self.stop = stop
        self.seed = seed
        self.rng = np.random.default_rng(seed)
        self.iteration = 0
        self.refused = 0
        self.initial: S | None = None
        self.best: S | None = None
        self.best_cost = math.inf
        self.bound = -math.inf
        self.stop_reason = StopReason.FINISHED
        self.trace: list[TracePoint] = []

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._start

    @property
    def remaining(self) -> float:
        """Seconds left, to hand to a solver with a time limit of its own."""
        limit = self.stop.seconds
        return math.inf if limit is None else max(0.0, limit - self.elapsed)

    @property
    def patience(self) -> float:
        """Iterations left before a limit on them, or on a stall, is reached."""
        stop = self.stop
        left = math.inf if stop.iterations is None else stop.iterations - self.iteration
        if stop.stall is not None:
            left = min(left, stop.stall - (self.iteration - self._last_gain))
        return max(0.0, left)

    def limit(self) -> StopReason | None:
        """Limit that has been reached, without counting an iteration."""
        stop = self.stop
        if stop.target is not None and self.best_cost <= stop.target:
            return StopReason.TARGET
        if stop.iterations is not None and self.iteration >= stop.iterations:
            return StopReason.ITERATIONS
        if stop.stall is not None and self.iteration - self._last_gain >= stop.stall:
            return StopReason.STALL
        if self.remaining <= 0.0:
            return StopReason.TIME
        return None

    def proceed(self) -> bool:
        """Count one iteration; ``False`` once any limit is reached."""
        reason = self.limit()
        if reason is not None:
            self.stop_reason = reason
            return False
        self.iteration += 1
        return True

    def offer(self, candidate: Any) -> bool:
        """Check and cost a candidate; return whether it is the new incumbent."""
        try:
            solution, cost = self._evaluate(
                candidate
            )  # a copy: the solver may go on changing its own
        except InvalidSolution:
            self.refused += 1
            return False
        if cost >= self.best_cost:
            return False
        self.best, self.best_cost = solution, cost
        self._last_gain = self.iteration
        point = TracePoint(self.elapsed, self.iteration, cost)
        self.trace.append(point)
        if self._listener is not None:
            self._listener(point)
        return True
