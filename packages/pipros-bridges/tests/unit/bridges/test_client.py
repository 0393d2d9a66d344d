"""Connections of bridge clients, with a transport that only records."""

from __future__ import annotations

import asyncio
from itertools import pairwise
from typing import Any
from unittest.mock import AsyncMock, MagicMock

from websockets.server import ServerProtocol

from pipros.basics.limits import Limits
from pipros_bridges.client import BridgeClient
from pipros_bridges.connection import BridgeConnection, Wakeups
from pipros_bridges.outbox import WebSocketFrame


class Transport(asyncio.Transport):
    def __init__(self) -> None:
        super().__init__()
        self.written: list[bytes] = []

    def write(self, data: Any) -> None:
        self.written.append(bytes(data))

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        pass

    def is_closing(self) -> bool:
        return False


class Listener:
    """Stands for `pipros_server.listener.Listener`, and for the accepted that it returns."""

    def accepted_socket(self, transport: object) -> Listener:
        return self

    def set_transport(self, transport: object) -> None:
        pass

    def setsockopt(self, level: int, option: int, value: int) -> None:
        pass


def test_nothing_is_written_while_the_transport_resumes_writing() -> None:
    # If such a write fails, asyncio closes the transport twice, and logs an error for the second time.
    async def resume() -> None:
        listener: Any = Listener()
        server = MagicMock(handler=AsyncMock())
        connection = BridgeConnection(listener, 1_000, ServerProtocol(), server, ping_interval=None)
        transport = Transport()
        connection.connection_made(transport)
        has_resumed = asyncio.Event()
        connection.on_writable = has_resumed.set
        connection.pause_writing()
        connection.resume_writing()
        assert not has_resumed.is_set()
        await asyncio.wait_for(has_resumed.wait(), 60)

    asyncio.run(resume())


class Writable:
    """A connection that accepts every frame, and counts them."""

    remote_address = "127.0.0.1", 1
    request = None
    is_writable = True
    paused = False

    def __init__(self) -> None:
        self.written = 0

    def write(self, frame: WebSocketFrame) -> None:
        self.written += 1


def test_other_clients_have_their_turn_between_many_small_frames() -> None:
    async def send() -> list[int]:
        connection: Any = Writable()
        shares: Any = MagicMock(queue=None)
        wakeups = Wakeups(asyncio.get_running_loop())
        client = BridgeClient(connection, 1, "rosbridge", Limits(), wakeups, shares)
        client.send(*[WebSocketFrame((b"x",))] * 10_000)  # the fragments of a response
        counts = [0]
        while connection.written < 10_000:
            await asyncio.sleep(0)
            counts.append(connection.written)
        return counts

    counts = asyncio.run(send())
    assert max(later - before for before, later in pairwise(counts)) <= 200
