"""What can go wrong that the user can mend."""


class PlannerError(Exception):
    """Input, settings or an output place that must be changed before a plan can be made.

    The message is one line: what it concerns (a file by name), what is wrong, and how to mend it.
    """

    exit_code = 2


class Unattainable(PlannerError):
    """There is too little room or time for what is asked; for less there may be enough."""


class MissingDependency(PlannerError):
    """An optional package or system library is needed and not there; the message names it."""

    exit_code = 3
