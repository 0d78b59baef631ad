"""Checks of what the fields of a solver are set to."""

import math
from typing import Any


def whole(value: Any, name: str, *, least: int = 1) -> None:
    """Refuse what is no whole number from ``least`` up.

    Raises
    ------
    ValueError
        Naming the field and the value.

    """
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ValueError(f"{name} must be a whole number from {least} up, got {value!r}.")


def number(value: Any, name: str, *, least: float = 0.0, most: float = math.inf) -> None:
    """Refuse what is no number within [``least``, ``most``].

    Raises
    ------
    ValueError
        Naming the field and the value.

    """
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not least <= value <= most
        or math.isinf(value)
    ):
        raise ValueError(f"{name} must be a number in [{least:g}, {most:g}], got {value!r}.")
