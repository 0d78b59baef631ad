"""Optimisation problems in four families, and interchangeable solvers for them.

``solve(problem, solver)`` is the one way in. The families are :mod:`solvers.cover`,
:mod:`solvers.pairs`, :mod:`solvers.tour` and :mod:`solvers.motion`. Names load on first
use, so that importing this package costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solvers.errors import (
        InvalidProblem,
        InvalidSolution,
        SolverError,
        SolverFailed,
        SolverUnavailable,
    )
    from solvers.front import solve
    from solvers.result import Result, Status, StopReason, TracePoint
    from solvers.run import Run
    from solvers.stop import Stop

_HOME = {
    "solve": "solvers.front",
    "Stop": "solvers.stop",
    "Run": "solvers.run",
    "Result": "solvers.result",
    "Status": "solvers.result",
    "StopReason": "solvers.result",
    "TracePoint": "solvers.result",
    "SolverError": "solvers.errors",
    "InvalidProblem": "solvers.errors",
    "InvalidSolution": "solvers.errors",
    "SolverFailed": "solvers.errors",
    "SolverUnavailable": "solvers.errors",
}

__all__ = [
    "InvalidProblem",
    "InvalidSolution",
    "Result",
    "Run",
    "SolverError",
    "SolverFailed",
    "SolverUnavailable",
    "Status",
    "Stop",
    "StopReason",
    "TracePoint",
    "solve",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'solvers' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
