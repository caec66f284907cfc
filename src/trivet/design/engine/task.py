"""What workers do."""

from __future__ import annotations

import platform
import threading
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple, Protocol

from trivet.design.store import Chunk
from trivet.errors import InputError

Work = Callable[[int], Chunk]

PACKAGES = ("trivet", "numpy", "scipy", "jax", "jaxlib", "distributed")
"""Of which all machines must have the same version: numbers depend on all but the last."""

_prepared: list[tuple[Task, Work]] = []
"""The study that this process is at, none or one."""
_preparing = threading.Lock()


class Task(Protocol):
    """A study as it is sent to workers: small, of a class that they can import, and equal to its copies."""

    def prepared(self) -> Work:
        """What works out a chunk by its number; made once in each process."""


class Found(NamedTuple):
    """What comes back."""

    chunk: Chunk
    is_first: bool
    """Whether this process had to prepare itself, which takes time that later chunks do not."""


class OtherVersionsError(InputError):
    """A worker has other versions of packages."""


def versions() -> dict[str, str]:
    """Versions in this process of what results depend on; empty where a package is missing."""
    found = {"python": ".".join(platform.python_version_tuple()[:2])}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = ""
    return found


def worked(task: Task, expected: Mapping[str, str], k: int) -> Found:
    """Work out a chunk, in whichever process this is.

    Raises:
        OtherVersionsError: where versions are not those of who asks.
    """
    difference = differing(versions(), expected)
    if difference:
        raise OtherVersionsError(f"the worker on {platform.node()} {difference}")
    with _preparing:
        is_first = not _prepared or _prepared[0][0] != task
        if is_first:
            _prepared[:] = [(task, task.prepared())]
        work = _prepared[0][1]
    return Found(work(k), is_first)


def differing(there: Mapping[str, str], here: Mapping[str, str]) -> str:
    """The first version that a worker has other than this process, in words; empty where all are the same."""
    for name, own in here.items():
        other = there.get(name, "")
        if other != own:
            return f"has {name} {other or 'not at all'}, and this process has {own or 'none'}; install the same on both"
    return ""
