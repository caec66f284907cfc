"""Serving the page until somebody ends it."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from trivet.files import remove_begun
from trivet.viewer.gate import LOOPBACK, close_server, free_port, open_server
from trivet.viewer.page import Page
from trivet.viewer.state import State

PORT = 8080
PULSE = 0.1
"""How often (s) it is looked whether somebody ended it."""
LONGEST_END = 10.0
"""After so many seconds (s) the end is not waited for any longer."""


@contextmanager
def serving(
    state: State, port: int | None = None, folder: Path | None = None, is_dark: bool = False
) -> Iterator[tuple[str, Page]]:
    """A page on loopback while the block lasts; gives its address and the page.

    Args:
        state: what it shows.
        port: to listen on; the first free one from `PORT` when not given.
        folder: where it keeps files; the working folder when not given.
        is_dark: whether it is light on dark.

    Raises:
        InputError: when somebody else listens on that port.
    """
    page: Page | None = None
    early: list[BaseException] = []
    server = open_server(
        free_port(port, PORT), port is not None, lambda error: early.append(error) if page is None else page.fail(error)
    )
    try:
        page = Page(server, state, folder or Path.cwd(), is_dark)
        yield f"http://{LOOPBACK}:{server.get_port()}", page
    finally:
        if page is not None:
            page.end()
        close_server(server)


def serve(state: State, port: int | None, is_dark: bool, in_browser: bool, tell: Callable[[str], None]) -> None:
    """Show a page until Ctrl-C; its thread must be the main one.

    Args:
        state, port, is_dark: as for `serving`.
        in_browser: whether the page is opened.
        tell: called with a line that says where it is.

    Raises:
        InputError: when somebody else listens on the port.
        SystemExit: when the process is told to end.
    """
    sys.setswitchinterval(1e-3)  # who drags must not wait for a study's turn
    with serving(state, port, None, is_dark) as (address, page):
        told: list[int] = []

        def end(number: int, frame: object) -> None:
            if told:  # once more: at once
                _leave(128 + number)
            told.append(number)  # nothing that takes a lock: this thread may hold it

        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, end)
        tell(f"{address}  (Ctrl-C ends it)")
        if in_browser and _has_screen():
            webbrowser.open(address)
        while not told:  # a signal that came to another thread is heard by this one when it wakes
            time.sleep(PULSE)
        code = 0 if told[0] == signal.SIGINT else 128 + told[0]
        if code == 0:
            print("trivet: closing the page", file=sys.stderr, flush=True)
        late = threading.Timer(LONGEST_END, _leave, (code,))  # whatever is stuck keeps nobody
        late.daemon = True
        late.start()
    if not page.is_over:  # a thread that still compiles would abort the process where Python ends in good order
        _leave(code)
    if code:
        raise SystemExit(code)


def _leave(code: int) -> None:
    """End the process without waiting for any thread; no half of a file stays."""
    remove_begun()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


def _has_screen() -> bool:
    """Whether a browser would have a window: without one a browser for terminals might start in this one."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
