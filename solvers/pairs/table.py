"""Tabulate the weight of a pair by the chord between its two rays."""

from collections.abc import Callable

import numpy as np

from solvers.arrays import Floats, read_only


def chord_table(weight: Callable[[Floats], Floats], size: int = 2048) -> Floats:
    """Weights at chords evenly spaced from 0 to 2, for :class:`~solvers.pairs.PairCoverProblem`.

    The chord between the tips of two unit rays at an angle is 2 sin(angle / 2). Unlike the
    cosine it is as fine at small angles as the angle itself, and a square root cheaper.

    Parameters
    ----------
    weight
        Weight, at least 0, of angles in [0, pi], radians; arrays in and out.
    size
        Number of entries, at least 2.

    Returns
    -------
    weights
        Shape (size,), read-only.

    """
    chord = np.linspace(0.0, 2.0, size)
    table = np.array(weight(2.0 * np.arcsin(0.5 * chord)), dtype=np.float64)
    read_only(table)
    return table
