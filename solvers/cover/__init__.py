"""Choose the cheapest sets that cover every element as often as it demands."""

from solvers.cover.problem import Chosen, CoverProblem

__all__ = ["Chosen", "CoverProblem"]
