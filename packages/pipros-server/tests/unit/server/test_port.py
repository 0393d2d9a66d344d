"""Data that takes long to parse, and pings, cost only the connection that they arrive on."""

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator, Coroutine
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode

from pipros.basics.budget import Budget
from pipros.basics.limits import Limits
from pipros_server import loop_share
from pipros_server.listener import Listener
from pipros_server.port import ServerPort
from pipros_server.port_connection import (
    LONG_S,
    MAX_REST_S,
    PART_BYTES,
    RESTS,
    SMALL_PART_BYTES,
    PortConnection,
)

MESSAGE = "".join(chr(97 + number % 26) for number in range(300_000))


class Work:
    """A clock of processor time, in which the next `long_parts` parts of the data take `long_s`."""

    def __init__(self, long_s: float) -> None:
        self.long_s = long_s
        self.long_parts = 0
        self.parts = 0
        self._now_s = 0.0
        self._is_end = False

    def __call__(self) -> float:
        if self._is_end:
            self.parts += 1
            if self.long_parts:
                self.long_parts -= 1
                self._now_s += self.long_s
        self._is_end = not self._is_end
        return self._now_s


class Recorded(PortConnection):
    """Records how long it rests."""

    def __init__(self, work: Work, *args: Any, **options: Any) -> None:
        super().__init__(*args, work_clock=work, **options)
        self.work = work
        self.rests_s: list[float] = []

    def _rest_for(self, seconds: float) -> None:
        self.rests_s.append(seconds)
        super()._rest_for(0.01)


@contextlib.asynccontextmanager
async def serving(handle_websocket: Any, **options: Any) -> AsyncIterator[str]:
    """Open a port, and yield its address."""
    limits = Limits()
    port = ServerPort(Listener(limits, limit=5, log=logging.getLogger("test")), limits)
    options |= {"handle_websocket": handle_websocket, "respond": lambda *_: None, "max_bytes": 1_000_000}
    yield f"ws://127.0.0.1:{await port.open('127.0.0.1', 0, **options)}"
    await port.close()


def run(main: Coroutine[Any, Any, None]) -> None:
    with contextlib.closing(asyncio.SelectorEventLoop()) as loop:  # as pipros, also on Windows
        loop.run_until_complete(main)


class Discarding:
    """Discards the messages of clients, each part of which takes some time."""

    def __init__(self, part_s: float) -> None:
        self.part_s = part_s
        self.served = asyncio.Queue[Recorded]()

    def make(self, *args: Any, **options: Any) -> Recorded:
        return Recorded(Work(self.part_s), *args, **options)

    async def handle(self, connection: Recorded) -> None:
        connection.admit(Budget(10_000_000), 1_000_000)
        connection.work.parts, connection.work.long_parts = 0, 1000
        await self.served.put(connection)
        with contextlib.suppress(ConnectionClosed):
            async for _ in connection:
                pass


@pytest.mark.parametrize(
    ("long_s", "rest_s"), [(2 * LONG_S, 2 * LONG_S * RESTS), (3.0, MAX_REST_S)], ids=["usual", "longest"]
)
def test_a_connection_rests_after_long_parts_and_others_get_small_ones(long_s: float, rest_s: float) -> None:
    async def main() -> None:
        connections: list[Recorded] = []
        received = asyncio.Queue[Any]()

        def make(*args: Any, **options: Any) -> Recorded:
            connections.append(Recorded(Work(long_s), *args, **options))
            return connections[-1]

        async def handle_websocket(connection: Recorded) -> None:
            connection.admit(Budget(1_000_000), 1_000_000)
            connection.work.parts = 0
            connection.work.long_parts = 3 if connections.index(connection) == 1 else 0
            await received.put("admitted")
            await received.put(await connection.recv())

        async with serving(handle_websocket, connection_class=make) as address:
            for _ in range(3):
                async with connect(address, compression=None) as client:
                    assert await asyncio.wait_for(received.get(), 30) == "admitted"
                    await client.send(MESSAGE)
                    assert await asyncio.wait_for(received.get(), 30) == MESSAGE
        before, costly, after = connections
        assert before.work.parts < len(MESSAGE) / SMALL_PART_BYTES
        assert before.work.parts >= len(MESSAGE) / PART_BYTES
        assert costly.rests_s[:3] == pytest.approx([rest_s] * 3)
        assert after.work.parts >= len(MESSAGE) / SMALL_PART_BYTES
        assert before.rests_s == after.rests_s == []

    run(main())


@pytest.mark.parametrize("reads", [True, False])
def test_a_client_that_sends_pings_must_read_the_pongs(reads: bool) -> None:
    async def main() -> None:
        served = asyncio.Queue[PortConnection]()

        async def handle_websocket(connection: PortConnection) -> None:
            connection.admit(Budget(1_000_000), 1_000_000)
            sock = connection.transport.get_extra_info("socket")
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
            await served.put(connection)
            await connection.wait_closed()

        async with (
            serving(handle_websocket) as address,
            connect(address, compression=None, ping_interval=None) as client,
        ):
            connection = await asyncio.wait_for(served.get(), 30)
            if not reads:
                client.transport.pause_reading()
            ping = Frame(Opcode.PING, b"x" * 125).serialize(mask=True)
            for _ in range(100):
                client.transport.write(ping * 200)
                while client.transport.get_write_buffer_size() and connection.protocol.close_sent is None:
                    await asyncio.sleep(0.001)
            if reads:
                assert connection.protocol.close_sent is None
            else:
                await asyncio.wait_for(connection.wait_closed(), 30)
                assert "pings" in connection.protocol.close_sent.reason

    run(main())


@pytest.mark.parametrize("opcode", [Opcode.PING, Opcode.TEXT])
def test_frames_that_are_cheap_one_by_one_use_up_the_share_of_their_client(
    opcode: Opcode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each part takes less than `LONG_S`, so that only their sum can make the connection rest."""
    monkeypatch.setattr(loop_share, "time", SimpleNamespace(monotonic=lambda: 1000.0))

    async def main() -> None:
        clients = Discarding(0.9 * LONG_S)
        async with (
            serving(clients.handle, connection_class=clients.make) as address,
            connect(address, compression=None, ping_interval=None) as client,
        ):
            connection = await asyncio.wait_for(clients.served.get(), 30)
            frames = Frame(opcode, b"x" * 100).serialize(mask=True) * 1_500
            for _ in range(100):
                client.transport.write(frames)
                await asyncio.sleep(0.001)
                if any(connection.rests_s):
                    break
        assert 0 < max(connection.rests_s) <= MAX_REST_S

    run(main())


def test_other_clients_have_their_turn_between_many_short_parts() -> None:
    async def main() -> None:
        clients = Discarding(0.4 * LONG_S)
        async with (
            serving(clients.handle, connection_class=clients.make) as address,
            connect(address, compression=None, ping_interval=None) as client,
        ):
            connection = await asyncio.wait_for(clients.served.get(), 30)
            connection.data_received(Frame(Opcode.TEXT, b"{}").serialize(mask=True) * 10_000)
            assert (connection.work.parts, connection.rests_s) == (3, [0.0])
            await client.close()

    run(main())
