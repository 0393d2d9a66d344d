"""rosbridge over plain TCP, as a sequence of JSON objects or BSON documents, and the base class for UDP."""

from __future__ import annotations

import asyncio
import codecs
import logging
import re
import time
from collections.abc import AsyncIterator, Callable
from typing import Any, Final

from pipros.basics.limits import Limits
from pipros.basics.printable import printable
from pipros.net import sockets
from pipros.net.address import plain_address
from pipros.net.connection_table import WHOLE_REQUEST_S
from pipros.node import Node
from pipros_bridges.bridge_server import DESCRIPTORS_SHARE
from pipros_bridges.client import BRIDGE_STALL_S
from pipros_bridges.connection import Wakeups
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import ClientOutbox
from pipros_bridges.pace import ReadPace
from pipros_bridges.rosbridge.server import BridgeRuntime, ClientTopics, ServerOptions
from pipros_bridges.rosbridge.session import RosbridgeSession
from pipros_bridges.shares import ClientShares, ServerShares
from pipros_server.daemon_pool import DaemonPool
from pipros_server.listener import LOGIN_BYTES
from pipros_server.loop_share import LoopShare, LoopShares

logger = logging.getLogger("pipros_bridges")

ENTERING: Final = 16
"""Maximum number of connections waiting to become clients."""
ACCEPTING_TURNS: Final = 3
"""Iterations of the event loop that asyncio needs to accept a pending connection. If the server closed
sooner, the socket of that connection would stay open.
"""
_HTTP: Final = re.compile(rb"[A-Z]{3}[A-Z ]")
_SHOWN_BYTES: Final = 60
_LENGTH_BYTES: Final = 4
_SMALLEST_DOCUMENT: Final = 5


class StreamServer:
    """Base class of the servers for TCP and UDP: the event loop, the threads and the list of clients."""

    def __init__(self, node: Node, options: ServerOptions) -> None:
        self._options = options
        self._runtime = BridgeRuntime(node, options)
        self.bridge = self._runtime.bridge
        self._limits = self._runtime.limits
        self.shares = ServerShares(self._limits)
        fitting = sockets.connections_that_fit(DESCRIPTORS_SHARE) - ENTERING
        self._max_clients = min(self._limits.of(BridgeLimits).bridge_clients, fitting)
        self._topics = ClientTopics(node)
        self._clients: dict[Any, tuple[str, float]] = {}
        self._threads = DaemonPool("rosbridge client", self._limits.of(BridgeLimits).bridge_clients)
        self._wakeups: Wakeups
        self._loop_shares = LoopShares()

    def start(self) -> int:
        """Open the port and return its number. May be called again after an error.

        Raises:
            OSError: the port is in use, or the address does not belong to this machine.
        """
        port = self._runtime.start(self._open(), self.close)
        self._topics.report([])
        return port

    def close(self) -> None:
        """Disconnect the clients and close the port."""
        self._runtime.close(self._end)
        self._topics.close()

    async def _open(self) -> int:
        raise NotImplementedError

    async def _end(self) -> None:
        raise NotImplementedError

    def _connect(
        self, key: Any, host: str, wake: Callable[[], object], shares: ClientShares
    ) -> RosbridgeSession | None:
        """Return a session for a new client, or None if there are too many clients."""
        if len(self._clients) >= self._max_clients:
            return None
        self._clients[key] = f"{host}:0", time.time()
        self._topics.report(list(self._clients.values()))
        limit_bytes = self._limits.of(BridgeLimits).bridge_queue_bytes
        outbox = ClientOutbox(limit_bytes, lambda: self._wakeups.wake(wake), shares.queue)
        return self.bridge.connect(outbox, shares)

    def _disconnect(self, key: Any, session: RosbridgeSession) -> None:
        self._threads.start(session.close)
        del self._clients[key]
        self._topics.report(list(self._clients.values()))


class TcpServer(StreamServer):
    """A rosbridge server that accepts TCP connections, running on a node."""

    def __init__(self, node: Node, options: ServerOptions) -> None:
        super().__init__(node, options)
        self._connections: dict[asyncio.StreamWriter, asyncio.Task[None]] = {}
        # longest silent client first
        self._sessions: dict[asyncio.StreamWriter, RosbridgeSession] = {}
        self._admission_lock = asyncio.Lock()  # reserves the slot that is freed for a new client
        self._has_reported_strangers = False

    async def _open(self) -> int:
        self._wakeups = Wakeups(asyncio.get_running_loop())
        self._server = await asyncio.start_server(
            self._welcome, self._options.host, self._options.port, limit=CHUNK_BYTES, backlog=ENTERING
        )
        port: int = self._server.sockets[0].getsockname()[1]
        return port

    async def _end(self) -> None:
        for _ in range(ACCEPTING_TURNS):
            await asyncio.sleep(0)
        self._server.close()
        for writer in list(self._connections):
            writer.transport.abort()
        await asyncio.gather(*self._connections.values(), return_exceptions=True)

    def _welcome(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Start serving a client, in a task that closes the connection even if it is cancelled at once."""
        if len(self._connections) >= self._max_clients + ENTERING:
            writer.transport.abort()
            return

        def close(_: object) -> None:
            self._connections.pop(writer, None)
            writer.transport.abort()

        task = asyncio.create_task(self._serve_client(reader, writer))
        self._connections[writer] = task
        task.add_done_callback(close)

    async def _serve_client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one client until it disconnects."""
        has_data = asyncio.Event()
        shares = self.shares.client(is_reader=not self._options.settings.has_control)
        host = plain_address(str(writer.get_extra_info("peername")[0]))
        async with self._admission_lock:
            if len(self._clients) >= self._max_clients:
                await self._end_idle()
            session = self._connect(writer, host, has_data.set, shares)
        if session is None:
            return
        self._sessions[writer] = session
        sender = asyncio.create_task(self._send(session.outbox, has_data, writer))
        share = LoopShare(self._loop_shares)

        async def receive_all() -> None:
            pace = ReadPace(self._limits)
            source = TcpInput(session, reader, self._limits, shares)
            receive = self._receive_bson if self._options.settings.is_bson else self._receive_json
            async for size in receive(session, source):
                if session.ended or sender.done():
                    return
                self._sessions[writer] = self._sessions.pop(writer)
                share.note_threads(session.worked_s)
                await asyncio.sleep(pace.delay_s(size))

        try:
            await share.run(receive_all)
        except (OSError, EOFError, ValueError, asyncio.TimeoutError):
            pass
        finally:
            share.close()
            sender.cancel()
            shares.close()
            del self._sessions[writer]
            self._disconnect(writer, session)

    async def _end_idle(self) -> None:
        """Among the unused clients, disconnect the client that has been silent longest."""
        idle = (writer for writer, session in self._sessions.items() if session.is_unused)
        writer = next(idle, None)
        if writer is not None:
            task = self._connections[writer]
            task.cancel()
            await asyncio.wait([task])

    async def _receive_json(self, session: RosbridgeSession, source: TcpInput) -> AsyncIterator[int]:
        """Handle the data from the client, and yield the size of each part."""
        decoder = codecs.getincrementaldecoder("utf-8")("replace")
        has_begun = False
        while data := await source.read(session.incomplete_bytes):
            if not has_begun and (start := data.lstrip()):
                has_begun = True
                if not start.startswith(b"{"):
                    self._report_stranger(start)
                    return
            await self._threads.run(session.receive_stream, decoder.decode(data))
            yield len(data)

    async def _receive_bson(self, session: RosbridgeSession, source: TcpInput) -> AsyncIterator[int]:
        """Handle the data from the client, and yield the size of each document."""
        while head := await source.read_all(_LENGTH_BYTES):
            size = int.from_bytes(head, "little")
            if _HTTP.match(head):
                self._report_stranger(head)
                return
            if not _SMALLEST_DOCUMENT <= size <= self._limits.of(BridgeLimits).bridge_message_bytes:
                return
            rest = await source.read_all(size - _LENGTH_BYTES)
            if not rest:
                return
            await self._threads.run(session.receive, head + rest)
            del rest
            source.end_message()
            yield size

    def _report_stranger(self, start: bytes) -> None:
        """Report the first connection that does not begin with an operation, such as a web page's request.

        Any website can make its visitors' browsers send an HTTP request with rosbridge operations as the
        body. Therefore, a connection must begin with an operation.
        """
        if not self._has_reported_strangers:
            self._has_reported_strangers = True
            found = printable(start[:_SHOWN_BYTES].decode(errors="replace"))
            logger.warning("A client was disconnected: it must begin with an operation, got [%s]", found)

    async def _send(
        self, outbox: ClientOutbox, has_data: asyncio.Event, writer: asyncio.StreamWriter
    ) -> None:
        """Write the content of the outbox. Close the connection if the client does not read the data."""
        try:
            while not outbox.is_overrun:
                frames = outbox.pop()
                if frames is None:
                    await has_data.wait()
                    has_data.clear()
                    continue
                for frame in frames:
                    writer.writelines(frame.parts)
                await asyncio.wait_for(writer.drain(), BRIDGE_STALL_S)
        except (OSError, asyncio.TimeoutError):
            pass
        writer.transport.abort()


CHUNK_BYTES: Final = 64 * 1024
GROWTH_BYTES: Final = 1024 * 1024
"""An incomplete message must grow by this much, or end, within `request_s`."""
PART_BYTES: Final = 100
"""Memory of a part of a message besides its data. It is counted, because tiny parts could fill the memory."""


class TcpInput:
    """Reads from one client.

    Until the client has logged in, all its data must arrive within `login_s` and fit in `LOGIN_BYTES`.
    Afterwards, each incomplete message must keep growing.
    """

    def __init__(
        self, session: RosbridgeSession, reader: asyncio.StreamReader, limits: Limits, shares: ClientShares
    ) -> None:
        self._session = session
        self._reader = reader
        self._shares = shares
        self._loop = asyncio.get_running_loop()
        self._login_end_s = self._loop.time() + limits.login_s
        self._login_bytes = LOGIN_BYTES
        self._end_s: float | None = None  # deadline for the next MiB of an incomplete message
        self._grown_bytes = 0
        self._held_bytes = 0

    async def read(self, incomplete_bytes: int) -> bytes:
        """Return the next data; empty at the end of the stream.

        Args:
            incomplete_bytes: size of the incomplete message so far; 0 between messages.

        Raises:
            asyncio.TimeoutError: the client is too slow.
            EOFError: the client has sent too much before logging in.
        """
        return await self._read(CHUNK_BYTES, incomplete_bytes)

    async def read_all(self, count: int) -> bytes:
        """Return exactly `count` bytes, or no bytes if the stream ends earlier.

        The bytes count against the client's share of memory until `end_message`.

        Raises:
            asyncio.TimeoutError: the client is too slow.
            EOFError: the client has sent too much before logging in, or exceeds its share of memory.
        """
        parts: list[bytes] = []
        left = count
        while left:
            data = await self._read(min(left, CHUNK_BYTES), self._held_bytes)
            if not data:
                return b""
            cost = len(data) + PART_BYTES
            if not self._shares.input.take(cost):
                raise EOFError
            self._held_bytes += cost
            left -= len(data)
            parts.append(data)
        return b"".join(parts)

    def end_message(self) -> None:
        """Stop counting the data of a message that has been handled."""
        self._shares.input.give_back(self._held_bytes)
        self._held_bytes = 0

    async def _read(self, max_bytes: int, incomplete_bytes: int) -> bytes:
        is_known = self._session.is_logged_in
        if not is_known:
            max_bytes = min(max_bytes, self._login_bytes)
            if not max_bytes:
                raise EOFError
        end_s = self._deadline(incomplete_bytes) if is_known else self._login_end_s
        left_s = None if end_s is None else end_s - self._loop.time()
        data = await asyncio.wait_for(self._reader.read(max_bytes), left_s)
        if not is_known:
            self._login_bytes -= len(data)
        return data

    def _deadline(self, incomplete_bytes: int) -> float | None:
        """Return when an incomplete message must have grown; None between messages."""
        if not incomplete_bytes:
            self._end_s = None
        elif self._end_s is None or incomplete_bytes >= self._grown_bytes + GROWTH_BYTES:
            self._end_s = self._loop.time() + WHOLE_REQUEST_S
            self._grown_bytes = incomplete_bytes
        return self._end_s
