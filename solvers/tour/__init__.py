"""Visit every place once, at the least total cost."""

from solvers.tour.problem import Order, TourProblem

__all__ = ["Order", "TourProblem"]
