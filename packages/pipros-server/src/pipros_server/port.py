"""A port for HTTP requests and WebSockets, with limits on the data that it holds for each client."""

from __future__ import annotations

import asyncio
import logging
import socket
import ssl
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, Final

from websockets.asyncio.server import Server, serve
from websockets.http11 import Request, Response

from pipros.basics.limits import Limits
from pipros.net import sockets
from pipros.net.connection_table import WHOLE_REQUEST_S
from pipros_server.listener import ACCEPTED_AT_A_TIME, LOGIN_BYTES, Listener
from pipros_server.loop_share import LoopShares
from pipros_server.port_connection import CLOSING_S, WRITE_BYTES, PartSize, PortConnection

# At level DEBUG, websockets logs messages and paths, including tokens.
_SILENT: Final = logging.Logger("websockets of pipros", logging.CRITICAL)


class ServerPort:
    """Listens on one port from `open` until `close`. For use in one event loop.

    Attributes:
        limit: maximum number of connections.
    """

    def __init__(self, listener: Listener, limits: Limits) -> None:
        self.limit = listener.limit
        self._listener = listener
        self._limits = limits
        self._servers: list[Server] = []

    async def open(
        self,
        host: str,
        port: int,
        *,
        handle_websocket: Callable[[Any], Awaitable[None]],
        respond: Callable[[Any, Request], Response | None],
        max_bytes: int,
        tls: ssl.SSLContext | None = None,
        connection_class: type[PortConnection] = PortConnection,
        **options: Any,
    ) -> int:
        """Open the port and return its number.

        Args:
            host: address to listen on. For 127.0.0.1, 0.0.0.0 and ::1, the port is also opened at the other
                loopback address, if this machine has it: users open `localhost`, and browsers prefer ::1.
                Another user could otherwise listen there, and receive the token.
            port: port to listen on; 0 selects a free one.
            handle_websocket: serves a WebSocket until it is closed.
            respond: returns the response to a request, or None to continue with the WebSocket handshake.
            max_bytes: maximum size of a message from an admitted client.
            options: additional keyword arguments for `websockets.asyncio.server.serve`.

        Raises:
            OSError: the port is in use, or the address does not belong to this machine.
        """
        found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM)
        hosts = sockets.with_other_loopback([str(each[4][0]) for each in found])
        listening = self._listener.listen(hosts, port)
        create_connection: Any = partial(
            connection_class,
            self._listener,
            LOGIN_BYTES,
            part_size=PartSize(),
            shares=LoopShares(),
            request_s=WHOLE_REQUEST_S,
        )
        if tls is not None:
            options |= {"ssl": tls, "ssl_handshake_timeout": self._limits.login_s}
        for each in listening:
            self._servers.append(
                await serve(
                    handle_websocket,
                    sock=each,
                    create_connection=create_connection,
                    process_request=respond,
                    max_size=max_bytes,
                    max_queue=None,  # each connection limits the bytes that it holds instead
                    write_limit=WRITE_BYTES,
                    server_header=None,
                    compression=None,  # on loopback, compression costs more than it saves
                    logger=_SILENT,
                    close_timeout=1,
                    backlog=ACCEPTED_AT_A_TIME,
                    **options,
                )
            )
        self._listener.start(listening)
        number: int = listening[0].getsockname()[1]
        return number

    async def close(self) -> None:
        """Close the port and all connections. Wait at most `CLOSING_S` for clients to acknowledge this."""
        for server in self._servers:
            server.close()
        self._listener.close_unadmitted()
        if not await self._have_closed():
            self._listener.close_all()
            await self._have_closed()

    async def _have_closed(self) -> bool:
        """Wait up to `CLOSING_S` for all connections to close. Return False if some are still open."""
        ends = [asyncio.ensure_future(server.wait_closed()) for server in self._servers]
        return not ends or not (await asyncio.wait(ends, timeout=CLOSING_S))[1]
