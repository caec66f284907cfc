"""A page on paper: printed into a PDF file by a browser of this computer."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from trivet.errors import NoResultError, one_line
from trivet.files import borrowed_folder

BROWSERS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge",
    "microsoft-edge-stable", "msedge", "brave-browser", "brave",
)  # fmt: skip
"""Programs that print alike."""

TIMEOUT = 180.0
"""Longest time that printing takes, s."""

_DRAWING = 30_000
"""Time that scripts of the page are given to draw, ms of the page's own clock, which runs ahead when there is nothing to do."""


def find_browser() -> str:
    """A browser that prints; raises NoResultError where there is none."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        raise NoResultError(
            "a PDF is printed by a browser, and neither Chromium, Chrome nor Edge is on the PATH; "
            "install one, or write .html and print that from any browser"
        )
    return found


def print_page(page: str, path: Path) -> None:
    """Print a page (HTML) into a file; whoever interrupts it leaves no browser and no file behind."""
    browser = find_browser()
    with borrowed_folder() as folder:
        source, made = folder / "page.html", folder / "page.pdf"
        source.write_text(page, encoding="utf-8")
        _run([browser, *_options(folder), f"--print-to-pdf={made}", source.as_uri()], folder)
        if not made.is_file() or not made.stat().st_size:
            raise NoResultError(f"{browser}: has printed nothing; write .html and print that from any browser")
        shutil.copyfile(made, path)


def _options(folder: Path) -> list[str]:
    """Of a browser that shows nothing, knows nothing of the user and asks nobody."""
    options = [
        "--headless", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run",
        "--disable-extensions", "--disable-background-networking", "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND",
        "--no-pdf-header-footer", "--generate-pdf-document-outline", f"--virtual-time-budget={_DRAWING}",
        f"--user-data-dir={folder / 'profile'}",
    ]  # fmt: skip
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        options.append("--no-sandbox")  # Chromium refuses the super-user otherwise
    return options


def _run(command: list[str], folder: Path) -> None:
    """Run a browser with its children, and end them all whatever happens; whatever it writes goes into the folder."""
    said, own = folder / "said", os.environ | {"TMPDIR": str(folder)}
    with said.open("wb") as sink:
        streams: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": sink, "stderr": sink}
        process = subprocess.Popen(command, env=own, start_new_session=sys.platform != "win32", **streams)
        try:
            code = process.wait(TIMEOUT)
        except subprocess.TimeoutExpired:
            raise NoResultError(f"{command[0]}: has not printed within {TIMEOUT:g} s; write .html and print that") from None
        finally:
            _end(process)
    if code:
        words = said.read_text(errors="replace").strip().splitlines()
        raise NoResultError(f"{command[0]}: ended with {code}: {one_line(words[-1], 200) if words else 'no word'}")


def _end(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError, PermissionError):
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()
