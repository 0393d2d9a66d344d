"""Open TCPROS connections from either end: connect or accept, then exchange headers.

Connections use TCP, or a Unix stream between nodes on the same machine (`net/local_stream.py`).

`wire/handshake.py` determines the content of the headers. A node may serve HTTP on the same port, so that a
firewall or a container needs to open only one port for each node. The first four bytes distinguish the two.
TCPROS begins with the length of the header, and the last byte of a length below 16 MiB is zero. HTTP begins
with a method in capital letters, which, read as a length, would be 512 MiB or more.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import socket
from collections.abc import Callable, Mapping
from typing import NamedTuple

from pipros.basics.errors import ProtocolError
from pipros.basics.limits import Limits, process_limits
from pipros.basics.ports import PortRange
from pipros.net import local_stream, sockets
from pipros.net.address import LOOPBACK, plain_address
from pipros.net.connection_table import ConnectionTable
from pipros.net.refusals import Refusals
from pipros.net.timings import LINK_TIMINGS, LinkTimings, to_tick_s
from pipros.wire.handshake import HANDSHAKE_S, refuse
from pipros.wire.header import HEADER_BYTES, HeaderReader, encode_header

HANDSHAKES = 256
"""Limit: concurrent connections to a node on which neither a TCPROS header nor the beginning of an HTTP
request has arrived yet; at most a quarter of `tcpros_connections`. Beyond it, the oldest of these
connections is closed to make room for the new one; the limit, which is at most a quarter of
`tcpros_connections`, counts connections to a node that have sent neither a complete header nor the beginning
of an HTTP request.
"""
TCPROS_CONNECTIONS_PER_PEER = 0
"""Limit: the TCPROS connections that one address may open; 0 means half of the difference between
`tcpros_connections` and `handshakes`, or all of it for loopback. Beyond it, as for `tcpros_connections`, but
only connections from the same address are closed. 0 means half of the difference between
`tcpros_connections` and `handshakes`, or all of it for loopback.
"""

RETRY_ACCEPT_S = 0.1
"""Delay before the next attempt if no descriptors were left for a new connection."""

DESCRIPTORS_SHARE = 0.75
"""Share of the process's descriptors that a node's TCPROS connections can use."""

_BACKLOG = 1024
"""Maximum number of connections waiting to be accepted. If it is exceeded, clients try again after a
second.
"""

_ACCEPTED_AT_A_TIME = 4
"""Maximum number of connections accepted in one turn of the event loop. One per turn would be slow if many
clients connect at the same time.
"""

CHUNK_BYTES = 16 * 1024

_TELLING_BYTES = 4
"""Number of leading bytes that distinguish HTTP from TCPROS."""

OnHttp = Callable[[socket.socket, bytes], None]

_log = logging.getLogger("pipros.tcpros")


class TcprosConnection(NamedTuple):
    """A TCPROS connection whose peer has sent its header.

    Attributes:
        sock: non-blocking; the receiver of this object must close it.
        fields: the peer's connection header.
        rest: bytes that arrived directly after the header.
        peer: the IP address of the other side; the loopback address for a Unix stream.
    """

    sock: socket.socket
    fields: Mapping[str, str]
    rest: bytes
    peer: str = ""


class TcprosServer:
    """Accepts TCPROS connections and passes each to `on_connection` when its header has arrived.

    Connections that begin with an HTTP request are passed to `on_http`, if set.

    As in genuine nodes, connections from peers that are silent, send malformed data or announce an oversized
    header are closed without a reply. If too many connections are in their handshake, the oldest of these
    is closed to make room for a new connection, so that silent peers do not lock other peers out. The server
    uses callbacks of the event loop, not coroutines, because every service call that is not persistent opens
    a connection.

    Attributes:
        refusals: the connections that were refused, by peer.
        connections: the table to which `on_connection` adds the connections that it keeps. Every second, its
            overdue connections are closed.
    """

    def __init__(
        self,
        host: str,
        port: int | PortRange = 0,
        *,
        on_connection: Callable[[TcprosConnection], None],
        on_http: OnHttp | None = None,
        limits: Limits | None = None,
        log: logging.Logger = _log,
        timings: LinkTimings = LINK_TIMINGS,
    ) -> None:
        """Open the port. Connections are accepted only after `start`.

        Args:
            host: the address to listen on.
            port: the port; 0 selects any free port, and a range selects its first free port.
            on_connection: called in the event loop; must not block.
            on_http: called in the event loop with a connection and its first bytes.
            limits: defaults to the process-wide limits.
            log: the logger that reports refusals.
            timings: delays until a vanished peer is detected.

        Raises:
            OSError: the port is in use, no port in the range is free, or the address does not belong to this
                machine.
        """
        self._server = sockets.listen(host, port, _BACKLOG)
        self.port: int = self._server.getsockname()[1]
        self._on_connection = on_connection
        self._on_http = on_http
        self._timings = timings
        limits = limits or process_limits()
        total = limits.tcpros_connections or sockets.connections_that_fit(DESCRIPTORS_SHARE)
        self._handshakes_limit = min(HANDSHAKES, max(1, total // 4))
        links_limit = max(1, total - self._handshakes_limit)
        self.refusals = Refusals(log)
        self.connections = ConnectionTable(
            limit=links_limit,
            limit_per_peer=TCPROS_CONNECTIONS_PER_PEER or max(1, links_limit // 2),
            spares_loopback=not TCPROS_CONNECTIONS_PER_PEER,
            refusals=self.refusals,
        )
        self._local: socket.socket | None = None
        self._handshakes: dict[_Handshake, None] = {}  # oldest first
        self._overdue_timer: asyncio.TimerHandle | None = None
        self._loop: asyncio.AbstractEventLoop

    def start(self) -> None:
        """Start accepting connections. This method and `stop` must be called from the event loop."""
        self._loop = asyncio.get_running_loop()
        for server in self._servers:
            self._loop.add_reader(server, self._accept, server)
        self._close_overdue()

    def listen_locally(self, name: str) -> str | None:
        """Accept Unix streams at an abstract socket name, too, once `start` is called.

        Return the name, or None if it cannot be opened.
        """
        self._local = local_stream.listen(name)
        return name if self._local is not None else None

    @property
    def descriptors(self) -> list[int]:
        """The descriptors of the listening sockets; empty once they are closed."""
        return [number for server in self._servers if (number := server.fileno()) >= 0]

    @property
    def _servers(self) -> list[socket.socket]:
        return [self._server] if self._local is None else [self._server, self._local]

    def stop(self) -> None:
        """Close the port and every connection that is still in its handshake."""
        for server in self._servers:
            self._loop.remove_reader(server)
            server.close()
        if self._overdue_timer:
            self._overdue_timer.cancel()
        for handshake in list(self._handshakes):
            handshake.dismiss()

    def _accept(self, server: socket.socket) -> None:
        for _ in range(_ACCEPTED_AT_A_TIME):
            if not self._accept_one(server):
                return

    def _accept_one(self, server: socket.socket) -> bool:
        """Accept a connection. Return False if none is waiting, or if none can be accepted now."""
        try:
            sock, address = server.accept()
        except (BlockingIOError, InterruptedError, ConnectionAbortedError):
            return False
        except OSError:  # no descriptors are left; retry after a pause
            self._loop.remove_reader(server)
            self._loop.call_later(RETRY_ACCEPT_S, self._accept_again, server)
            return False
        on_http = self._on_http
        if server is self._local:
            if not local_stream.is_from_same_user(sock):
                sock.close()
                return True
            peer, on_http = LOOPBACK, None
        else:
            peer = plain_address(str(address[0]))
        handshake = _Handshake(sock, peer, self._timings, self._on_connection, on_http)
        if not handshake.read():  # the header has usually arrived by now
            handshake.wait(self._loop, self._forget)
            self._handshakes[handshake] = None
            if len(self._handshakes) > self._handshakes_limit:
                longest = next(iter(self._handshakes))
                self.refusals.count(longest.peer, "too many connections without a header")
                longest.dismiss()
        return True

    def _accept_again(self, server: socket.socket) -> None:
        if server.fileno() >= 0:
            self._loop.add_reader(server, self._accept, server)

    def _close_overdue(self) -> None:
        next_s = self.connections.close_overdue(self._loop.time(), idle_s=math.inf)
        self._overdue_timer = self._loop.call_later(to_tick_s(next_s), self._close_overdue)

    def _forget(self, handshake: _Handshake) -> None:
        self._handshakes.pop(handshake, None)


class _Handshake:
    """A connection whose peer has not yet sent a header, or the beginning of an HTTP request."""

    def __init__(
        self,
        sock: socket.socket,
        peer: str,
        timings: LinkTimings,
        on_connection: Callable[[TcprosConnection], None],
        on_http: OnHttp | None,
    ) -> None:
        sock.setblocking(False)
        self.peer = peer
        self._sock = sock
        self._limit_s = HANDSHAKE_S
        self._timings = timings
        self._on_connection = on_connection
        self._on_http = on_http
        self._start = b""  # received bytes, too few to determine the protocol
        self._reader = HeaderReader(HEADER_BYTES)
        self._unregister: Callable[[], None] = _nothing

    def wait(self, loop: asyncio.AbstractEventLoop, on_end: Callable[[_Handshake], None]) -> None:
        """Continue reading in the loop until a deadline; `on_end` is called when the handshake is over."""
        deadline = loop.call_later(self._limit_s, self.dismiss)
        number = self._sock.fileno()  # registering a socket object would compute its repr

        def unregister() -> None:
            deadline.cancel()
            loop.remove_reader(number)
            on_end(self)

        self._unregister = unregister
        loop.add_reader(number, self.read)

    def dismiss(self) -> None:
        """Close the connection without a reply."""
        self._unregister()
        self._sock.close()

    def read(self) -> bool:
        """Read the available bytes; return False if more are needed."""
        try:
            data = self._sock.recv(CHUNK_BYTES)
            if data and self._on_http is not None:
                data, self._start = self._start + data, b""
                if len(data) < _TELLING_BYTES:
                    self._start = data
                    return False
                if _is_http(data[:_TELLING_BYTES]):
                    self._unregister()
                    self._on_http(self._sock, data)
                    return True
                self._on_http = None
            fields = self._reader.feed(data) if data else None
            if fields is not None:
                sockets.prepare(self._sock, timings=self._timings)
        except (BlockingIOError, InterruptedError):
            return False
        except (OSError, ProtocolError):
            data, fields = b"", None
        if fields is not None:
            self._unregister()
            self._on_connection(TcprosConnection(self._sock, fields, self._reader.rest, self.peer))
        elif data:
            return False
        else:
            self.dismiss()
        return True


def _is_http(start: bytes) -> bool:
    """Return whether four bytes are the beginning of a method, such as `POST` or `GET `."""
    return start.isupper() and start.rstrip(b" ").isalpha()


def _nothing() -> None:
    pass


def refuse_connection(sock: socket.socket, reason: str) -> None:
    """Send a peer the reason for a refusal, if the socket accepts it at once, and close the socket."""
    with contextlib.suppress(OSError):
        sock.send(encode_header(refuse(reason)))
    sock.close()
