"""The door of the page: who may come in, what is heard, and how fast."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import math
import os
import sys
import time
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
import viser
import websockets
import websockets.asyncio.client

from trivet.errors import InputError
from trivet.viewer import gate
from trivet.viewer.panels.inputs import on_number

of_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc, which Linux alone has")
PROTOCOL = websockets.Subprotocol(f"viser-v{viser.__version__}")


def packed(**message: Any) -> bytes:
    return msgspec.msgpack.encode(message)


def update(value: Any, uuid: str = "1", **more: Any) -> bytes:
    return packed(type="GuiUpdateMessage", uuid=uuid, updates={"value": value, **more})


LOOKING = packed(
    type="ViewerCameraMessage", wxyz=[1.0, 0.0, 0.0, 0.0], position=[1.0, 0.0, 0.0], fov=1.0, image_height=600, image_width=800,
    near=0.1, far=10.0, look_at=[0.0, 0.0, 0.0], up_direction=[0.0, 0.0, 1.0],
)  # fmt: skip
"""Without it nobody is taken to be there."""


def nested(depth: int) -> Any:
    value: Any = 1.0
    for _ in range(depth):
        value = [value]
    return value


@pytest.mark.parametrize("value", [1, 1.5, True, "xx", [1.0, 2.0], None])
def test_values_are_heard(value: Any) -> None:
    assert gate.is_welcome(update(value))


@pytest.mark.parametrize(
    "raw",
    [
        pytest.param(update(math.nan), id="nan"),
        pytest.param(update(math.inf), id="infinite"),
        pytest.param(update(1e300), id="beyond reason"),
        pytest.param(update("x" * 1000), id="long text"),
        pytest.param(update(list(range(1000))), id="long list"),
        pytest.param(update(nested(50)), id="deep"),
        pytest.param(update(b"bytes"), id="bytes"),
        pytest.param(update(0, removed=True), id="another property"),
        pytest.param(packed(type="GuiUpdateMessage", uuid="1", updates={"update_cb": []}), id="a callback"),
        pytest.param(packed(type="GuiUpdateMessage", uuid="1"), id="no update"),
        pytest.param(
            packed(type="TransformControlsUpdateMessage", name="/h", wxyz=[1, 0, 0, 0], position=[0, 0]), id="in a plane"
        ),
        pytest.param(packed(type="TransformControlsUpdateMessage", name="/h", wxyz="1000", position=[0, 0, 0]), id="a text"),
        pytest.param(
            packed(type="SceneNodeClickMessage", name="/m", ray_origin={"a": 1}, ray_direction=[0, 0, 1]), id="no ray"
        ),
        pytest.param(
            packed(type="SceneNodeClickMessage", name="/m", ray_origin=[[1], 0, 0], ray_direction=[0, 0, 1]), id="nested"
        ),
        pytest.param(packed(type="ShareUrlRequest"), id="seen from elsewhere"),
        pytest.param(packed(type="FileTransferStartUpload", source_component_uuid="1"), id="a file"),
        pytest.param(packed(type="RunJavascriptMessage", source="alert()"), id="a script"),
        pytest.param(packed(type=["GuiUpdateMessage"]), id="type of a wrong type"),
        pytest.param(packed(uuid="1"), id="no type"),
        pytest.param(msgspec.msgpack.encode([1, 2]), id="a list"),
        pytest.param(b"\xc1", id="no message"),
        pytest.param(b"\x91" * 5000 + b"\xc0", id="no end of lists"),
        pytest.param(b"\x81\xa4type\xdd\xff\xff\xff\xff", id="a list of four thousand million"),
        pytest.param("text", id="text"),
        pytest.param(update([["x" * 200] * 32] * 8), id="large"),
    ],
)
def test_everything_else_is_not(raw: Any) -> None:
    assert not gate.is_welcome(raw)


@pytest.mark.parametrize("port", [0, -1, 70000])
def test_a_port_is_one(port: int) -> None:
    with pytest.raises(InputError, match=rf"--port {port}: expected 1 to 65535"):
        gate.free_port(port, 8080)


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    failures: list[BaseException] = []
    opened = gate.open_server(gate.free_port(None, 8300), False, failures.append)
    yield opened
    gate.close_server(opened)
    assert failures == []


@of_linux
def test_it_listens_on_loopback_only(server: viser.ViserServer) -> None:
    port = server.get_port()
    with open("/proc/net/tcp") as table:
        local = [line.split()[1] for line in list(table)[1:] if line.split()[3] == "0A"]
    assert [address for address in local if address.endswith(f":{port:04X}")] == [f"0100007F:{port:04X}"]
    with open("/proc/net/tcp6") as table:
        assert not any(line.split()[1].endswith(f":{port:04X}") for line in list(table)[1:] if line.split()[3] == "0A")
    with pytest.raises(InputError, match=rf"--port {port}: somebody listens there already"):
        gate.free_port(port, 8300)


@contextlib.asynccontextmanager
async def connected(server: viser.ViserServer, **more: Any) -> Any:
    address = f"ws://127.0.0.1:{server.get_port()}"
    async with websockets.asyncio.client.connect(address, subprotocols=[PROTOCOL], max_size=None, **more) as connection:
        yield connection


@pytest.mark.parametrize("origin", ["http://evil.example", "https://127.0.0.1.evil.example", "null", "file://"])
def test_pages_from_elsewhere_do_not_connect(server: viser.ViserServer, origin: str) -> None:
    async def attempt() -> None:
        async with connected(server, origin=origin):
            pass

    with pytest.raises(websockets.InvalidStatus, match="403"):
        asyncio.run(attempt())


@pytest.mark.parametrize("origin", ["http://127.0.0.1:8080", "http://localhost:9", None])
def test_pages_of_this_machine_do(server: viser.ViserServer, origin: str | None) -> None:
    async def attempt() -> None:
        async with connected(server, origin=origin) as connection:
            await connection.recv()

    asyncio.run(attempt())


def test_there_are_seats_for_some(server: viser.ViserServer) -> None:
    async def attempt() -> int | None:
        async with contextlib.AsyncExitStack() as stack:
            for _ in range(gate.MOST_CONNECTIONS):
                await (await stack.enter_async_context(connected(server))).recv()
            one_more = await stack.enter_async_context(connected(server))
            await one_more.wait_closed()
            code: int | None = one_more.close_code
            return code

    assert asyncio.run(attempt()) == 1013


@of_linux
def test_a_flood_is_read_at_a_pace_and_takes_no_memory(server: viser.ViserServer) -> None:
    slider = server.gui.add_slider("tilt", 0.0, 10.0, 0.1, 0.0)
    uuid = slider._impl.uuid
    heard: list[float] = []

    @slider.on_update
    async def _(_: Any) -> None:
        heard.append(slider.value)

    async def flood() -> int | None:
        async with connected(server) as connection:
            await connection.send(LOOKING)
            bad = [update("abc", uuid), update([1.0], uuid), update("nan", uuid), packed(type="ShareUrlRequest"), b"\xc1\xc1"]
            for k in range(10_000):
                with contextlib.suppress(websockets.ConnectionClosed):
                    await connection.send(update(float(k % 7), uuid) if k % 2 else bad[k // 2 % len(bad)])
        code: int | None = connection.close_code
        return code

    async def well_behaved() -> None:
        async with connected(server) as connection:
            await connection.send(LOOKING)
            await connection.send(update(9.5, uuid))
            await asyncio.sleep(1)

    before = resident()
    assert asyncio.run(asyncio.wait_for(flood(), 60)) == 1008
    assert 0 < len(heard) <= gate.BURST + 20 * gate.MOST_PER_SECOND
    asyncio.run(well_behaved())
    assert slider.value == 9.5
    assert resident() - before < 100e6


def test_a_large_message_ends_its_connection_and_no_other(server: viser.ViserServer) -> None:
    async def attempt() -> int | None:
        async with connected(server) as other, connected(server) as connection:
            await connection.send(b"\x00" * (gate.MOST_BYTES + 1))
            with contextlib.suppress(websockets.ConnectionClosed):
                while True:
                    await connection.recv()
            await other.ping()
            code: int | None = connection.close_code
            return code

    assert asyncio.run(attempt()) == 1009


def resident() -> float:
    """Memory of this process, bytes."""
    with open("/proc/self/statm") as file:
        return float(int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE"))


def test_a_viser_that_goes_round_the_door_is_not_started(monkeypatch: pytest.MonkeyPatch) -> None:
    @contextlib.contextmanager
    def unguarded() -> Iterator[list[str]]:
        yield []

    monkeypatch.setattr(gate, "_guarded", unguarded)
    with pytest.raises(RuntimeError, match="cannot be guarded"):
        gate.open_server(gate.free_port(None, 8300), False, print)


def test_a_port_that_is_taken_meanwhile(server: viser.ViserServer) -> None:
    taken = server.get_port()
    with pytest.raises(InputError, match=rf"--port {taken}: somebody listens there already"):
        gate.open_server(taken, True, print)
    other = gate.open_server(taken, False, print)
    assert other.get_port() != taken
    gate.close_server(other)


def test_a_fault_of_our_own_is_told() -> None:
    failures: list[BaseException] = []
    server = gate.open_server(gate.free_port(None, 8300), False, failures.append)
    slider = server.gui.add_slider("tilt", 0.0, 10.0, 0.1, 0.0)

    def fail(value: float) -> None:
        raise ValueError(value)

    on_number(slider, fail)

    async def attempt() -> None:
        async with connected(server) as connection:
            await connection.send(LOOKING)
            await asyncio.sleep(0.3)
            await connection.send(update("abc", slider._impl.uuid))
            await connection.send(update(3.0, slider._impl.uuid))
            await asyncio.sleep(0.3)

    asyncio.run(attempt())
    for _ in range(50):
        gc.collect()
        if failures:
            break
        time.sleep(0.05)
    gate.close_server(server)
    assert [str(failure) for failure in failures] == ["3.0"]
