"""A cover problem as linear constraints, for integer programmes and their relaxation."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from solvers.arrays import Floats
from solvers.cover.problem import CoverProblem
from solvers.cover.rows import Rivals, Rows, rivals_of, rows_of

if TYPE_CHECKING:
    from scipy.sparse import csc_array


@dataclass(frozen=True, slots=True, eq=False)
class LinearModel:
    r"""Constraints ``matrix @ z >= lower`` on ``z`` in [0, 1], of which ``z[:sets]`` is whole.

    Behind the sets comes one variable for each row of a group of sectors (see
    :class:`solvers.cover.rows.Rows`), :math:`y_r \le \sum_{j \ni r} x_j`, with the sum of
    a group at least what it wants. It may stay continuous, as its largest value is whole
    once x is. Constraints are in the order of the rows, the groups and the conflicts.
    """

    rows: Rows
    rivals: Rivals
    matrix: "csc_array[Any]"
    lower: Floats
    cost: Floats

    @property
    def sets(self) -> int:
        """Number of whole variables, which come first."""
        return len(self.rows.prices)


def linear_model(problem: CoverProblem) -> LinearModel:
    """Linear constraints of a problem, conflicts and sectors included."""
    from scipy.sparse import csc_array, hstack, vstack

    rows, rivals = rows_of(problem), rivals_of(problem)
    count, groups, cliques = len(rows.wanted), len(rows.group_wanted), len(problem.conflicts)
    pairs, sets = count - int(rows.group_starts[0]), problem.sets
    shape = (count, sets)
    hits = csc_array((np.ones(len(rows.rows)), rows.rows, rows.starts), shape=shape)
    pair, ones = np.arange(pairs), np.ones(pairs)
    seen = csc_array((-ones, (count - pairs + pair, pair)), shape=(count, pairs))
    group = np.repeat(np.arange(groups), np.diff(rows.group_starts))
    sums = csc_array((ones, (group, pair)), shape=(groups, pairs))
    clique = np.repeat(np.arange(cliques), np.diff(rivals.group_starts))
    clash = csc_array((-np.ones(len(clique)), (clique, rivals.members)), shape=(cliques, sets))
    matrix = hstack(
        [
            vstack([hits, csc_array((groups, sets)), clash]),
            vstack([seen, sums, csc_array((cliques, pairs))]),
        ]
    ).tocsc()
    lower = np.concatenate((rows.wanted, rows.group_wanted, -np.ones(cliques)))
    cost = np.concatenate((problem.prices, np.zeros(pairs)))
    return LinearModel(rows, rivals, matrix, lower, cost)
