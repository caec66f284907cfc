"""Work that is done for the newest request only: who drags does not wait for where he has been."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Worker(Generic[T]):
    """A thread that does some work for the newest of the requests; older ones are dropped."""

    def __init__(self, work: Callable[[T], None], settled: float = 0.0) -> None:
        """Start it.

        Args:
            work: what is done; what it raises is written to the error stream and kept as `failure`, and the thread goes on.
            settled: for how long (s) no request may have come before the work begins.
        """
        self._work, self._settled = work, settled
        self._request: list[T] = []
        self._changed, self._ended, self._busy = threading.Condition(), False, False
        self._last = 0.0
        self.failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def ask(self, request: T) -> None:
        """Have the work done for this."""
        with self._changed:
            self._request, self._last = [request], time.monotonic()
            self._changed.notify_all()

    @property
    def is_idle(self) -> bool:
        """Whether all that was asked for is done."""
        with self._changed:
            return not self._request and not self._busy

    @property
    def is_overtaken(self) -> bool:
        """Whether something newer is asked for than what is being done."""
        with self._changed:
            return bool(self._request) or self._ended

    def end(self) -> None:
        """Stop after what is being done."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        self._thread.join(timeout=5)

    def _next(self) -> list[T]:
        with self._changed:
            while not self._ended:
                rest = self._last + self._settled - time.monotonic()
                if self._request and rest <= 0:
                    request, self._request, self._busy = self._request, [], True
                    return request
                self._changed.wait(rest if self._request else None)
            return []

    def _run(self) -> None:
        while request := self._next():
            try:
                self._work(request[0])
            except Exception as error:
                self.failure = error
                traceback.print_exc()
            with self._changed:
                self._busy = False
