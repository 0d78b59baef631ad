"""Refuse parameters of the wrong kind or out of range, by name."""

import math
from typing import Any

import numpy as np


def check_whole(solver: Any, **least: int) -> None:
    """Each field named is a whole number from the least one up.

    Raises
    ------
    ValueError
        If one is not.

    """
    for name, low in least.items():
        value = getattr(solver, name)
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole or value < low:
            raise ValueError(f"{name} must be a whole number from {low} up, got {value!r}.")


def check_number(
    solver: Any,
    *names: str,
    above: float | None = None,
    most: float = math.inf,
    below: float = math.inf,
) -> None:
    """Each field named is a finite number from 0, or above a limit, to the most and below another.

    Raises
    ------
    ValueError
        If one is not.

    """
    limits = "at least 0" if above is None else f"above {above:g}"
    limits += "" if math.isinf(most) else f" and at most {most:g}"
    limits += "" if math.isinf(below) else f" and below {below:g}"
    for name in names:
        value = getattr(solver, name)
        number = isinstance(value, int | float | np.integer | np.floating)
        if not number or isinstance(value, bool):
            raise ValueError(f"{name} must be a number, got {value!r}.")
        fits = value >= 0.0 if above is None else value > above
        if not (fits and value <= most and value < below):
            raise ValueError(f"{name} must be finite, {limits}, got {value!r}.")
