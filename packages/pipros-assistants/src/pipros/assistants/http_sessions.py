"""Make room for new sessions of MCP over HTTP, so that no client shuts out the others.

Theory of operation. A session holds its place until its client deletes it, or until it has been idle for a
long time, so a client that restarts without deleting its sessions would fill all places. When all are taken,
the client (that is, the token) with the most sessions loses one that serves no request now: one that was only
opened or, if there is none, the one that has been idle longest. Its client gets 404, and opens a new session.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from dataclasses import dataclass, field
from typing import Any, Final

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

_OPENING: Final = 2
"""Number of requests by which clients open a session."""
PATH: Final = "/mcp"
_ID: Final = b"mcp-session-id"


@dataclass(slots=True)
class _Session:
    client: bytes
    headers: list[tuple[bytes, bytes]]
    requests: int = 0
    running: int = 0
    used_s: float = field(default_factory=time.monotonic)


class SharedSessions:
    """ASGI application that passes requests to another one, and ends sessions to make room for new ones."""

    def __init__(self, app: App, limit: int) -> None:
        """Store the arguments. `limit` is the maximum number of sessions."""
        self._app = app
        self._limit = limit
        self._sessions: dict[bytes, _Session] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        identity = _header(scope["headers"], _ID)
        if not identity:
            await self._make_room()

        async def note(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                self._note(scope, message["status"], identity or _header(message.get("headers", ()), _ID))
            await send(message)

        session = self._sessions.get(identity) if scope["method"] == "POST" else None
        if session is None:
            await self._app(scope, receive, note)
            return
        session.requests += 1
        session.running += 1
        try:
            await self._app(scope, receive, note)
        finally:
            session.running -= 1
            session.used_s = time.monotonic()

    def _note(self, scope: Scope, status: int, identity: bytes) -> None:
        if status == 404 or (scope["method"] == "DELETE" and status < 400):
            self._sessions.pop(identity, None)
        elif identity and status < 400 and identity not in self._sessions:
            kept = [each for each in scope["headers"] if each[0].lower() in (b"host", b"authorization")]
            client = _header(kept, b"authorization").rpartition(b" ")[2]
            self._sessions[identity] = _Session(client, [*kept, (_ID, identity)], requests=1)

    async def _make_room(self) -> None:
        while len(self._sessions) >= self._limit:
            sizes = Counter(each.client for each in self._sessions.values())
            idle = [(identity, each) for identity, each in self._sessions.items() if not each.running]
            if not idle:
                return
            order = {
                identity: (-sizes[each.client], each.requests > _OPENING, each.used_s)
                for identity, each in idle
            }
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


def _header(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> bytes:
    return next((value for key, value in headers if key.lower() == name), b"")
