"""Turn what a caller hands in into read-only arrays, or say what is wrong with it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidProblem, InvalidSolution

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, closed to writing."""
    array.setflags(write=False)
    return array


def floats(values: Any, shape: tuple[int, ...], name: str, *, least: float = -np.inf) -> Floats:
    """Own, read-only float64 copy of that shape; a scalar fills it."""
    try:
        array = np.array(np.broadcast_to(np.asarray(values, dtype=np.float64), shape))
    except (TypeError, ValueError) as error:
        raise InvalidProblem(f"{name} must be numbers of shape {shape}: {error}") from error
    if not np.isfinite(array).all():
        raise InvalidProblem(f"{name} must be finite; {_first(~np.isfinite(array))} is not.")
    if (array < least).any():
        raise InvalidProblem(f"{name} must be at least {least}; {_first(array < least)} is not.")
    read_only(array)
    return array


def singles(values: Any, shape: tuple[int, ...], name: str) -> Singles:
    """Own, read-only float32 copy of that shape; a scalar fills it."""
    try:
        with np.errstate(over="ignore"):  # what is too large is not finite then
            array = np.array(np.broadcast_to(np.asarray(values), shape), dtype=np.float32)
    except (TypeError, ValueError) as error:
        raise InvalidProblem(f"{name} must be numbers of shape {shape}: {error}") from error
    if not np.isfinite(array).all():
        raise InvalidProblem(f"{name} must be finite; {_first(~np.isfinite(array))} is not.")
    read_only(array)
    return array


def truths(values: Any, shape: tuple[int, ...], name: str) -> Bools:
    """Own, read-only boolean copy of that shape, true where not 0; a scalar fills it."""
    given = np.asarray(values)
    if given.dtype != np.bool_ or given.shape not in {(), shape}:
        given = floats(values, shape, name) != 0.0
    array = np.array(np.broadcast_to(given, shape))
    read_only(array)
    return array


def counts(values: Any, shape: tuple[int, ...], name: str) -> Ints:
    """Own, read-only int64 copy of that shape with whole numbers from 0; a scalar fills it."""
    array = floats(values, shape, name, least=0.0)
    whole = array.astype(np.int64)
    if (whole != array).any():
        raise InvalidProblem(f"{name} must be whole numbers; {_first(whole != array)} is not.")
    read_only(whole)
    return whole


def chosen_indices(candidate: Any, size: int) -> Ints:
    """Own, read-only, sorted copy of a selection of distinct indices below ``size``.

    Raises
    ------
    InvalidSolution
        If it is not a list of distinct whole numbers in range.

    """
    given = np.asarray(candidate)
    if given.ndim != 1 or (given.size and given.dtype.kind not in "iu"):
        raise InvalidSolution(
            f"expected a list of indices, got shape {given.shape} of {given.dtype}."
        )
    indices = np.sort(given.astype(np.int64))
    if indices.size and (indices[0] < 0 or indices[-1] >= size):
        raise InvalidSolution(f"indices must lie in [0, {size}).")
    if (indices[1:] == indices[:-1]).any():
        raise InvalidSolution("an index is chosen twice.")
    read_only(indices)
    return indices


def _first(wrong: NDArray[np.bool_]) -> str:
    return f"entry {', '.join(str(i) for i in np.argwhere(wrong)[0])}" if wrong.ndim else "it"
