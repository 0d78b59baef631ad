"""When to stop a solver, as a value."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Stop:
    """Limits of a run; whichever is met first ends it.

    With no limit at all the solver's own ``default_stop`` applies.

    Parameters
    ----------
    seconds
        Wall-clock limit, positive. The one limit that does not repeat exactly.
    iterations
        Most iterations, at least 1; what an iteration is, each solver says.
    stall
        Most iterations without a better solution, at least 1.
    target
        Cost at which a solution is good enough.

    Raises
    ------
    ValueError
        If a limit is out of range.

    """

    seconds: float | None = None
    iterations: int | None = None
    stall: int | None = None
    target: float | None = None

    def __post_init__(self) -> None:
        if self.seconds is not None and not self.seconds > 0.0:
            raise ValueError(f"seconds must be positive, got {self.seconds}.")
        for name in ("iterations", "stall"):
            count = getattr(self, name)
            if count is None:
                continue
            if not 1 <= count < math.inf or int(count) != count:
                raise ValueError(f"{name} must be a whole number from 1 up, got {count}.")
            object.__setattr__(self, name, int(count))
        if self.target is not None and math.isnan(self.target):
            raise ValueError("target must be a number, got nan.")

    @property
    def limits(self) -> frozenset[str]:
        """Names of the limits that are set."""
        return frozenset(
            name
            for name in ("seconds", "iterations", "stall", "target")
            if getattr(self, name) is not None
        )
