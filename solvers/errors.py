"""What the user must fix; every outcome that is not an error is in the result."""


class SolverError(Exception):
    """Root of everything that this package raises on purpose."""


class InvalidProblem(SolverError, ValueError):
    """The problem, the name of the solver or a setting makes no sense."""


class InvalidSolution(SolverError, ValueError):
    """A candidate breaks a constraint of its problem."""


class SolverUnavailable(SolverError, ImportError):
    """A package that the solver needs is not installed."""


class SolverFailed(SolverError, RuntimeError):
    """A solver crashed, or claimed what cannot be true."""
