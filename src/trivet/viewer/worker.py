"""Work in a thread: for the newest request, since who drags does not wait for where he has been; or for one after the other."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Worker(Generic[T]):
    """A thread that does some work for the newest of the requests, older ones being dropped; or for several in their order."""

    def __init__(
        self, work: Callable[[T], None], failed: Callable[[Exception], None], settled: float = 0.0, waiting: int = 1
    ) -> None:
        """Start it.

        Args:
            work: what is done.
            failed: called with what it raises; the thread goes on.
            settled: for how long (s) no request may have come before the work begins.
            waiting: how many requests may wait; where it is one, a newer one takes its place.
        """
        self._work, self._failed, self._settled, self._waiting = work, failed, settled, waiting
        self._requests: list[T] = []
        self._changed, self._ended, self._busy = threading.Condition(), False, False
        self._last = 0.0
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def ask(self, request: T) -> bool:
        """Have the work done for this; gives whether it will be, unless a newer request takes its place."""
        with self._changed:
            if self._waiting > 1 and len(self._requests) >= self._waiting:
                return False
            kept = self._requests if self._waiting > 1 else []
            self._requests, self._last = [*kept, request], time.monotonic()
            self._changed.notify_all()
            return True

    @property
    def is_idle(self) -> bool:
        """Whether all that was asked for is done."""
        with self._changed:
            return not self._requests and not self._busy

    @property
    def is_overtaken(self) -> bool:
        """Whether something newer is asked for than what is being done."""
        with self._changed:
            return bool(self._requests) or self._ended

    def end(self) -> None:
        """Stop after what is being done."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def join(self, patience: float) -> bool:
        """Wait until it has stopped, but no longer than so many seconds; gives whether it has."""
        self._thread.join(timeout=max(patience, 0.0))
        return not self._thread.is_alive()

    def _next(self) -> list[T]:
        with self._changed:
            while not self._ended:
                rest = self._last + self._settled - time.monotonic()
                if self._requests and rest <= 0:
                    first, self._requests, self._busy = self._requests[:1], self._requests[1:], True
                    return first
                self._changed.wait(rest if self._requests else None)
            return []

    def _run(self) -> None:
        while request := self._next():
            try:
                self._work(request[0])
            except Exception as error:
                self._failed(error)
            with self._changed:
                self._busy = False
