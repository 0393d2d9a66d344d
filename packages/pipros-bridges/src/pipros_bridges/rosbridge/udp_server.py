"""rosbridge over UDP, for clients on this machine only. A datagram is a part of a stream of JSON objects.

In BSON mode, a datagram is one document. UDP has no connections: each sender address counts as a client after
its first whole operation. If there are too many clients, a new client replaces the unused client that has
been silent longest (see `RosbridgeSession.is_unused`). A receive buffer of 4 MB, or what
the system allows, keeps the datagrams of the others during a short flood.
"""

from __future__ import annotations

import asyncio
import ipaddress
import socket
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros_bridges.connection import Wakeups
from pipros_bridges.pace import ReadPace
from pipros_bridges.rosbridge.server import ServerOptions
from pipros_bridges.rosbridge.session import RosbridgeSession
from pipros_bridges.rosbridge.stream_servers import StreamServer
from pipros_bridges.rosbridge.text_input import JsonObjects
from pipros_bridges.shares import ClientShares
from pipros_server.listener import LOGIN_BYTES
from pipros_server.loop_share import LoopShare

SILENT_S: Final = 600.0
"""Time after which a silent client is removed, because UDP does not signal the end of a connection."""
WAITING_DATAGRAMS: Final = 100
"""Maximum number of queued datagrams of a client."""
RECEIVE_BUFFER_BYTES: Final = 4_000_000
LARGEST_DATAGRAM: Final = 65_507
STRANGERS: Final = 16
"""Maximum number of addresses whose first operation is incomplete."""
_DATAGRAM_BYTES: Final = 200
"""Memory of a queued datagram besides its data."""


class NotLoopback(PiprosError):
    """UDP was requested on a network address, where a datagram's sender can be forged."""


class UdpServer(StreamServer):
    """A rosbridge server over UDP, running on a node."""

    def __init__(self, node: Node, options: ServerOptions) -> None:
        """Raise `NotLoopback` if the address is not a loopback address."""
        if options.host != "localhost" and not _is_loopback(options.host):
            raise NotLoopback(f"UDP serves only this machine: use a loopback address, not {options.host}")
        super().__init__(node, options)
        self._known: dict[Any, _UdpClient] = {}  # the client that has been silent longest is first
        self._strangers: dict[Any, _Stranger] = {}  # oldest first

    async def _open(self) -> int:
        loop = asyncio.get_running_loop()
        self._wakeups = Wakeups(loop)
        address = self._options.host, self._options.port
        self._transport, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(self), address)
        with suppress(OSError):  # some systems refuse more than they allow, others give less
            found = self._transport.get_extra_info("socket")
            found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        port: int = self._transport.get_extra_info("sockname")[1]
        return port

    async def _end(self) -> None:
        self._transport.close()
        for address in list(self._known):
            self._remove(address)

    def take(self, data: bytes, address: Any) -> None:
        """Handle a datagram. Called in the event loop."""
        if not data:  # it would take memory without counting in any limit
            return
        client = self._known.pop(address, None)
        if client is not None:
            self._known[address] = client
            client.put(data)
            return
        datagrams = self._first_operation(data, address)
        if datagrams and (client := self._new_client(address)) is not None:
            for each in datagrams:
                client.put(each)

    def _first_operation(self, data: bytes, address: Any) -> Sequence[bytes]:
        """Return an address's datagrams once they contain a whole operation; until then, return nothing."""
        if self._options.settings.is_bson:
            return [data] if int.from_bytes(data[:4], "little") == len(data) else []
        stranger = self._strangers.pop(address, None) or _Stranger()
        if stranger.completes(data):
            return stranger.datagrams
        if stranger.is_plausible:
            self._strangers[address] = stranger
            while len(self._strangers) > STRANGERS:
                del self._strangers[next(iter(self._strangers))]
        return []

    def _new_client(self, address: Any) -> _UdpClient | None:
        if len(self._clients) >= self._max_clients:
            unused = (each for each, client in self._known.items() if client.session.is_unused)
            self._remove(next(unused, None))
        shares = self.shares.client(is_reader=not self._options.settings.has_control)
        session = self._connect(address, str(address[0]), lambda: self._flush(address), shares)
        if session is None:
            return None
        client = self._known[address] = _UdpClient(session, shares, LoopShare(self._loop_shares))
        client.task = asyncio.create_task(client.share.run(self._serve_client, client, address))
        return client

    def _remove(self, address: Any) -> None:
        """End a client's session. Do nothing if the client is unknown."""
        client = self._known.pop(address, None)
        if client is not None:
            client.shares.close()
            client.share.close()
            client.task.cancel()
            self._disconnect(address, client.session)

    async def _serve_client(self, client: _UdpClient, address: Any) -> None:
        pace = ReadPace(self._limits)
        session = client.session
        try:
            while not session.ended:
                data = await asyncio.wait_for(client.datagrams.get(), SILENT_S)
                if self._options.settings.is_bson:
                    await self._threads.run(session.receive, data)
                else:
                    await self._threads.run(session.receive_stream, data.decode(errors="replace"))
                client.note_handled(data)
                client.share.note_threads(session.worked_s)
                await asyncio.sleep(pace.delay_s(len(data)))
        except asyncio.TimeoutError:
            pass
        finally:
            if self._known.get(address) is client:
                self._remove(address)

    def _flush(self, address: Any) -> None:
        client = self._known.get(address)
        while client is not None and (frames := client.session.outbox.pop()) is not None:
            for frame in frames:
                if frame.size <= LARGEST_DATAGRAM:
                    self._transport.sendto(b"".join(frame.parts), address)
                else:
                    client.report_large(frame.size)


class _Stranger:
    """The datagrams of an address before its first whole operation."""

    def __init__(self) -> None:
        self.datagrams: list[bytes] = []
        self.is_plausible = True
        self._objects = JsonObjects(LOGIN_BYTES)

    def completes(self, data: bytes) -> bool:
        """Add a datagram. Return whether there is a whole JSON object now."""
        self.datagrams.append(data)
        # only the first object, because the client's task reads all of them
        found = next(self._objects.feed(data.decode(errors="replace")), None)
        self.is_plausible = found is None and not self._objects.is_empty
        return isinstance(found, str)


class _UdpClient:
    """A client and the datagrams that it has sent."""

    task: asyncio.Task[None]

    def __init__(self, session: RosbridgeSession, shares: ClientShares, share: LoopShare) -> None:
        self.session = session
        self.shares = shares
        self.share = share
        self.datagrams: asyncio.Queue[bytes] = asyncio.Queue(WAITING_DATAGRAMS)
        self._has_reported = False

    def put(self, data: bytes) -> None:
        """Queue a datagram, or drop it if too many are queued or the client's memory is used up."""
        if self.shares.input.take(len(data) + _DATAGRAM_BYTES):
            try:
                self.datagrams.put_nowait(data)
            except asyncio.QueueFull:
                self.note_handled(data)

    def report_large(self, size: int) -> None:
        """Report the first message that does not fit into a datagram; all of them are dropped."""
        if not self._has_reported:
            self._has_reported = True
            self.session.report(
                f"a message of {size} bytes is dropped, because a datagram holds at most {LARGEST_DATAGRAM}: "
                "subscribe with a fragment_size, or use TCP or a WebSocket. Further ones are not reported"
            )

    def note_handled(self, data: bytes) -> None:
        """Stop counting a datagram."""
        self.shares.input.give_back(len(data) + _DATAGRAM_BYTES)


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, server: UdpServer) -> None:
        self._server = server

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._server.take(data, addr)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
