"""Choose candidates such that pairs of them see enough of each element."""

from solvers.pairs.problem import Chosen, PairCoverProblem
from solvers.pairs.table import chord_table

__all__ = ["Chosen", "PairCoverProblem", "chord_table"]
