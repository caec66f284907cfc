"""The run of a study: chunks out, chunks in."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

from trivet.design.engine.pace import Pace
from trivet.design.engine.quiet import quiet
from trivet.design.engine.task import Found, OtherVersionsError, Task, differing, versions, worked
from trivet.design.store import Failure, Fault, Store
from trivet.errors import InputError, NoResultError, TrivetError, one_line

if TYPE_CHECKING:
    from distributed import Client, Future

Progress = Callable[[int, int, float | None], None]
"""Called with chunks that are done, all of them, and the seconds that the rest takes, where that is known."""

TRIES = 3
"""Of a chunk that fails."""
AHEAD = 2
"""Chunks in flight for each thread of the workers."""
LOOK = 2.0
"""Seconds between looks at who is there."""
PATIENCE = 120.0
"""Seconds that are waited for workers where there are none."""
MOST_FAILURES = 1000
"""Chunks that fail in a run before it is given up."""


class Outcome(NamedTuple):
    """What a run has come to."""

    done: int
    """Chunks, of this run and earlier ones."""
    total: int
    failures: tuple[Failure, ...]
    """Chunks that are left out, with their reasons; the next run tries them again."""
    mended: tuple[Fault, ...]
    """Damage that was found and repaired at the beginning."""


def run(
    store: Store,
    task: Task,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    patience: float = PATIENCE,
    progress: Progress = lambda done, total, remaining: None,
) -> Outcome:
    """Work out all chunks of a store that are not done.

    Whatever stops it, the same call goes on from there, and the store is in the end the same.

    Args:
        store: open; damaged files are repaired first.
        task: what workers do.
        workers: processes to be started on this machine; none for a thread of this one.
        scheduler: address of a dask scheduler, whose workers are taken instead.
        patience: seconds after which a cluster without workers is given up.
        progress: told of every chunk.

    Raises:
        InputError: when no scheduler answers, workers are fewer than none or have other versions, or results cannot be written.
        NoResultError: when the scheduler or all workers are lost, or too many chunks fail.
    """
    if workers < 0:
        raise InputError(f"workers: {workers}; a number of processes was expected, 0 for none")
    if workers and scheduler is not None:
        raise InputError("workers: are those of the scheduler; give either of the two")
    mended = store.faults()
    store.repair(mended)
    if not store.done.all():
        from trivet.design.engine.cluster import connected

        with quiet(), connected(workers, scheduler) as client:
            _Run(store, task, client, scheduler or "the scheduler", patience, progress).go()
    return Outcome(int(store.done.sum()), store.layout.chunks, store.failures, mended)


class _Run:
    """A run that is under way."""

    def __init__(self, store: Store, task: Task, client: Client, address: str, patience: float, progress: Progress) -> None:
        self.store, self.task, self.client, self.address = store, task, client, address
        self.patience, self.progress = patience, progress
        self.versions, self.name = versions(), secrets.token_hex(8)
        self.pace, self.came = Pace(), SimpleQueue[Any]()
        self.flying: dict[Any, tuple[int, Future[Any]]] = {}
        """Chunks in flight, with their futures, by the keys of these."""
        self.rest, self.suspects, self.alone = self._chunks(), set[int](), set[int]()
        """Chunks that are to come, those whose worker died, and those of them that were then tried with no other beside."""
        self.failed = 0
        self.threads, self.looked, self.seen = 0, -float("inf"), monotonic()

    def go(self) -> None:
        """Until all chunks are done or have failed."""
        self._check_versions()
        self._tell()
        while True:
            self._look()
            with self._listening():
                while len(self.flying) < AHEAD * self.threads and (k := self._next()) is not None:
                    self._send(k)
            if not self.flying and self.threads:
                return
            try:
                self._take(self.came.get(timeout=LOOK))
            except Empty:
                continue

    def _chunks(self) -> Iterator[int]:
        """What is still to be worked out; what failed before last."""
        failed = {failure.chunk for failure in self.store.failures}
        yield from (k for k in self.store.undone() if k not in failed)
        yield from sorted(failed)

    def _next(self) -> int | None:
        """Which chunk to send.  When a worker dies, dask suspects all that it was sent: these are tried again one by one."""
        k = next(self.rest, None)
        if k is None and self.suspects and not self.flying:
            k = min(self.suspects)
            self.suspects.remove(k)
            self.alone.add(k)
        return k

    def _send(self, k: int) -> None:
        future = self.client.submit(
            worked, self.task, self.versions, k, key=f"trivet-{self.name}-{k}-{k in self.alone}", pure=False, retries=TRIES - 1
        )
        self.flying[future.key] = k, future
        future.add_done_callback(self.came.put)

    def _take(self, future: Future[Any]) -> None:
        """Write what has come in, or why it has not."""
        from distributed import KilledWorker

        k, _ = self.flying.pop(future.key)
        with self._listening():
            error = future.exception() if future.status == "error" else None
            found: Found | None = future.result() if error is None else None
            future.release()
        if found is not None:
            self.store.write(k, found.chunk)
            self.pace.note(found.is_first)
        elif isinstance(error, OtherVersionsError):
            raise InputError(f"{self.address}: {error}")
        elif isinstance(error, KilledWorker) and k not in self.alone:
            self.suspects.add(k)
        else:
            self._fail(k, error)
        self._tell()

    def _fail(self, k: int, error: BaseException | None) -> None:
        self.failed += 1
        failure = self.store.fail(k, *_reason(error))
        if self.failed >= MOST_FAILURES:
            raise NoResultError(f"{self.failed} chunks have failed, the last one {failure}; {self._so_far()}")

    def _tell(self) -> None:
        done, total = int(self.store.done.sum()), self.store.layout.chunks
        self.progress(done, total, self.pace.remaining(total - done - self.failed))

    def _look(self) -> None:
        """Who is there."""
        now = monotonic()
        if now < self.looked + LOOK:
            return
        with self._listening():
            self.threads = sum(self.client.nthreads().values())
        self.looked = monotonic()
        if self.threads:
            self.seen = self.looked
        elif now > self.seen + self.patience:
            raise NoResultError(f"{self.address}: has had no workers for {now - self.seen:.0f} s; {self._so_far()}")

    def _check_versions(self) -> None:
        """Of the workers that are there; others are found out when they first work."""
        own = tuple(self.versions)

        def theirs() -> dict[str, str]:
            # By value: a worker may have no trivet to import it from.
            import importlib.metadata
            import platform

            found = {"python": ".".join(platform.python_version_tuple()[:2])}
            for name in own[1:]:
                try:
                    found[name] = importlib.metadata.version(name)
                except importlib.metadata.PackageNotFoundError:
                    found[name] = ""
            return found

        with self._listening():
            answers = self.client.run(theirs, on_error="ignore")
        for worker, there in answers.items():
            difference = differing(there, self.versions)
            if difference:
                raise InputError(f"{self.address}: the worker at {worker} {difference}")

    @contextmanager
    def _listening(self) -> Iterator[None]:
        """Losing the scheduler, as one line."""
        import asyncio
        from concurrent.futures import CancelledError

        from distributed.client import ClosedClientError

        try:
            yield
        except (CancelledError, asyncio.CancelledError, ClosedClientError, TimeoutError, OSError) as error:
            if isinstance(error, TrivetError):
                raise
            raise NoResultError(f"{self.address}: was lost; {self._so_far()}") from None

    def _so_far(self) -> str:
        done, total = int(self.store.done.sum()), self.store.layout.chunks
        return f"{done} of {total} chunks are done, and the same command goes on from there"


def _reason(error: BaseException | None) -> tuple[str, int]:
    """Why a chunk failed, in one line, and how often it was tried."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return "its worker process died", error.allowed_failures + 1
    text = one_line(str(error).strip().split("\n", 1)[0], 300)
    return (text if isinstance(error, TrivetError) else f"{type(error).__name__}: {text}"), TRIES
