"""A proxy that forwards TCP connections to another address and injects faults."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from dataclasses import dataclass

from pipros.net.address import LOOPBACK
from pipros_tools.testing.faults.plan import Cut, Faults, FaultyStream

_READ_BYTES = 16 * 1024

_CHUNKS = 64
"""Maximum number of chunks in flight per direction; a faster sender must wait."""

_WRITE_LIMIT_BYTES = 64 * 1024
_CONNECT_LIMIT_S = 10.0

_RESET = struct.pack("ii", 1, 0)
"""`SO_LINGER` value that resets the connection on close, so that the peer gets an error."""

Address = tuple[str, int]


@dataclass(slots=True)
class ProxyCounts:
    """Counts of connections, bytes and faults so far."""

    connections: int = 0
    bytes: int = 0
    pieces: int = 0
    corrupted: int = 0
    cut: int = 0
    refused: int = 0


class Switch:
    """Shared state of a group of proxies: the faults, the counts, and whether forwarding is stalled.

    Use a switch in one event loop only. Other threads may only set `is_refusing` and read `counts`.
    """

    def __init__(self) -> None:
        self.faults = Faults()
        self.counts = ProxyCounts()
        self.is_refusing = False
        self._passes = asyncio.Event()
        self._passes.set()
        self.links: set[ProxiedLink] = set()

    def inject(self, faults: Faults) -> None:
        """Replace the faults, including those of open connections."""
        self.faults = faults
        for link in self.links:
            link.use(faults)

    def stall(self, *, stall: bool) -> None:
        """Stop or resume forwarding in both directions."""
        self._passes.clear() if stall else self._passes.set()

    async def wait(self) -> None:
        """Wait while forwarding is stalled."""
        await self._passes.wait()

    def cut(self, *, reset: bool = True) -> int:
        """Reset or close all open connections and return their number."""
        links = list(self.links)
        count = sum(link.is_open for link in links)
        for link in links:
            link.cut(reset=reset)
        return count


class TcpProxy:
    """A proxy that listens on a loopback port and forwards connections to `target`.

    Attributes:
        address: host and port; valid after `start`.
    """

    def __init__(self, name: str, target: Address, switch: Switch, *, alive: Address | None = None) -> None:
        """Store the arguments; `start` opens the port.

        Args:
            name: used to seed each connection's faults, together with the connection's number.
            alive: if given, new connections are reset unless this address accepts connections.
        """
        self.address: Address = (LOOPBACK, 0)
        self._name = name
        self._target = target
        self._alive = alive
        self._switch = switch
        self._number = 0
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        """Open a free port.

        Raises:
            OSError: no port is available.
        """
        self._server = await asyncio.start_server(self._serve, LOOPBACK, 0, limit=_READ_BYTES)
        self.address = (LOOPBACK, self._server.sockets[0].getsockname()[1])

    def stop_accepting(self) -> None:
        """Stop accepting connections. Call this before `close`, and let the event loop run once in between.

        Otherwise, in Python 3.11 and older, a connection that is being accepted would stay open.
        """
        if self._server is not None:
            for listener in self._server.sockets:
                asyncio.get_running_loop().remove_reader(listener.fileno())

    def close(self) -> None:
        """Close the port. Open connections stay open."""
        if self._server is not None:
            self._server.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._number += 1
        link = ProxiedLink(f"{self._name}/{self._number}", self._switch, writer)
        self._switch.links.add(link)
        try:
            if self._switch.is_refusing:
                self._switch.counts.refused += 1
                link.cut(counts=False)
                return
            try:
                if self._alive:
                    await _probe(self._alive)
                opening = asyncio.open_connection(*self._target, limit=_READ_BYTES)
                far_reader, far_writer = await asyncio.wait_for(opening, _CONNECT_LIMIT_S)
            except (OSError, asyncio.TimeoutError):
                link.cut(counts=False)
                return
            await link.run(reader, far_reader, far_writer)
        except asyncio.CancelledError:
            link.cut(counts=False)
        finally:
            self._switch.links.discard(link)


class ProxiedLink:
    """One connection through a proxy.

    Attributes:
        is_open: whether both sides are connected.
    """

    def __init__(self, seed: str, switch: Switch, writer: asyncio.StreamWriter) -> None:
        self._switch = switch
        self._writers = [writer]
        self._streams = [FaultyStream(f"{seed}/{way}", switch.faults) for way in ("there", "back")]
        self.is_open = False
        self._is_cut = False
        self._tasks: list[asyncio.Task[None]] = []

    def use(self, faults: Faults) -> None:
        for stream in self._streams:
            stream.use(faults)

    async def run(
        self, reader: asyncio.StreamReader, far_reader: asyncio.StreamReader, far_writer: asyncio.StreamWriter
    ) -> None:
        """Forward bytes in both directions until both streams have ended or the connection is cut."""
        near_writer = self._writers[0]
        self._writers.append(far_writer)
        if self._is_cut:  # the connection was cut while connecting to the other side
            far_writer.transport.abort()
            return
        self._switch.counts.connections += 1
        self.is_open = True
        ways = ((reader, far_writer, self._streams[0]), (far_reader, near_writer, self._streams[1]))
        self._tasks = [asyncio.ensure_future(self._pass(*way)) for way in ways]
        try:
            await asyncio.wait(self._tasks)
        finally:
            self.is_open = False
            for task in self._tasks:
                task.cancel()
            for writer in self._writers:
                writer.close()

    def cut(self, *, counts: bool = True, reset: bool = True) -> None:
        """Reset or close both ends. Bytes in flight are lost."""
        if self._is_cut:
            return
        self._is_cut = True
        self._switch.counts.cut += counts and self.is_open
        for writer in self._writers:
            if reset:
                with contextlib.suppress(OSError, AttributeError):
                    sock = writer.get_extra_info("socket")
                    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
            writer.transport.abort()
        for task in self._tasks:
            task.cancel()

    async def _pass(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, stream: FaultyStream
    ) -> None:
        """Forward bytes in one direction. Reading continues while earlier bytes are delayed."""
        writer.transport.set_write_buffer_limits(high=_WRITE_LIMIT_BYTES)
        waiting: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(_CHUNKS)
        reading = asyncio.ensure_future(self._read(reader, waiting))
        try:
            while True:
                came_at, data = await waiting.get()
                if not data:
                    break
                await self._write(writer, stream, came_at, data)
            await self._switch.wait()
            if writer.can_write_eof():
                writer.write_eof()
        except OSError:
            self.cut(counts=False)
        finally:
            reading.cancel()

    async def _read(self, reader: asyncio.StreamReader, waiting: asyncio.Queue[tuple[float, bytes]]) -> None:
        loop = asyncio.get_running_loop()
        try:
            while data := await reader.read(_READ_BYTES):
                await waiting.put((loop.time(), data))
        except OSError:
            self.cut(counts=False)  # a reset is forwarded as a reset
            return
        await waiting.put((loop.time(), b""))

    async def _write(
        self, writer: asyncio.StreamWriter, stream: FaultyStream, came_at: float, data: bytes
    ) -> None:
        counts, loop = self._switch.counts, asyncio.get_running_loop()
        for step in stream.feed(data):
            if isinstance(step, Cut):
                self.cut()
                return
            left_s = came_at + step.delay_s - loop.time()
            if left_s > 0:
                await asyncio.sleep(left_s)
            await self._switch.wait()
            writer.write(step.data)
            await writer.drain()
            counts.bytes += len(step.data)
            counts.pieces += 1
            counts.corrupted += step.corrupted
            if step.pause_s:
                await asyncio.sleep(step.pause_s)


async def _probe(address: Address) -> None:
    """Connect to the address, then close the connection.

    Raises:
        OSError: no process listens at the address.
    """
    _, writer = await asyncio.wait_for(asyncio.open_connection(*address), _CONNECT_LIMIT_S)
    writer.close()
