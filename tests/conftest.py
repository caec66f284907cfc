"""What all tests share: engines that nobody here wrote (peers), and one thread per linear algebra call."""

from __future__ import annotations

import gc
import importlib
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

# The systems are small: threads inside LAPACK cost more than they bring.  To be set before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Most of the time goes into compiling: what one worker, or an earlier run, has compiled serves the others.
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[1] / ".pytest_cache" / "kernels"))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")

import hypothesis
import pytest

# A first call compiles, and machines are shared: slow is no fault.
hypothesis.settings.register_profile("trivet", deadline=None)
hypothesis.settings.load_profile("trivet")


# What is traced lives long: looking through all of it for waste after every few hundred objects takes a tenth of the time.
gc.set_threshold(20_000, 20, 20)

MOST_MAPS = 20_000


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "peer(name, module=name, program=None): compares with an engine that nobody here wrote, a module or a program; "
        "skipped where it is missing, failed with TRIVET_PEERS=required",
    )


def pytest_runtest_setup(item: pytest.Item) -> None:
    for mark in item.iter_markers("peer"):
        error = missing(*mark.args, **mark.kwargs)
        if error is not None:
            reason = f"peer {mark.args[0]} is missing ({error})"
            if os.environ.get("TRIVET_PEERS") == "required":
                pytest.fail(reason + "; TRIVET_PEERS=required", pytrace=False)
            pytest.skip(reason)


def forget_kernels() -> None:
    """Forget compiled kernels before there are too many: each is mapped into memory, and Linux allows a process 65,530 maps."""
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        import jax

        jax.clear_caches()
        gc.collect()


@pytest.fixture(autouse=True, scope="module")
def few_kernels() -> Iterator[None]:
    """Few when the next module begins."""
    yield
    forget_kernels()


@pytest.fixture
def own_kernels() -> Iterator[None]:
    """For tests that compile as many as whole modules: few when the next of them begins."""
    yield
    forget_kernels()


@pytest.fixture(scope="module")
def quick_kernels() -> Iterator[None]:
    """For tests whose kernels take longer to compile than to run: without the optimizations that take most of that time."""
    import jax

    jax.config.update("jax_disable_most_optimizations", True)  # type: ignore[no-untyped-call]
    yield
    jax.config.update("jax_disable_most_optimizations", False)  # type: ignore[no-untyped-call]


@pytest.fixture
def trivet(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Callable[..., tuple[int, str, str]]:
    """Runs a command in an empty folder; gives its exit code, output and errors."""
    from trivet.cli import main

    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["trivet", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        out, err = capfd.readouterr()
        return int(stop.value.code or 0), out, err

    return run


def missing(name: str, module: str | None = None, program: str | None = None) -> str | None:
    """What a peer is missing for, or None where it is there."""
    if program is not None:
        return None if shutil.which(program) else f"no program {program}"
    try:
        importlib.import_module(module or name)
    except Exception as error:  # a wheel whose system library is missing raises more than ImportError
        return str(error)
    return None
