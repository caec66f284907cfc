"""How long the rest takes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from time import monotonic

LOOKED_AT = 50
"""Chunks from whose times that of the rest is taken."""


class Pace:
    """The rate at which chunks come in, of late."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._times: deque[float] = deque(maxlen=LOOKED_AT)

    def note(self, is_first: bool) -> None:
        """A chunk has come in; one that is the first of its process was late, and what came before it tells nothing."""
        if is_first:
            self._times.clear()
        self._times.append(self._clock())

    def remaining(self, chunks: int) -> float | None:
        """Seconds that so many more will take; None while that is not known.

        It counts from the last that came in: where none come any more, it does not shrink.
        """
        between = len(self._times) - 1
        return chunks * (self._times[-1] - self._times[0]) / between if between > 0 else None
