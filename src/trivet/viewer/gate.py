"""The door of the page: a viser server on loopback that lets in only what a page of ours may say, and no faster than it can.

viser takes any message of its protocol from whoever connects.  Here a connection has to come from a page of this machine
(browsers tell the origin of a page, and any other page that is open could else talk to ours); of the protocol only inputs are
heard, their values plain, finite and small; and who talks too fast is not heard, in the end not at all.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import math
import re
import socket
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection

from trivet.errors import InputError

LOOPBACK = "127.0.0.1"
ORIGINS = re.compile(r"http://(127\.0\.0\.1|localhost|\[::1\])(:\d+)?")
"""Pages that may connect: those of this machine; through a tunnel their port is another."""
MOST_BYTES = 32_768
"""Of one message."""
MOST_TEXT, MOST_MEMBERS, MOST_DEPTH = 200, 32, 4
"""Characters of a text, members of a list or table, tables within tables."""
MOST_PER_SECOND, BURST, PATIENCE = 400.0, 400.0, 4000.0
"""Messages of one connection: in the long run, at once, and too many of them before it is ended."""
MOST_CONNECTIONS = 8

VALUES = frozenset({"GuiUpdateMessage"})
"""What carries values of controls."""
NUMBERS = {
    "SceneNodeClickMessage": {"ray_origin": 3, "ray_direction": 3},
    "TransformControlsUpdateMessage": {"position": 3, "wxyz": 4},
    "ViewerCameraMessage": {"position": 3, "wxyz": 4, "look_at": 3, "up_direction": 3},
}
"""What has to be so many numbers."""
SIGNALS = frozenset({"CommandTriggerMessage", "TransformControlsDragEndMessage", "TransformControlsDragStartMessage"})
"""What says that something happened."""
HEARD = VALUES | NUMBERS.keys() | SIGNALS
"""Messages that are heard; all others are dropped: files, commands to others, requests to be seen from elsewhere."""


def is_welcome(raw: bytes | str) -> bool:
    """Whether a message is one of `HEARD`, and its values are plain, finite and small."""
    if not isinstance(raw, bytes) or len(raw) > MOST_BYTES:
        return False
    try:
        message = msgspec.msgpack.decode(raw)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return False
    if not isinstance(message, dict) or not isinstance(kind := message.get("type"), str) or kind not in HEARD:
        return False
    if kind in VALUES and (not isinstance(changes := message.get("updates"), dict) or set(changes) != {"value"}):
        return False
    if not all(_are_numbers(message.get(key), count) for key, count in NUMBERS.get(kind, {}).items()):
        return False
    return _is_plain(message, MOST_DEPTH)


def _are_numbers(values: Any, count: int) -> bool:
    return isinstance(values, list) and len(values) == count and all(type(v) in (int, float) for v in values)


def _is_plain(value: Any, depth: int) -> bool:
    if isinstance(value, str):
        return len(value) <= MOST_TEXT
    if isinstance(value, bool) or value is None:
        return True
    if isinstance(value, (int, float)):
        return math.isfinite(value) and abs(value) < 1e15
    if not isinstance(value, (list, dict)) or depth == 0 or len(value) > MOST_MEMBERS:
        return False
    members = [*value, *value.values()] if isinstance(value, dict) else value
    return all(_is_plain(member, depth - 1) for member in members)


class _Listening(ServerConnection):
    """A connection that gives on what is welcome, at a bounded pace; what comes faster is lost, and much of it ends it."""

    _left = BURST
    _since = 0.0

    async def recv(self, decode: bool | None = None) -> Any:
        while True:
            raw = await super().recv(decode)
            now = time.monotonic()
            self._left = min(BURST, self._left + MOST_PER_SECOND * (now - self._since)) - 1
            self._since = now
            if self._left < -PATIENCE:
                await self.close(1008, "too fast")
            elif self._left >= 0 and is_welcome(raw):
                return raw


def free_port(wanted: int | None, default: int) -> int:
    """A port of loopback that nobody listens on: the one that is wanted, or else the first from a default one.

    Raises:
        InputError: when the one that is wanted is taken, or is none.
    """
    if wanted is not None and not 1 <= wanted <= 65535:
        raise InputError(f"--port {wanted}: expected 1 to 65535")
    for port in (wanted,) if wanted is not None else range(default, default + 100):
        with socket.socket() as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with contextlib.suppress(OSError):
                one.bind((LOOPBACK, port))
                return port
    raise InputError(_taken(f"--port {wanted}" if wanted is not None else f"ports {default} to {default + 99}"))


def open_server(port: int, is_wanted: bool, failed: Callable[[BaseException], None]) -> viser.ViserServer:
    """A server on loopback behind this door.

    Args:
        port: where it listens; or, if somebody else does so meanwhile, on one of the next ones.
        is_wanted: whether it has to be that port.
        failed: called with what our own handlers of inputs raise.

    Raises:
        InputError: when somebody else listens on the port that is wanted.
        RuntimeError: when viser is of a version that does not go through the door.
    """
    warnings.filterwarnings("ignore", category=UserWarning, module=r"viser\b")  # of hostile messages, and at the end
    with _guarded() as doors, contextlib.redirect_stdout(io.StringIO()):  # viser greets
        server = viser.ViserServer(host=LOOPBACK, port=port, verbose=False)
    if set(doors) != {LOOPBACK}:
        close_server(server)
        raise RuntimeError(f"viser {viser.__version__} cannot be guarded; install viser >= 1.1, < 2")
    if is_wanted and server.get_port() != port:
        close_server(server)
        raise InputError(_taken(f"--port {port}"))

    def unhandled(_: Any, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if error is not None and _is_ours(error):  # what viser makes of hostile messages is no news
            failed(error)

    server.get_event_loop().set_exception_handler(unhandled)
    return server


def _is_ours(error: BaseException) -> bool:
    """Whether an error came through code of the page."""
    frames = traceback.extract_tb(error.__traceback__)
    return any(Path(frame.filename).parent.is_relative_to(Path(__file__).parent) for frame in frames)


def _taken(what: str) -> str:
    return f"{what}: somebody listens there already, or it is reserved; name another with --port"


def close_server(server: viser.ViserServer) -> None:
    """End it."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


@contextmanager
def _guarded() -> Iterator[list[str]]:
    """Have websockets serve through the door while viser starts; gives on which hosts it did."""
    serve, doors = websockets.asyncio.server.serve, []

    def guarded(handler: Any, host: str, port: int, **options: Any) -> Any:
        doors.append(host)
        seats = asyncio.Semaphore(MOST_CONNECTIONS)

        async def seated(connection: ServerConnection) -> None:
            if seats.locked():
                await connection.close(1013, f"more than {MOST_CONNECTIONS} pages")
                return
            async with seats:
                with contextlib.suppress(Exception):  # what viser does not understand ends the connection, without a word
                    await handler(connection)

        own = {"origins": [ORIGINS, None], "create_connection": _Listening, "max_size": MOST_BYTES, "open_timeout": 5}
        return serve(seated, host, port, **options | own)

    websockets.asyncio.server.serve = guarded  # type: ignore[assignment, misc]
    try:
        yield doors
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]
