"""rosbridge over plain TCP, as a sequence of JSON objects or BSON documents, and the base class for UDP."""

from __future__ import annotations

import asyncio
import codecs
import logging
import re
import time
from collections.abc import AsyncIterator, Callable
from typing import Any, Final

from pipros.basics.printable import printable
from pipros.bridges.bridge_server import DESCRIPTORS_SHARE
from pipros.bridges.connection import Wakeups
from pipros.bridges.limits import BridgeLimits
from pipros.bridges.outbox import ClientOutbox
from pipros.bridges.pace import ReadPace
from pipros.bridges.rosbridge.server import BridgeRuntime, ClientTopics, ServerOptions
from pipros.bridges.rosbridge.session import RosbridgeSession
from pipros.bridges.rosbridge.tcp_input import CHUNK_BYTES, TcpInput
from pipros.bridges.shares import ClientShares, ServerShares
from pipros.net import sockets
from pipros.net.address import plain_address
from pipros.node import Node
from pipros.server.daemon_pool import DaemonPool

logger = logging.getLogger("pipros.bridges")

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
        pace = ReadPace(self._limits, work=self.shares.work)
        source = TcpInput(session, reader, self._limits, shares)
        receive = self._receive_bson if self._options.settings.is_bson else self._receive_json
        try:
            async for size in receive(session, source):
                if session.ended or sender.done():
                    break
                self._sessions[writer] = self._sessions.pop(writer)
                await asyncio.sleep(pace.delay_s(size, session.worked_s))
        except (OSError, EOFError, ValueError, asyncio.TimeoutError):
            pass
        finally:
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
                await asyncio.wait_for(writer.drain(), self._limits.of(BridgeLimits).bridge_stall_s)
        except (OSError, asyncio.TimeoutError):
            pass
        writer.transport.abort()
