"""Compile an inner loop to machine code, once for all processes; loads numba."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile with numba and keep the result on disk, as far as that can be written."""
    try:
        return cast("F", njit(cache=True)(function))
    except RuntimeError:  # numba found no place to keep it
        return cast("F", njit(function))
