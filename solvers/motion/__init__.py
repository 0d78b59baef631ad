"""Find a short path from a start to a goal that touches nothing."""

from solvers.motion.problem import MotionProblem, Waypoints

__all__ = ["MotionProblem", "Waypoints"]
