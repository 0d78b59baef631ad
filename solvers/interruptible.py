"""Let Ctrl-C be heard while foreign code runs that knows nothing of it."""

from collections.abc import Callable
from threading import Event, Thread
from typing import TypeVar

T = TypeVar("T")

_GLANCE = 0.1  # seconds between two looks at what the user pressed


def heedful(work: Callable[[], T], cancel: Callable[[], object]) -> T:
    """Result of a long call that releases the interpreter; Ctrl-C is heard within a moment.

    The work runs in a thread of its own, while this one waits.

    Parameters
    ----------
    work
        What to do; what it raises is raised here.
    cancel
        Makes the work end early; it is waited for.

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C was pressed meanwhile.

    """
    results: list[T] = []
    failures: list[BaseException] = []
    done = Event()  # an interrupt within `Thread.join` may leave the thread called stopped

    def run() -> None:
        try:
            results.append(work())
        except BaseException as failure:
            failures.append(failure)
        done.set()

    Thread(target=run, daemon=True).start()
    try:
        while not done.wait(_GLANCE):
            pass
    except KeyboardInterrupt:
        cancel()
        done.wait()
        raise
    if failures:
        raise failures[0]
    return results[0]
