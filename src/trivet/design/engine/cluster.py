"""Where work is done: in this process, by processes beside it, or by a cluster that runs already."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import resource_tracker
from typing import Any

import dask
from distributed import Client, Nanny, Scheduler, Security, SpecCluster, Worker, rpc

from trivet.design.engine.quiet import SILENT
from trivet.errors import InputError, NoResultError
from trivet.files import borrowed_folder

ANSWER = 10.0
"""Seconds in which a scheduler has to answer."""
LOOPBACK = "127.0.0.1"
WARNINGS = "PYTHONWARNINGS"
LEAVING = 5.0
"""Seconds that are taken for leaving, after an interruption."""


class OwnScheduler(Scheduler):
    """A scheduler without pages for browsers."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """None, for which it would listen to whole networks."""


class OwnWorker(Worker):
    """A worker without pages for browsers."""

    waits = True
    """Whether work that has begun is waited for when it is closed."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """None, for which it would listen to whole networks."""

    async def close(self, timeout: float = 30, executor_wait: bool = True, **other: Any) -> str | None:  # type: ignore[override]
        return await super().close(timeout, executor_wait and self.waits, **other)


def connected(workers: int, scheduler: str | None) -> AbstractContextManager[Client]:
    """A client of a cluster that ends with the block, or of one that was there before.

    Args:
        workers: processes to be started on this machine; none for a thread of this one.
        scheduler: address of a scheduler that runs; none for a cluster of our own.

    Raises:
        InputError: when no scheduler answers at the address.
    """
    return _own(workers) if scheduler is None else _found(scheduler)


@contextmanager
def _found(address: str) -> Iterator[Client]:
    try:
        # First without a client, which would wait for ever where something else listens and does not answer.
        with ThreadPoolExecutor(1) as thread:  # of its own: in a notebook this one has a loop that runs
            kind = thread.submit(asyncio.run, _kind(address)).result()
        client = Client(address, timeout=ANSWER, set_as_default=False) if kind == "Scheduler" else None
    except Exception as error:  # of any kind: something else may answer there
        said = str(error) or f"not within {ANSWER:.0f} s"
        raise InputError(f"{address}: no scheduler answers there ({said}); start one (dask scheduler)") from None
    if client is None:
        raise InputError(f"{address}: is the address of a {kind} of dask; that of a scheduler was expected")
    try:
        yield client
    finally:
        _leave(client, None, waits=False)


async def _kind(address: str) -> str:
    """What answers at an address."""
    arguments = Security().get_connection_args("client")
    async with asyncio.timeout(ANSWER), rpc(address, connection_args=arguments, timeout=ANSWER) as other:
        return str((await other.identity())["type"])


@contextmanager
def _own(workers: int) -> Iterator[Client]:
    own = {
        "distributed.worker.profile.enabled": False,
        "distributed.nanny.pre-spawn-environ": dask.config.get("distributed.nanny.pre-spawn-environ") | SILENT,
    }
    with borrowed_folder() as folder, dask.config.set(own | {"temporary-directory": str(folder)}):
        cluster: SpecCluster | None = None
        client: Client | None = None
        is_interrupted = True
        try:
            with _undisturbed():
                cluster = _started(workers)
            client = Client(cluster, set_as_default=False)
            yield client
            is_interrupted = False
        except Exception:
            is_interrupted = False
            raise
        finally:
            _leave(client, cluster, waits=not is_interrupted)


def _started(workers: int) -> SpecCluster:
    try:
        return _processes(workers) if workers else _embedded()
    except (RuntimeError, OSError) as error:
        cause = str(error.__cause__ or error)
        raise NoResultError(f"workers: {workers}; they could not be started ({cause}); nothing is lost, try again") from None


def _embedded() -> SpecCluster:
    """One thread of this process; nothing listens to any network."""
    options = {"nthreads": 1, "memory_limit": 0, "protocol": "inproc://"}
    workers = {0: {"cls": OwnWorker, "options": options}}
    return _cluster(workers, {"protocol": "inproc://"})


def _processes(count: int) -> SpecCluster:
    """Processes that talk over loopback alone; one that dies is started anew."""
    options = {"nthreads": 1, "memory_limit": 0, "host": LOOPBACK, "worker_class": OwnWorker}
    workers = {k: {"cls": Nanny, "options": options} for k in range(count)}
    _quiet_helper()
    return _cluster(workers, {"host": LOOPBACK, "port": 0, "protocol": "tcp://"})


def _cluster(workers: dict[int, Any], scheduler: dict[str, Any]) -> SpecCluster:
    return SpecCluster(workers, {"cls": OwnScheduler, "options": scheduler | {"dashboard": False}})


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Threads that begin in the block, and processes that these start, are not reached by an interruption from the keyboard.

    It is for this process to say what it means.  It is told when the block ends.
    """
    came: list[int] = []
    is_main = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGINT, lambda number, _: came.append(number)) if is_main else None
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if is_main:
            signal.signal(signal.SIGINT, before)
        if came:
            signal.raise_signal(came[0])


def _quiet_helper() -> None:
    """Start the process that clears away what worker processes share; should this one die, that is done without words."""
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    before = os.environ.get(WARNINGS)
    os.environ[WARNINGS] = "ignore:resource_tracker"
    try:
        resource_tracker.ensure_running()
    finally:
        os.environ.pop(WARNINGS)
        if before is not None:
            os.environ[WARNINGS] = before
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)  # which it does not always leave as it was


def _leave(client: Client | None, cluster: SpecCluster | None, waits: bool) -> None:
    """Close what there is; work that has begun is waited for where it is in this process, unless that is interrupted."""
    with contextlib.suppress(OSError, TimeoutError):
        if client is not None:
            client.close(timeout=LEAVING)
        if cluster is not None:
            for worker in cluster.workers.values():
                worker.waits = waits
            cluster.close()
