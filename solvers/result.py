"""What a run found, what is proven about it, and why it ended."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

S = TypeVar("S")


class Status(StrEnum):
    """What is known about the problem after a run."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    UNKNOWN = "unknown"


class StopReason(StrEnum):
    """Why a run ended."""

    FINISHED = "finished"
    TIME = "time"
    ITERATIONS = "iterations"
    STALL = "stall"
    TARGET = "target"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class TracePoint:
    """One improvement: ``cost`` reached after ``seconds`` and ``iteration`` iterations."""

    seconds: float
    iteration: int
    cost: float


@dataclass(frozen=True, slots=True, eq=False)
class Result(Generic[S]):
    """Outcome of one run of one solver on one problem.

    Parameters
    ----------
    solution
        Best solution found, or ``None``.
    cost
        Its cost, worked out by the problem; infinite without a solution.
    bound
        Proven lower bound on the cost of any solution; minus infinity if none.
    status, stop_reason
        What is known, and why the run ended.
    trace
        Every improvement, in order of time.
    solver, seed
        Who ran, and with which seed.
    iterations, seconds
        How long it took, in the solver's own iterations and in wall-clock seconds.
    refused
        How many candidates broke a constraint and were turned away.

    """

    solution: S | None
    cost: float
    bound: float
    status: Status
    stop_reason: StopReason
    trace: tuple[TracePoint, ...]
    solver: str
    seed: int
    iterations: int
    seconds: float
    refused: int

    @property
    def gap(self) -> float:
        """Share of the cost that is not proven necessary, from 0; infinite if unknown."""
        if not (math.isfinite(self.cost) and math.isfinite(self.bound)):
            return math.inf
        excess = max(0.0, self.cost - self.bound)
        return 0.0 if excess == 0.0 else excess / abs(self.cost) if self.cost else math.inf
