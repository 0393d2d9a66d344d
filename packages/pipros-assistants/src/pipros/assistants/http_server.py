"""MCP over Streamable HTTP on a loopback port: the application of the `mcp` package under uvicorn.

Theory of operation. Like the other servers, this one limits the number of connections, and closes connections
that are not admitted within `login_s`. `GuardedApp` checks the host, origin and token of each request before
`mcp` receives it; the first valid token admits the connection. OAuth is not supported: a request without a
token is refused, without a challenge that would start a login.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import socket
import sys
from collections.abc import Callable
from typing import Any, Final

import uvicorn
from mcp.server.mcpserver import MCPServer
from uvicorn.protocols.http.h11_impl import H11Protocol

from pipros.assistants.http_sessions import PATH, App, Receive, Scope, Send, SharedSessions
from pipros.assistants.limits import AssistantLimits
from pipros.basics.limits import process_limits
from pipros.server.access import Access
from pipros.server.listener import Listener
from pipros.server.secret import Denied, Secret
from pipros.server.tls import ServerFailed
from pipros.server.token_file import read_tokens

HOST: Final = "127.0.0.1"
KEEP_ALIVE_S: Final = 30
CLOSING_S: Final = 0.2
_LOG: Final = logging.getLogger("pipros.assistants")


class _Server(uvicorn.Server):
    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close all connections. uvicorn logs nothing from here on, since cut off requests are expected."""
        logging.getLogger("uvicorn.error").disabled = True
        await super().shutdown(sockets)


class GuardedApp:
    """ASGI application that passes requests with a valid host, origin and token to another application."""

    def __init__(self, app: App, access: Access, admit: Callable[[tuple[str, int]], object]) -> None:
        """Store the arguments. `admit` is called with the address of each client that sends a valid token."""
        self._app = app
        self._access = access
        self._admit = admit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            return
        try:
            self._check(scope)
        except Denied as error:
            await _refuse(send, 403, str(error))
            return
        await self._app(scope, receive, send)

    def _check(self, scope: Scope) -> None:
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        for name in ("host", "origin", "authorization"):
            if len(headers.get(name, ())) > 1:
                raise Denied(f"This request has several {name} headers.")
        host = headers.get("host", [""])[0]
        self._access.check_host(host)
        if "origin" in headers:
            self._access.check_origin(headers["origin"][0], host)
        self._access.secret.check_authorization(headers.get("authorization", [None])[0])
        if scope.get("client"):
            self._admit(tuple(scope["client"]))


async def _refuse(send: Send, status: int, reason: str) -> None:
    body = json.dumps({"error": reason}).encode()
    headers = [(b"content-type", b"application/json"), (b"connection", b"close")]
    headers.append((b"content-length", str(len(body)).encode()))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


def serve_http(server: MCPServer[Any], port: int, token_file: str | None) -> int:
    """Serve until Ctrl-C. Print the address, and the token unless it is in a file. Return the exit code.

    Raises:
        BadTokenFile: the file cannot be read, is not private, or has no valid tokens.
        ServerFailed: the server cannot listen on the port, for example because it is in use.
    """
    secret = Secret(tokens=read_tokens(token_file) if token_file else ())
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(_serve(server, port, secret, has_file=token_file is not None))
    return 0


async def _serve(server: MCPServer[Any], port: int, secret: Secret, *, has_file: bool) -> None:
    limits = process_limits()
    own = limits.of(AssistantLimits)
    listener = Listener(limits, limit=4 * own.assistant_sessions, log=_LOG)
    try:
        listening = listener.listen([HOST], port)
    except OSError as error:
        raise ServerFailed(f"cannot listen on {HOST}:{port}: {error.strerror or error}") from None
    port = listening[0].getsockname()[1]

    class CountedProtocol(H11Protocol):
        """uvicorn's protocol for a connection that the listener has already counted."""

        def connection_made(self, transport: Any) -> None:
            listener.accepted_socket(transport).set_transport(transport)
            super().connection_made(transport)

    def admit(client: tuple[str, int]) -> None:
        for accepted in listener.accepted.values():
            if accepted.getpeername()[:2] == client:
                accepted.note_request()
                accepted.admit()
                return

    app = server.streamable_http_app(
        streamable_http_path=PATH,
        max_request_body_size=own.assistant_request_bytes,
        max_sessions=2 * own.assistant_sessions,  # `SharedSessions` needs time to end others
        session_idle_timeout=600,
        host=HOST,
    )
    config = uvicorn.Config(
        GuardedApp(SharedSessions(app, own.assistant_sessions), Access(port=port, secret=secret), admit),
        http=CountedProtocol,
        ws="none",
        loop="asyncio",
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        limit_concurrency=8 * own.assistant_sessions,
        timeout_keep_alive=KEEP_ALIVE_S,
        timeout_graceful_shutdown=CLOSING_S,  # type: ignore[arg-type] # is only waited for
    )
    print(f"Serving MCP at http://{HOST}:{port}{PATH}", file=sys.stderr)
    shown = "one of those in the token file" if has_file else secret.token
    print(
        f"Clients need the header Authorization: Bearer TOKEN. TOKEN is {shown}.", file=sys.stderr, flush=True
    )
    try:
        await _Server(config).serve(sockets=listening)
    finally:
        listener.close_all()
