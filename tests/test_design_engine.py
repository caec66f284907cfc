"""The engine: the same store whoever works and whatever dies, and one line for each thing that goes wrong."""

from __future__ import annotations

import asyncio
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import cheap_designs
import psutil
import pytest
from cheap_designs import Cheap

from trivet.design.engine import Outcome, run, running
from trivet.design.engine.pace import Pace
from trivet.design.engine.task import differing, versions
from trivet.design.store import open_store, read
from trivet.errors import InputError, NoResultError

TESTS = Path(__file__).parent
OWN = cheap_designs.layout()


def files(root: Path) -> dict[str, bytes]:
    return {str(path.relative_to(root)): path.read_bytes() for path in sorted(root.rglob("*")) if path.is_file()}


def worked(path: Path, task: Cheap | None = None, **options: object) -> Outcome:
    with open_store(path, OWN) as store:
        return run(store, task or Cheap(OWN), **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Files of the store of a run that nothing disturbed, which is written without the engine."""
    path = tmp_path_factory.mktemp("whole") / "s"
    work = Cheap(OWN).prepared()
    with open_store(path, OWN) as store:
        for k in store.undone():
            store.write(k, work(k))
    return files(path)


def started(path: Path, chunks: int, wait: float, workers: int, scheduler: str = "") -> subprocess.Popen[str]:
    """A run of its own process."""
    arguments = [str(path), str(chunks), str(wait), str(workers), *([scheduler] if scheduler else [])]
    return subprocess.Popen(
        [sys.executable, str(TESTS / "cheap_designs.py"), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "PYTHONPATH": str(TESTS)}, start_new_session=True,
    )  # fmt: skip


def has_done(chunks: int, process: subprocess.Popen[str]) -> None:
    """Wait until a run tells of so many chunks."""
    assert process.stdout is not None
    assert any(line.startswith(f"{chunks} ") for line in process.stdout)


@contextmanager
def dask(*arguments: str, **environment: str) -> Iterator[subprocess.Popen[str]]:
    """One of dask's commands, which is killed with all that it has started."""
    code = "import sys; from dask.__main__ import main; sys.exit(main())"
    process = subprocess.Popen(
        [sys.executable, "-c", code, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, text=True,
        env={**os.environ, "PYTHONPATH": str(TESTS), **environment}, start_new_session=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        for one in (*psutil.Process(process.pid).children(recursive=True), process):
            one.kill()
        process.wait()


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
        return port


@contextmanager
def scheduler() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A scheduler on loopback, which answers."""
    port = free_port()
    with dask(
        "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--dashboard-address", "127.0.0.1:0"
    ) as own:
        for _ in range(200):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.05)
        yield f"tcp://127.0.0.1:{port}", own


WORKER = ("--nthreads", "1", "--no-nanny", "--host", "127.0.0.1", "--no-dashboard", "--memory-limit", "0")


@pytest.mark.parametrize("workers", [0, 2])
def test_nothing_but_loopback_is_listened_to_and_nothing_is_left(tmp_path: Path, workers: int, whole: dict[str, bytes]) -> None:
    seen: set[tuple[str, int]] = set()
    before = set(threading.enumerate())

    def listening() -> set[tuple[str, int]]:
        of = (psutil.Process(), *psutil.Process().children(recursive=True))
        return {tuple(one.laddr) for p in of for one in p.net_connections("inet") if one.status == "LISTEN"}

    def look(*_: object) -> None:
        seen.update(listening() - others)

    others = listening()  # what other tests of this process have left open
    outcome = worked(tmp_path / "s", workers=workers, progress=look)
    assert outcome == Outcome(12, 12, (), ())
    assert files(tmp_path / "s") == whole
    assert {host for host, _ in seen} == ({"127.0.0.1"} if workers else set())
    left = {thread.name for thread in set(threading.enumerate()) - before}
    assert all(name.startswith(("Dask-Offload", "Dask-Callback", "zarr", "asyncio")) for name in left)
    assert not [one for one in psutil.Process().children() if "spawn_main" in " ".join(one.cmdline())]


def test_a_killed_run_goes_on_to_the_same_store(tmp_path: Path, whole: dict[str, bytes]) -> None:
    path, rng, before = tmp_path / "s", random.Random(5), 0
    for _ in range(3):
        with started(path, 12, 0.2, 0) as process:
            has_done(before + 1, process)
            time.sleep(rng.uniform(0, 0.5))
            process.kill()
        before = int(read(path).done.sum())
    assert 3 <= before < 12
    assert worked(path).done == 12
    assert files(path) == whole


def test_a_chunk_whose_worker_is_killed_is_given_to_another(tmp_path: Path, whole: dict[str, bytes]) -> None:
    task = Cheap(OWN, kills=(3,), once=str(tmp_path / "killed"))
    assert worked(tmp_path / "s", task, workers=1) == Outcome(12, 12, (), ())
    assert (tmp_path / "killed").exists()
    assert files(tmp_path / "s") == whole


def test_a_chunk_that_kills_its_workers_is_told_and_no_other_is_blamed(tmp_path: Path) -> None:
    import dask as settings

    with settings.config.set({"distributed.scheduler.allowed-failures": 0}):
        outcome = worked(tmp_path / "s", Cheap(OWN, 0.05, kills=(3,)), workers=1)
    assert outcome.done == 11
    assert [str(failure) for failure in outcome.failures] == ["designs 150 to 199: its worker process died (attempts: 1)"]


def test_a_damaged_store_is_mended(tmp_path: Path, whole: dict[str, bytes]) -> None:
    path = tmp_path / "s"
    worked(path)
    (path / "f" / "c" / "3").unlink()
    (path / "x" / "zarr.json").write_text("{}")
    outcome = worked(path)
    assert [str(fault) for fault in outcome.mended] == [
        "x/zarr.json is cut short, 2 of " + f"{len(whole['x/zarr.json'])} bytes", "f/c/3 is missing (designs 150 to 199)",
    ]  # fmt: skip
    assert files(path) == whole


def test_chunks_that_fail_are_told_and_tried_again(tmp_path: Path, whole: dict[str, bytes]) -> None:
    told: list[tuple[int, int]] = []
    task = Cheap(OWN, fails=(2, 11))
    outcome = worked(tmp_path / "s", task, progress=lambda done, total, remaining: told.append((done, total)))
    assert outcome[:2] == (10, 12)
    assert [str(failure) for failure in outcome.failures] == [
        "designs 100 to 149: ArithmeticError: chunk 2 will not do (attempts: 3)",
        "designs 550 to 583: ArithmeticError: chunk 11 will not do (attempts: 3)",
    ]
    assert len(told) == 13
    assert told[-1] == (10, 12)
    assert [failure.attempts for failure in worked(tmp_path / "s", replace(task, fails=(11,))).failures] == [6]
    assert worked(tmp_path / "s") == Outcome(12, 12, (), ())
    assert files(tmp_path / "s") == whole


def test_a_chunk_that_fails_once_is_done(tmp_path: Path, whole: dict[str, bytes]) -> None:
    task = Cheap(OWN, fails=(2,), once=str(tmp_path / "failed"))
    assert worked(tmp_path / "s", task) == Outcome(12, 12, (), ())
    assert (tmp_path / "failed").exists()
    assert files(tmp_path / "s") == whole


def test_a_run_with_too_many_failures_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "MOST_FAILURES", 3)
    with pytest.raises(
        NoResultError, match=r"3 chunks have failed, .*will not do.*; \d of 12 chunks are done, and the same command"
    ):
        worked(tmp_path / "s", Cheap(OWN, fails=tuple(range(12))))


def test_two_workers_of_a_cluster_make_the_same_store_and_losing_the_scheduler_loses_nothing(
    tmp_path: Path, whole: dict[str, bytes]
) -> None:
    with scheduler() as (address, own), dask("worker", address, *WORKER) as first, dask("worker", address, *WORKER):
        assert worked(tmp_path / "s", scheduler=address) == Outcome(12, 12, (), ())
        assert files(tmp_path / "s") == whole
        # One of the two dies while it works.
        with started(tmp_path / "killed", 12, 0.2, 0, address) as process:
            has_done(0, process)
            first.kill()
            out, err = process.communicate(timeout=60)
        assert (process.returncode, err) == (0, "")
        assert files(tmp_path / "killed") == whole
        # The scheduler dies.
        with started(tmp_path / "lost", 12, 0.2, 0, address) as process:
            has_done(2, process)
            own.kill()
            out, err = process.communicate(timeout=60)
        assert process.returncode == NoResultError.exit_code, out
        assert err.startswith(f"trivet: {address}: was lost; ")
        assert err.endswith("of 12 chunks are done, and the same command goes on from there\n")
        assert err.count("\n") == 1
    assert worked(tmp_path / "lost").done == 12
    assert files(tmp_path / "lost") == whole


def test_a_scheduler_without_workers_is_waited_for_and_given_up(tmp_path: Path, whole: dict[str, bytes]) -> None:
    with scheduler() as (address, _):
        with pytest.raises(NoResultError, match=r"has had no workers for [1-4] s; 0 of 12 chunks are done"):
            worked(tmp_path / "s", scheduler=address, patience=1.0)
        fake = tmp_path / "fake" / "trivet-9.9.dist-info"
        fake.mkdir(parents=True)
        (fake / "METADATA").write_text("Metadata-Version: 2.1\nName: trivet\nVersion: 9.9\n")
        other = f"has trivet 9.9, and this process has {versions()['trivet']}; install the same on both"
        with dask("worker", address, *WORKER, PYTHONPATH=f"{fake.parent}{os.pathsep}{TESTS}"):
            with pytest.raises(InputError, match=f"the worker on .* {other}"):  # it comes late
                worked(tmp_path / "s", scheduler=address, patience=60.0)
            with pytest.raises(InputError, match=f"the worker at tcp://.* {other}"):
                worked(tmp_path / "s", scheduler=address)
    worked(tmp_path / "s")
    assert files(tmp_path / "s") == whole


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:{port}", "127.0.0.1:{port}", "http://127.0.0.1:{port}", "tcp://", "nonsense", ""]
)
def test_a_scheduler_that_is_not_there_is_named(tmp_path: Path, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trivet.design.engine.cluster.ANSWER", 1.0)
    address = address.format(port=free_port())
    with pytest.raises(InputError, match=f"^{address}: no scheduler answers there .*start one"):
        worked(tmp_path / "s", scheduler=address)


def test_a_notebook_may_ask_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: dict[str, bytes]) -> None:
    monkeypatch.setattr("trivet.design.engine.cluster.ANSWER", 1.0)

    async def cell() -> None:
        with pytest.raises(InputError, match="not within 1 s"):
            worked(tmp_path / "s", scheduler=f"tcp://127.0.0.1:{free_port()}")
        worked(tmp_path / "s")

    asyncio.run(cell())
    assert files(tmp_path / "s") == whole


def test_something_else_that_listens_is_no_scheduler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trivet.design.engine.cluster.ANSWER", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as silent, pytest.raises(InputError, match="no scheduler answers there"):
        worked(tmp_path / "s", scheduler=f"tcp://127.0.0.1:{silent.getsockname()[1]}")


def test_workers_are_none_or_more(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="workers: -1; a number of processes was expected"):
        worked(tmp_path / "s", workers=-1, patience=1.0)


def test_workers_and_a_scheduler_are_one_too_many(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="give either of the two"):
        worked(tmp_path / "s", workers=2, scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize("workers", [0, 1])
def test_an_interruption_from_the_keyboard_stops_at_once_and_leaves_what_is_done(
    tmp_path: Path, workers: int, whole: dict[str, bytes]
) -> None:
    with started(tmp_path / "s", 12, 0.3, workers) as process:
        has_done(2, process)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: workers too
        _, err = process.communicate(timeout=30)
    assert process.returncode == -signal.SIGINT
    assert err.splitlines()[-1] == "KeyboardInterrupt"
    assert err.count("Traceback") == 1
    assert "distributed - " not in err
    assert worked(tmp_path / "s").done == 12
    assert files(tmp_path / "s") == whole


def test_few_chunks_are_in_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    most = 0
    own = running._Run._send

    def counted(self: running._Run, k: int) -> None:
        nonlocal most
        own(self, k)
        most = max(most, len(self.flying))

    monkeypatch.setattr(running._Run, "_send", counted)
    worked(tmp_path / "s")
    assert most == running.AHEAD


def test_the_remaining_time_is_that_of_late_without_first_chunks() -> None:
    now = 0.0
    pace = Pace(lambda: now)
    assert pace.remaining(10) is None
    for late, is_first in ((100, True), (100, True)):
        now += late
        pace.note(is_first)
        assert pace.remaining(10) is None
    for _ in range(10):
        now += 2
        pace.note(False)
    assert pace.remaining(10) == pytest.approx(20)
    for _ in range(100):
        now += 3
        pace.note(False)
    assert pace.remaining(10) == pytest.approx(30)


def test_versions_that_differ_are_both_named() -> None:
    own = versions()
    assert not differing(own, own)
    assert not differing({**own, "other": "1"}, own)
    told = f"has jax 0.1, and this process has {own['jax']}; install the same on both"
    assert differing({**own, "jax": "0.1"}, own) == told
    assert differing({}, own).startswith("has python not at all, and this process has 3.")
