"""MCP over Streamable HTTP on a loopback port: the application of the `mcp` package under uvicorn.

Theory of operation. Like the other servers, this one limits the number of connections, and closes connections
that are not admitted within `login_s`. `GuardedApp` checks the host, origin and token of each request before
`mcp` receives it; the first valid token admits the connection, which then is not closed to make room, unless
its client, that is, the token, already has half of what the others leave. Clients also share the event loop.
OAuth is not supported: a request without a token is refused, without a challenge that would start a login.

Sessions. A session holds its place until its client deletes it, or until it has been idle for a long time, so
a client that restarts without deleting its sessions would fill all places. When all are taken, the client
(that is, the token) with the most sessions loses one that serves no request now: one that was only opened or,
if there is none, the one that has been idle longest. Its client gets 404, and opens a new session. A client
takes no session from one that has not more than itself, nor more than half of the places that others leave.

`mcp` gets whole requests, because it logs a traceback for a client that ends within one. Of requests
of a session with the same id, it gets one at a time: it finds responses by id, and would answer only one.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import socket
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Coroutine, Iterable, MutableMapping
from dataclasses import dataclass, field
from typing import Any, Final

import uvicorn
from mcp.server.mcpserver import MCPServer
from mcp.server.transport_security import RequestBodyLimitMiddleware
from pydantic_core import from_json
from uvicorn.protocols.http.h11_impl import H11Protocol

from pipros.basics.limits import process_limits
from pipros_assistants.stdio_transport import ASSISTANT_REQUEST_BYTES
from pipros_server.access import Access
from pipros_server.listener import Listener
from pipros_server.loop_share import LoopShare, LoopShares, switch_threads_often
from pipros_server.secret import Denied, Secret
from pipros_server.tls import ServerFailed
from pipros_server.token_file import read_tokens

ASSISTANT_SESSIONS = 16
"""Limit: number of HTTP sessions; four times as many connections are accepted. Beyond it, the token with the
most sessions loses the one that has been idle longest, and gets 404 for it; if all serve requests, up to
twice as many sessions are opened, of which a token gets half of what others leave, and further ones are
refused with the status 503. Sessions end when they have been idle for 10 minutes.
"""

HOST: Final = "127.0.0.1"
KEEP_ALIVE_S: Final = 30
CLOSING_S: Final = 0.2
_LOG: Final = logging.getLogger("pipros_assistants")


class _Server(uvicorn.Server):
    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close all connections. uvicorn logs nothing from here on, since cut off requests are expected."""
        logging.getLogger("uvicorn.error").disabled = True
        await super().shutdown(sockets)


class GuardedApp:
    """ASGI application that passes requests with a valid host, origin and token to another application."""

    def __init__(self, app: App, access: Access, admit: Callable[[tuple[str, int], str], object]) -> None:
        """Store the arguments. `admit` is called with the address and the token of each valid request."""
        self._app = app
        self._access = access
        self._admit = admit
        self._loop_shares = LoopShares()
        self._shares: dict[str, LoopShare] = {}  # by token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        try:
            token = self._check(scope)
        except Denied as error:
            await _refuse(send, 403, str(error))
            return
        if token not in self._shares:
            self._shares[token] = LoopShare(self._loop_shares)
        await self._shares[token].run(self._app, scope, receive, send)

    def _check(self, scope: Scope) -> str:
        """Return the request's token. Raise `Denied` if it is not valid."""
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
        authorization = headers.get("authorization", [None])[0]
        self._access.secret.check_authorization(authorization)
        token = (authorization or "").rpartition(" ")[2]
        if scope.get("client"):
            self._admit(tuple(scope["client"]), token)
        return token


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
    switch_threads_often()
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(_serve(server, port, secret, has_file=token_file is not None))
    return 0


async def _serve(server: MCPServer[Any], port: int, secret: Secret, *, has_file: bool) -> None:
    limits = process_limits()
    listener = Listener(limits, limit=4 * ASSISTANT_SESSIONS, log=_LOG)
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

    def admit(address: tuple[str, int], token: str) -> None:
        for accepted in [each for each in listener.accepted.values() if each.address[:2] == address]:
            accepted.note_request()
            accepted.owner = token
            used = Counter(each.owner for each in listener.accepted.values() if each.owner)
            if 2 * used[token] <= listener.limit - (used.total() - used[token]):
                accepted.admit()

    app = server.streamable_http_app(
        streamable_http_path=PATH,
        max_request_body_size=ASSISTANT_REQUEST_BYTES,
        max_sessions=2 * ASSISTANT_SESSIONS,  # `SharedSessions` needs time to end others
        session_idle_timeout=600,
        host=HOST,
    )
    shared = RequestBodyLimitMiddleware(SharedSessions(app, ASSISTANT_SESSIONS), ASSISTANT_REQUEST_BYTES)
    config = uvicorn.Config(
        GuardedApp(shared, Access(port=port, secret=secret), admit),
        http=CountedProtocol,
        ws="none",
        loop="asyncio",
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        limit_concurrency=8 * ASSISTANT_SESSIONS,
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


Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Coroutine[Any, Any, None]]

_OPENING: Final = 2
"""Number of requests by which clients open a session."""
PATH: Final = "/mcp"
_ID: Final = b"mcp-session-id"
_WAIT_S: Final = 0.05


@dataclass(slots=True)
class _Session:
    client: bytes
    headers: list[tuple[bytes, bytes]]
    requests: int = 0
    running: list[str] = field(default_factory=list)  # ids of requests; "" for a message without one
    used_s: float = field(default_factory=time.monotonic)


class SharedSessions:
    """ASGI application that passes requests to another one, and ends sessions to make room for new ones.

    Bodies must arrive as a whole, as from `RequestBodyLimitMiddleware`.
    """

    def __init__(self, app: App, limit: int) -> None:
        """Store the arguments. `limit` is the maximum number of sessions."""
        self._app = app
        self._limit = limit
        self._sessions: dict[bytes, _Session] = {}
        self._opening: Counter[bytes] = Counter()  # requests that may open a session, by client

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        first = [await receive()] if scope["method"] == "POST" else []
        if any(each["type"] != "http.request" or each["more_body"] for each in first):
            return  # the client has ended

        async def again() -> MutableMapping[str, Any]:
            return first.pop() if first else await receive()

        identity, client = _header(scope["headers"], _ID), _client(scope["headers"])
        if not identity and not await self._makes_room(client):
            await _refuse(send, 503, "too many sessions of this token serve requests; end one")
            return
        self._opening[client] += not identity

        async def note(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                self._note(scope, message["status"], identity or _header(message.get("headers", ()), _ID))
            await send(message)

        found = self._sessions.get(identity) if first else None
        session, used = found or _Session(b"", []), _id_in(first)
        while used and used in session.running:
            await asyncio.sleep(_WAIT_S)
        session.requests += 1
        session.running.append(used)
        try:
            await self._app(scope, again, note)
        finally:
            self._opening[client] -= not identity
            session.running.remove(used)
            session.used_s = time.monotonic()

    def _note(self, scope: Scope, status: int, identity: bytes) -> None:
        if status == 404 or (scope["method"] == "DELETE" and status < 400):
            self._sessions.pop(identity, None)
        elif identity and status < 400 and identity not in self._sessions:
            kept = [each for each in scope["headers"] if each[0].lower() in (b"host", b"authorization")]
            self._sessions[identity] = _Session(_client(kept), [*kept, (_ID, identity)], requests=1)

    async def _makes_room(self, client: bytes) -> bool:
        """End idle sessions, so that a client can open one. Return False if it has too many in use."""
        while True:
            sizes = Counter(each.client for each in self._sessions.values()) + self._opening
            if sizes.total() < self._limit:
                return True
            order = {
                identity: (-sizes[each.client], each.requests > _OPENING, each.used_s)
                for identity, each in self._sessions.items()
                if not each.running and (each.client == client or sizes[each.client] > sizes[client])
            }
            if not order:
                return sizes[client] < 2 * self._limit - sizes.total()
            ended = min(order, key=order.__getitem__)
            await self._end(self._sessions.pop(ended))

    async def _end(self, session: _Session) -> None:
        async def receive() -> MutableMapping[str, Any]:
            return {"type": "http.request", "body": b"", "more_body": False}

        async def send(_: MutableMapping[str, Any]) -> None:
            """Discard the response."""

        scope = {
            "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "DELETE",
            "scheme": "http", "path": PATH, "raw_path": PATH.encode(), "query_string": b"", "root_path": "",
            "headers": session.headers, "client": None, "server": None, "state": {},
        }  # fmt: skip
        await self._app(scope, receive, send)


def _client(headers: Iterable[tuple[bytes, bytes]]) -> bytes:
    return _header(headers, b"authorization").rpartition(b" ")[2]


def _header(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> bytes:
    return next((value for key, value in headers if key.lower() == name), b"")


def _id_in(messages: list[MutableMapping[str, Any]]) -> str:
    """Return the key by which `mcp` finds the response to a request, or an empty string if it gets none."""
    with contextlib.suppress(ValueError, TypeError, LookupError):
        found = from_json(messages[0]["body"])
        return str(found["id"]) if "method" in found else ""
    return ""
