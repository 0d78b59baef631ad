"""Choose candidates such that pairs of them see enough of each element."""

from solvers.pairs.problem import Chosen, PairCoverProblem

__all__ = ["Chosen", "PairCoverProblem"]
