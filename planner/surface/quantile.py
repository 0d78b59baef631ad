"""Quantiles of many small groups at once."""

import numpy as np

from planner.geometry.arrays import Floats, Ints


def grouped_quantile(group: Ints, values: Floats, share: float) -> tuple[Ints, Floats]:
    """Take a quantile of the values of each group, without a loop over the groups.

    Parameters
    ----------
    group
        Group of each value, shape (N,), not negative, in any order.
    values
        Shape (N,).
    share
        Which quantile, in [0, 1]; between two values the lower one is taken.

    Returns
    -------
    groups
        The groups that have a value, ascending, shape (G,).
    quantiles
        Of each, shape (G,).

    """
    order = np.lexsort((values, group))
    groups, first, count = np.unique(group[order], return_index=True, return_counts=True)
    rank = first + np.floor(share * (count - 1)).astype(np.int64)
    return groups, values[order][rank]
