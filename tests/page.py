"""The page in Chromium, as people see it: opened on a viewport, in a theme; what it complains of is kept."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SCREENS = Path(__file__).parents[1] / "build" / "screens"
"""Screenshots of the tests."""
OPTIONS = (
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
QUIET = ("THREE.Clock", "GPU stall due to ReadPixels", "GL Driver Message")
"""Warnings of viser's own libraries."""


class Seen:
    """A page that was opened, and what went wrong on it."""

    def __init__(self, page: Any, allowed: str) -> None:
        self.page = page
        page.set_default_timeout(90_000)
        self.faults: list[str] = []
        self.strangers: list[str] = []
        page.on("console", lambda m: self.faults.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on("request", lambda r: None if r.url.startswith((allowed, "data:", "blob:")) else self.strangers.append(r.url))
        page.on(
            "websocket", lambda s: None if s.url.startswith(allowed.replace("http", "ws")) else self.strangers.append(s.url)
        )

    @contextmanager
    def beside(self, address: str) -> Iterator[Seen]:
        """Another address in the same browser, with no network."""
        context = self.page.context.browser.new_context(viewport=self.page.viewport_size, offline=True)
        try:
            seen = Seen(context.new_page(), address)
            seen.page.goto(address)
            yield seen
        finally:
            context.close()

    def drawn(self) -> None:
        """Wait until what has come is drawn."""
        self.page.evaluate(
            "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 300))))"
        )

    def keep(self, name: str) -> bytes:
        """A screenshot, kept under a name."""
        SCREENS.mkdir(parents=True, exist_ok=True)
        found: bytes = self.page.screenshot(path=SCREENS / f"{name}.png")
        return found

    def check(self) -> None:
        """Nothing went wrong, and nobody else was asked."""
        assert [fault for fault in self.faults if not any(known in fault for known in QUIET)] == []
        assert self.strangers == []
        assert self.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


@contextmanager
def opened(address: str, size: tuple[int, int] = (1280, 800)) -> Iterator[Seen]:
    """An address in the browser, which is gone when the block ends."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=list(OPTIONS))
        try:
            seen = Seen(browser.new_context(viewport={"width": size[0], "height": size[1]}).new_page(), address)
            seen.page.goto(address)
            yield seen
        finally:
            browser.close()


def until(is_so: Callable[[], Any], longest: float = 120.0) -> None:
    """Wait until something is so."""
    end = time.monotonic() + longest
    while not is_so():
        assert time.monotonic() < end, "it did not come about in time"
        time.sleep(0.02)
