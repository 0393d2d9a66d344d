"""Accept connections from browsers, and limit connections that have not been authenticated yet.

Theory of operation. Like a node's servers, the listening socket counts each connection in a `ConnectionTable`
when it is accepted, before the TLS handshake. A connection is closed if its first request does not arrive
within `login_s`. If there are too many connections, a new connection replaces the connection that has been
silent longest among those for which `AcceptedSocket.admit` has not been called.
"""

from __future__ import annotations

import asyncio
import logging
import math
import socket
from collections.abc import Sequence
from typing import Any, Final

from pipros.basics.limits import Limits
from pipros.net import sockets
from pipros.net.address import plain_address
from pipros.net.connection_table import ConnectionTable
from pipros.net.refusals import Refusals

LOGIN_BYTES = 64 * 1024
"""Limit: the bytes that a client of a web page or bridge may send before it has logged in. Beyond it, the
connection to the page is closed.
"""

SHARE: Final = 1 / 8
"""Share of the process's file descriptors that connections may use. The page's node needs the rest."""

ACCEPTED_AT_A_TIME: Final = 4
_BACKLOG: Final = 128


class AcceptedSocket(socket.socket):
    """An accepted connection. Its server may note to which client it belongs, in `owner`."""

    peer = owner = ""
    address: tuple[Any, ...] = ()
    last_used = 0.0
    _listener: Listener | None = None
    _transport: asyncio.BaseTransport | None = None
    _deadline: asyncio.TimerHandle | None = None

    def register(self, listener: Listener, peer: str, limit_s: float) -> bool:
        """Take a slot in the table. Return False if the table is full.

        The first request must arrive within `limit_s`.
        """
        self.peer = peer
        loop = asyncio.get_running_loop()
        self.last_used = loop.time()
        if not listener.table.add(self):
            return False
        self._listener = listener
        self._deadline = loop.call_later(limit_s, self.abort)
        listener.accepted[self.fileno()] = self
        return True

    def set_transport(self, transport: asyncio.BaseTransport) -> None:
        """Set the transport that currently serves this connection."""
        self._transport = transport

    def note_request(self) -> None:
        """Cancel the deadline for the first request. The protocol sets its own deadlines."""
        self._cancel_deadline()
        if self._listener is not None:
            self._listener.table.mark_used(self)

    def admit(self) -> None:
        """Protect the connection from being closed to make room for others: its client has authenticated."""
        if self._listener is not None:
            self._listener.table.mark_busy(self)

    def abort(self) -> None:
        """Close immediately, discarding unsent data."""
        if isinstance(self._transport, asyncio.WriteTransport):
            self._transport.abort()
        else:  # the TLS handshake is not complete
            sockets.abort(self)

    def close(self) -> None:
        self._cancel_deadline()
        if self._listener is not None:
            self._listener.accepted.pop(self.fileno(), None)
            self._listener.table.remove(self)
            self._listener = None
        super().close()

    def _cancel_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


class Listener:
    """Listening sockets and their accepted connections. For use in one event loop.

    Attributes:
        limit: maximum number of connections.
        table: all connections. Connections that have not been authenticated count as idle: the table may
            close them to make room for new ones.
        accepted: connections by file descriptor.
    """

    def __init__(self, limits: Limits, *, limit: int, log: logging.Logger, share: float = SHARE) -> None:
        """Create a listener for at most `limit` connections, or fewer if `share` requires it.

        Args:
            share: share of the process's file descriptors that the connections may use.
        """
        self.limit = min(limit, sockets.connections_that_fit(share))
        self.accepted: dict[int, AcceptedSocket] = {}
        self.table = ConnectionTable(
            limit=self.limit, limit_per_peer=self.limit // 2, refusals=Refusals(log), spares_loopback=True
        )
        self._limit_s = limits.login_s

    def listen(self, hosts: Sequence[str], port: int) -> list[socket.socket]:
        """Return sockets that listen on these addresses, with the same port.

        Raises:
            OSError: the port is in use, or an address does not belong to this machine.
        """
        return [_ListeningSocket(self, opened) for opened in sockets.listen_all(hosts, port)]

    def start(self, listening: Sequence[socket.socket]) -> None:
        """Enlarge the backlog for bursts of connections. Call this after asyncio has set its own value."""
        for each in listening:
            each.listen(_BACKLOG)

    def accepted_socket(self, transport: asyncio.BaseTransport) -> AcceptedSocket:
        """Return the connection that a transport serves."""
        return self.accepted[transport.get_extra_info("socket").fileno()]

    def register(self, accepted: AcceptedSocket, address: Any) -> bool:
        """Count a new connection. Return False if there is no room for it."""
        accepted.address = address
        return accepted.register(self, plain_address(str(address[0])), self._limit_s)

    def close_unadmitted(self) -> None:
        """Close the connections that have not been admitted."""
        self.table.close_overdue(math.inf, 0.0)

    def close_all(self) -> None:
        """Close all connections immediately, discarding unsent data."""
        self.table.close_all()


class _ListeningSocket(socket.socket):
    """Listening socket that counts the connections it accepts."""

    def __init__(self, listener: Listener, listening: socket.socket) -> None:
        super().__init__(fileno=listening.detach())
        self.setblocking(False)
        self._listener = listener

    def accept(self) -> tuple[socket.socket, Any]:
        sock, address = super().accept()
        accepted = AcceptedSocket(fileno=sock.detach())
        if not self._listener.register(accepted, address):
            accepted.close()
            raise BlockingIOError("too many connections")  # tells asyncio that no connection is pending
        return accepted, address
