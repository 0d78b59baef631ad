"""The time that stages take, and what they say."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Listener = Callable[[str, str], None]
"""Hears a stage's name and a sentence."""


class Clock:
    """Times stages and passes on what they say."""

    def __init__(self, listener: Listener | None) -> None:
        self._listener = listener
        self._stage = "plan"
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time one stage."""
        self._stage = name
        self.tell("")
        start = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def tell(self, sentence: str) -> None:
        """Pass a sentence of the running stage to the listener."""
        if self._listener is not None:
            self._listener(self._stage, sentence)
