"""Demand for sectors as rows of an integer programme."""

from typing import TYPE_CHECKING, Any

import numpy as np

from solvers.arrays import Ints
from solvers.cover.problem import CoverProblem

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def sector_rows(problem: CoverProblem) -> tuple["csr_array[Any]", "csr_array[Any]", Ints]:
    """Which sets hit which side of which element, where two sides or more are wanted.

    Returns
    -------
    hits_of_pair
        Ones where a set hits an element from a sector, shape (pairs, sets): one row for each
        pair of element and sector that occurs.
    pairs_of_element
        Ones at the pairs of an element, shape (wanting, pairs).
    wanted
        How many of its pairs each of these elements wants hit, at least 2, shape (wanting,).

    """
    from scipy.sparse import csr_array

    sectors = np.empty(0) if problem.sectors is None else problem.sectors
    owner = np.repeat(np.arange(problem.sets), np.diff(problem.indptr))
    wants = np.flatnonzero(problem.sector_demand[problem.indices] > 1)
    element = problem.indices[wants].astype(np.int64)
    code = element * problem.sector_count + sectors[wants]
    pairs, pair = np.unique(code, return_inverse=True)
    hits_of_pair = csr_array(
        (np.ones(len(wants)), (pair, owner[wants])), shape=(len(pairs), problem.sets)
    )
    wanting, row = np.unique(pairs // problem.sector_count, return_inverse=True)
    pairs_of_element = csr_array(
        (np.ones(len(pairs)), (row, np.arange(len(pairs)))), shape=(len(wanting), len(pairs))
    )
    return hits_of_pair, pairs_of_element, problem.sector_demand[wanting]
