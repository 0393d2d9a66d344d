"""Server for all bridges and the page on one port. It passes each admitted client to its protocol's handler.

A client chooses its protocol with the WebSocket subprotocol; the handler "" serves clients without one. The
token, if one is required, is in the header `Authorization: Bearer`, in the URL (the last segment of the path,
or the parameter `token`), or in the first message: `{"token": "…"}`, or a login in the handler's protocol.
Paths, tokens and first messages are never logged.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import logging
import ssl
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from http import HTTPStatus
from typing import Final

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed, NegotiationError
from websockets.frames import CloseCode
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from pipros.basics.limits import Limits, limit_text, process_limits
from pipros.net.tcpros import HANDSHAKES
from pipros_bridges.admission import Admission
from pipros_bridges.client import BridgeClient
from pipros_bridges.connection import BridgeConnection, Wakeups
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.pace import ReadPace
from pipros_bridges.sessions import ClientRow, Handler, Session, dispensable_client, row_of
from pipros_bridges.shares import ServerShares
from pipros_server.access import LOOPBACK_HOSTS, Access
from pipros_server.freed_memory import FreedMemory
from pipros_server.listener import Listener
from pipros_server.port import ServerPort
from pipros_server.responses import only_header, plain_response
from pipros_server.secret import Denied, Secret
from pipros_server.view_server import SOCKET_PATH, PageServer

logger = logging.getLogger("pipros_bridges")

CLIENTS_PATH: Final = "/clients"
DESCRIPTORS_SHARE: Final = 1 / 2
PING_S: Final = 20.0
"""Interval between pings to each client."""
PONG_S: Final = 60.0
"""Maximum time to wait for a pong. A slow client receives the ping only after all data queued before it."""


class BridgeServer:
    """Serves clients until it is closed. For use in one event loop.

    Attributes:
        port: the open port, after `open`.
        shares: the memory and other resources that all clients may use together.
    """

    def __init__(
        self,
        handlers: Mapping[str, Handler],
        admission: Admission,
        page: PageServer | None = None,
        limits: Limits | None = None,
        *,
        has_control: bool = True,
    ) -> None:
        """Create a server.

        Args:
            handlers: handlers by subprotocol, in order of preference; "" for clients without a subprotocol.
            page: server of the page on the same port.
            has_control: whether clients may change the system. If False, the limits for their messages are
                lower.
        """
        self.port = 0
        self._handlers = handlers
        self._admission = admission
        self._page = page
        self._limits = limits or process_limits()
        self.shares = ServerShares(self._limits)
        self._has_control = has_control
        listener = Listener(
            self._limits,
            limit=self._limits.of(BridgeLimits).bridge_clients + HANDSHAKES,
            log=logger,
            share=DESCRIPTORS_SHARE,
        )
        self._server_port = ServerPort(listener, self._limits)
        self._clients: dict[BridgeClient, tuple[Session, float]] = {}
        self._numbers = itertools.count(1)
        self._has_reported_origin = False
        self._wakeups: Wakeups
        self._freed_memory: FreedMemory
        self._access: Access

    async def open(
        self,
        host: str,
        port: int,
        *,
        names: Sequence[str] = (),
        tls: ssl.SSLContext | None = None,
        ping_s: float | None = PING_S,
        pong_s: float | None = PONG_S,
    ) -> None:
        """Open the port.

        Args:
            host: address to listen on.
            port: port to listen on; 0 selects a free one.
            names: host names under which the page and the client list are served, besides the loopback
                names. If any are given, all IP addresses are allowed, too.
            ping_s: interval between pings; None disables them.
            pong_s: maximum time to wait for a pong; None waits forever.

        Raises:
            OSError: the port is in use, or the address does not belong to this machine.
        """
        self._wakeups = Wakeups(asyncio.get_running_loop())
        self._freed_memory = FreedMemory()
        self.port = await self._server_port.open(
            host,
            port,
            handle_websocket=self._handle_websocket,
            respond=self._respond,
            max_bytes=self._limits.of(BridgeLimits).bridge_message_bytes,
            tls=tls,
            connection_class=BridgeConnection,
            select_subprotocol=self._select,
            ping_interval=ping_s,
            ping_timeout=pong_s,
        )
        secret = self._admission.secret or (self._page.access.secret if self._page is not None else Secret())
        self._access = Access(
            self.port,
            frozenset({*LOOPBACK_HOSTS, *names}),
            is_secure=tls is not None,
            takes_addresses=bool(names),
            secret=secret,
        )
        if self._page is not None:
            self._page.access = self._access

    async def close(self) -> None:
        """Close the port and all connections; see `ServerPort.close`."""
        await self._server_port.close()

    def clients(self) -> list[ClientRow]:
        """Return an entry for each client, sorted by the time of connection."""
        return [row_of(client, session, since) for client, (session, since) in self._clients.items()]

    def _respond(self, connection: BridgeConnection, request: Request) -> Response | None:
        """Return the HTTP response to a request, or None to continue with the WebSocket handshake."""
        is_upgrade = (request.headers.get("Upgrade") or "").lower() == "websocket"
        path = request.path.partition("?")[0]
        if self._page is not None and path != CLIENTS_PATH and (not is_upgrade or path == SOCKET_PATH):
            connection.is_page = True
            return self._page.respond(connection, request)
        connection.note_request()
        try:
            if not is_upgrade:
                return self._respond_http(path, request)
            self._admission.check_origin(_origin(request))
        except Denied as error:
            if is_upgrade and not self._has_reported_origin:  # a browser does not show the response
                self._has_reported_origin = True
                logger.warning("A page was refused: %s", error)
            return plain_response(HTTPStatus.FORBIDDEN, str(error))
        connection.is_known = self._admission.has_token(
            request.path, only_header(request.headers, "Authorization")
        )
        if connection.is_known:
            self._enter(connection)
        return None

    def _enter(self, connection: BridgeConnection) -> None:
        connection.enter(self.shares.client(is_reader=not self._has_control))

    def _respond_http(self, path: str, request: Request) -> Response:
        if path != CLIENTS_PATH:
            offered = ", ".join(filter(None, self._handlers)) or "none"
            return plain_response(
                HTTPStatus.UPGRADE_REQUIRED, f"This port is for WebSockets; subprotocols: {offered}."
            )
        self._access.check_host(only_header(request.headers, "Host"))
        if self._admission.secret is not None or self._page is not None:
            self._access.secret.check_authorization(only_header(request.headers, "Authorization"))
        rows = [asdict(row) for row in self.clients()]
        return plain_response(HTTPStatus.OK, json.dumps(rows, indent=1), "application/json")

    def _select(self, connection: ServerConnection, offered: Sequence[Subprotocol]) -> Subprotocol | None:
        if isinstance(connection, BridgeConnection) and connection.is_page:
            return None
        for name in self._handlers:
            if name and name in offered:
                return Subprotocol(name)
        if "" in self._handlers and not offered:
            return None
        raise NegotiationError(f"supported subprotocols: {', '.join(filter(None, self._handlers))}")

    async def _handle_websocket(self, connection: BridgeConnection) -> None:
        """Serve one client until it disconnects.

        If a client that may change the system leaves, its remaining messages are still handled.
        """
        if connection.is_page and self._page is not None:
            await self._page.handle_websocket(connection)
            return
        name = connection.subprotocol or ""
        handler = self._handlers[name]
        if not connection.is_known and not await self._logs_in(connection, handler):
            return
        if len(self._clients) >= self._limits.of(BridgeLimits).bridge_clients and not await self._end_idle(
            connection
        ):
            too_many = limit_text("bridge_clients", self._limits.of(BridgeLimits).bridge_clients)
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"too many clients; {too_many}")
            return
        if connection.shares is None:  # the connection was closed while it was being admitted
            return
        client = BridgeClient(
            *(connection, next(self._numbers), name or "rosbridge", self._limits, self._wakeups),
            connection.shares,
        )
        session = handler.open(client)
        self._clients[client] = session, time.time()
        try:
            await connection.share.run(self._receive_all, connection, client, session)
        except ConnectionClosed:
            pass
        except Exception:
            logger.exception("unexpected error while serving a client of %s", client.protocol)
            client.end("internal error", CloseCode.INTERNAL_ERROR)
        finally:
            del self._clients[client]
            session.close()
            client.close()
            received, sent, held_bytes = client.received, client.outbox.total, int(client.shares.memory.peak)
            self._freed_memory.note_left(
                received.bytes + sent.bytes + held_bytes, received.messages + sent.messages
            )

    async def _receive_all(
        self, connection: BridgeConnection, client: BridgeClient, session: Session
    ) -> None:
        """Handle a client's messages until it disconnects."""
        pace = ReadPace(self._limits)
        async for data in connection:
            if client.has_left:
                if not self._has_control:
                    return
                client.outbox.close()
            client.active_s = time.monotonic()
            client.received.messages += 1
            client.received.bytes += len(data)
            await session.receive(data)
            connection.share.note_threads(session.worked_s)
            if delay_s := pace.delay_s(len(data)):
                await asyncio.sleep(delay_s)
            await connection.share.end_long_step()

    async def _end_idle(self, newcomer: BridgeConnection) -> bool:
        """Disconnect a client to make room for a new client. Return whether there is room now."""
        sessions = {client: session for client, (session, _) in self._clients.items()}
        dispensable = dispensable_client(sessions, newcomer.remote_address[0])
        if dispensable is None:
            return False
        await dispensable.replace()
        return len(self._clients) < self._limits.of(BridgeLimits).bridge_clients

    async def _logs_in(self, connection: BridgeConnection, handler: Handler) -> bool:
        """Wait for the first message.

        Return whether the message authenticates the client. If not, close the connection.
        """
        try:
            first = await asyncio.wait_for(connection.recv(), self._limits.login_s)
            if not handler.is_login(first) and self._admission.secret is not None:
                self._admission.secret.check_first_message(first)
        except asyncio.TimeoutError:
            await connection.close(
                CloseCode.POLICY_VIOLATION, "The token must be in the URL or first message."
            )
            return False
        except Denied:
            await connection.close(CloseCode.POLICY_VIOLATION, "The token is missing or wrong.")
            return False
        except ConnectionClosed:
            return False
        self._enter(connection)
        return True


def _origin(request: Request) -> str | None:
    """Return a request's origin: None without an `Origin` header, an invalid origin if there are several."""
    values = request.headers.get_all("Origin")
    return None if not values else ", ".join(values)
