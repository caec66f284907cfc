"""Chromium without a network, told what to do through a pipe."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

OPTIONS = (
    "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--window-size=600,500", "--remote-debugging-pipe",
)  # fmt: skip


class Page:
    """A page that was opened."""

    def __init__(self, commands: Any, answers: Any) -> None:
        self._commands, self._answers = commands, answers
        self._numbers = itertools.count(1)
        self._session: dict[str, str] = {}

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The browser's answer to a command of its protocol; what it tells unasked is dropped."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters, **self._session}
        self._commands.write(json.dumps(message).encode() + b"\0")
        self._commands.flush()
        while True:
            answer = json.loads(b"".join(iter(lambda: self._answers.read(1), b"\0")))
            if answer.get("id") == number:
                assert "error" not in answer, answer
                found: dict[str, Any] = answer["result"]
                return found

    def open(self, address: str) -> None:
        """Go to a page; later commands are for it."""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = {"sessionId": self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]}
        self.ask("Page.bringToFront")  # pages behind others do not move
        self.ask("Page.navigate", url=address)

    def evaluate(self, script: str) -> Any:
        """What a piece of JavaScript gives, a promise its value."""
        answer = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")


@contextmanager
def opened(page: Path, profile: Path) -> Iterator[Page]:
    """A file in the browser, which is gone when the block ends."""
    (from_us, to_it), (from_it, to_us) = os.pipe(), os.pipe()
    # The browser reads 3 and writes 4.
    command = f'exec "$@" 3<&{from_us} 4>&{to_us}'
    chromium = ("chromium", *OPTIONS, f"--user-data-dir={profile}", "about:blank")
    process = subprocess.Popen(
        ["bash", "-c", command, "bash", *chromium], pass_fds=(from_us, to_us), start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        os.close(from_us)
        os.close(to_us)
        with os.fdopen(to_it, "wb") as commands, os.fdopen(from_it, "rb") as answers:
            found = Page(commands, answers)
            found.open(page.as_uri())
            yield found
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
