"""What a plan could not fulfil, or did otherwise than asked."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that the reader of a plan must know.

    Parameters
    ----------
    stage
        Room that found it, such as ``"flight"``.
    code
        Stable short name, such as ``"viewpoint-dropped"``.
    message
        One sentence with the numbers.
    number
        The number that matters (a count, a distance), for programs.
    partial
        Whether something that was asked for, and could be had, is not done.

    """

    stage: str
    code: str
    message: str
    number: float = 0.0
    partial: bool = True
