"""A port for HTTP requests and WebSockets, with limits on clients that have not authenticated yet."""

from __future__ import annotations

import asyncio
import logging
import math
import socket
import ssl
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, Final

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.http11 import Request, Response

from pipros.basics.limits import Limits
from pipros.web.entrance import ACCEPTED_AT_A_TIME, Entrance, Visitor

CLOSING_S: Final = 0.2
"""Time (s) for clients to acknowledge the closing of connections, and again for the server's tasks to end."""

UNSENT_BYTES: Final = 131_072
"""Maximum number of unsent bytes in the kernel. With more, a browser on a slow link would get old views."""

# At level DEBUG, websockets logs messages and paths, including tokens.
_SILENT: Final = logging.Logger("websockets of pipros", logging.CRITICAL)


class PortConnection(ServerConnection):
    """Connection whose client can send only a few bytes before it is admitted."""

    def __init__(self, entrance: Entrance, limit_bytes: int, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._entrance = entrance
        self._bytes_left: float = limit_bytes
        self._visitor: Visitor

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._visitor = self._entrance.visitor_of(transport)
        self._visitor.set_transport(transport)
        option = getattr(socket, "TCP_NOTSENT_LOWAT", None)  # not available on Windows
        if option is not None:
            self._visitor.setsockopt(socket.IPPROTO_TCP, option, UNSENT_BYTES)
        super().connection_made(transport)

    def data_received(self, data: bytes) -> None:
        self._bytes_left -= len(data)
        if self._bytes_left < 0:
            self._visitor.abort()
        else:
            super().data_received(data)

    def note_request(self) -> None:
        """Cancel the deadline, because the request has arrived."""
        self._visitor.note_request()

    def admit(self) -> None:
        """Lift the limits on unauthenticated clients, because this client has authenticated."""
        self._visitor.admit()
        self._bytes_left = math.inf


class ServerPort:
    """Listens on one port from `open` until `close`. For use in one event loop.

    Attributes:
        limit: maximum number of connections.
    """

    def __init__(self, entrance: Entrance, limits: Limits) -> None:
        self.limit = entrance.limit
        self._entrance = entrance
        self._limits = limits
        self._servers: list[Server] = []

    async def open(
        self,
        host: str,
        port: int,
        *,
        attend: Callable[[Any], Awaitable[None]],
        answer: Callable[[Any, Request], Response | None],
        max_bytes: int,
        tls: ssl.SSLContext | None = None,
        connection_class: type[PortConnection] = PortConnection,
        **options: Any,
    ) -> int:
        """Open the port and return its number.

        Args:
            host: address to listen on.
            port: port to listen on; 0 selects a free one.
            attend: serves a WebSocket until it is closed.
            answer: returns the response to a request, or None to continue with the WebSocket handshake.
            max_bytes: maximum size of a message from an admitted client.
            options: additional keyword arguments for `websockets.asyncio.server.serve`.

        Raises:
            OSError: the port is in use, or the address does not belong to this machine.
        """
        found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM)
        listeners = self._entrance.listen([str(each[4][0]) for each in found], port)
        create_connection: Any = partial(connection_class, self._entrance, self._limits.login_bytes)
        if tls is not None:
            options |= {"ssl": tls, "ssl_handshake_timeout": self._limits.login_s}
        for listener in listeners:
            self._servers.append(
                await serve(
                    attend,
                    sock=listener,
                    create_connection=create_connection,
                    process_request=answer,
                    max_size=max_bytes,
                    write_limit=65536,
                    server_header=None,
                    compression=None,  # on loopback, compression costs more than it saves
                    logger=_SILENT,
                    close_timeout=1,
                    backlog=ACCEPTED_AT_A_TIME,
                    **options,
                )
            )
        self._entrance.start(listeners)
        number: int = listeners[0].getsockname()[1]
        return number

    async def close(self) -> None:
        """Close the port and all connections. Wait at most `CLOSING_S` for clients to acknowledge this."""
        for server in self._servers:
            server.close()
        self._entrance.close_strangers()
        if not await self._have_closed():
            self._entrance.close_all()
            await self._have_closed()

    async def _have_closed(self) -> bool:
        """Wait up to `CLOSING_S` for all connections to close. Return False if some are still open."""
        ends = [asyncio.ensure_future(server.wait_closed()) for server in self._servers]
        return not ends or not (await asyncio.wait(ends, timeout=CLOSING_S))[1]
