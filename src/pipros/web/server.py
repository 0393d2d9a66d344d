"""The server of the page: its files over HTTP, and all live data over one WebSocket per browser.

A browser requests views and actions: `{"id": 3, "view": "graph", "args": {…}}`, `{"id": 3, "stop": true}`,
`{"id": 4, "action": "set_param", "args": {…}}`. Answers carry the id: `{"id": 3, "data": …}`,
`{"id": 3, "error": "…"}`, or in binary the id as four bytes, the most significant first, and the data.

Each view of a browser is a task that sends when the browser has received what was sent before. So a slow
browser gets fewer and newer values, and does not delay anything else.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import mimetypes
import ssl
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib import resources
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from pipros.errors import PiprosError
from pipros.web.access import LOOPBACK_HOSTS, Access, Denied
from pipros.web.browser_share import begin_browser

logger = logging.getLogger("pipros.web")

SOCKET_PATH = "/live"
VIEWS_OF_A_BROWSER = 200
REQUEST_BYTES = 1_000_000
BROWSERS = 100

View = Callable[[Mapping[str, Any]], AsyncIterator[Any]]
"""Takes the arguments of a request and yields what is sent to the browser: values for JSON, or bytes."""
Action = Callable[[Mapping[str, Any]], Awaitable[Any]]
"""Takes the arguments of a request, and returns the answer."""

SECURITY_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' blob: data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class RequestRefused(PiprosError):
    """A view or an action is refused. The text is shown on the page."""


@dataclass(frozen=True, slots=True)
class Services:
    """What browsers can request.

    Attributes:
        views, actions: by name.
        changing: the names of those that change the system.
        has_control: whether these are allowed.
    """

    views: Mapping[str, View] = field(default_factory=dict)
    actions: Mapping[str, Action] = field(default_factory=dict)
    changing: frozenset[str] = frozenset()
    has_control: bool = False


class PageServer:
    """Serves the page until it is closed. For one event loop."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._server: Server | None = None
        self._browsers = 0
        self.access = Access(0)

    async def start(
        self, host: str, port: int, *, names: Collection[str] = (), tls: ssl.SSLContext | None = None
    ) -> None:
        """Opens the port.

        Args:
            host: the address to listen on.
            port: 0 takes a free one.
            names: further names for `Host`, besides those of loopback; with them, any IP address is allowed.

        Raises:
            OSError: the port is taken, or the address is not of this machine.
        """
        self._server = await serve(
            self._attend,
            host,
            port,
            process_request=self._answer,
            ssl=tls,
            max_size=REQUEST_BYTES,
            write_limit=65536,
            server_header=None,
            compression=None,  # compression costs more than it saves on loopback
            logger=logger,
            close_timeout=1,
        )
        port = next(iter(self._server.sockets)).getsockname()[1]
        self.access = Access.with_new_token(
            port, {*LOOPBACK_HOSTS, *names}, is_secure=tls is not None, takes_addresses=bool(names)
        )

    async def close(self) -> None:
        """Closes the port and all connections."""
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()

    def _answer(self, _: ServerConnection, request: Request) -> Response | None:
        """The answer to a request; None starts a WebSocket."""
        headers = request.headers
        path = request.path.partition("?")[0]
        try:
            self.access.check_host(_only(headers, "Host"))
            has_token = path == "/" and self.access.comes_with_token(request.path)
            if not has_token:
                self.access.check_cookie(_only(headers, "Cookie"))
            if path == SOCKET_PATH:
                self.access.check_origin(_only(headers, "Origin"))
                if self._browsers >= BROWSERS:
                    raise Denied(f"{BROWSERS} browsers are connected already; close one.")
                return None
        except Denied as error:
            return _response(HTTPStatus.FORBIDDEN, str(error).encode(), "text/plain; charset=utf-8")
        return _file_response(path, {"Set-Cookie": self.access.cookie} if has_token else {})

    async def _attend(self, connection: ServerConnection) -> None:
        """Serves one browser until it disconnects."""
        begin_browser()
        self._browsers += 1
        browser = _Browser(connection, self._services)
        try:
            async for text in connection:
                await browser.handle(text)
        except ConnectionClosed:
            pass
        finally:
            self._browsers -= 1
            await browser.close()


class _Browser:
    """The open views of one browser."""

    def __init__(self, connection: ServerConnection, services: Services) -> None:
        self._connection = connection
        self._services = services
        self._tasks: dict[int, asyncio.Task[None]] = {}

    async def handle(self, text: str | bytes) -> None:
        """Carries out a request."""
        try:
            request = json.loads(text)
            number = request["id"]
            if not isinstance(number, int) or not 0 <= number < 1 << 31:
                raise ValueError(f"id must be a number of 31 bits, got {number!r}")
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            await self._send({"id": -1, "error": f"malformed request: {error}"})
            return
        task = self._tasks.pop(number, None)
        if task is not None:
            task.cancel()
        if request.get("stop"):
            return
        if len(self._tasks) >= VIEWS_OF_A_BROWSER:
            await self._send(
                {"id": number, "error": f"{VIEWS_OF_A_BROWSER} views are open already; close some"}
            )
            return
        task = asyncio.create_task(self._serve(number, request))
        self._tasks[number] = task
        task.add_done_callback(lambda done: self._tasks.get(number) is done and self._tasks.pop(number))

    async def close(self) -> None:
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, number: int, request: Mapping[str, Any]) -> None:
        arguments = request.get("args") or {}
        try:
            if not isinstance(arguments, dict):
                raise RequestRefused(f"args must be an object, got {type(arguments).__name__}")
            if "action" in request:
                await self._send({"id": number, "data": await self._act(request["action"], arguments)})
                return
            view = self._services.views.get(str(request.get("view")))
            if view is None:
                raise RequestRefused(f"there is no view {request.get('view')!r}")
            self._check_control(str(request["view"]))
            async with contextlib.aclosing(view(arguments)) as values:  # type: ignore[type-var]
                async for value in values:
                    if isinstance(value, bytes):
                        await self._connection.send(number.to_bytes(4, "big") + value)
                    else:
                        await self._send({"id": number, "data": value})
        except ConnectionClosed:
            pass
        except (PiprosError, OSError, ValueError, TypeError, KeyError) as error:
            with contextlib.suppress(ConnectionClosed):
                await self._send({"id": number, "error": str(error) or type(error).__name__})

    async def _act(self, name: str, arguments: Mapping[str, Any]) -> Any:
        action = self._services.actions.get(name)
        if action is None:
            raise RequestRefused(f"there is no action {name!r}")
        self._check_control(name)
        return await action(arguments)

    def _check_control(self, name: str) -> None:
        if name in self._services.changing and not self._services.has_control:
            raise RequestRefused("this page is read-only; start it with --control to change the system")

    async def _send(self, value: Mapping[str, Any]) -> None:
        await self._connection.send(json.dumps(value, separators=(",", ":"), allow_nan=False, default=str))


def _only(headers: Headers, name: str) -> str | None:
    """The value of a header that must not be repeated."""
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else None


def _file_response(path: str, more: Mapping[str, str]) -> Response:
    """A file of the page. Only names of files in its folder are found, so no path leads out of it."""
    name = "index.html" if path == "/" else path[1:]
    file = resources.files("pipros.web") / "page"
    for part in name.split("/"):
        file = (
            next((child for child in file.iterdir() if child.name == part), file) if file.is_dir() else file
        )
        if file.name != part:
            return _response(HTTPStatus.NOT_FOUND, b"This file does not exist.", "text/plain; charset=utf-8")
    if not file.is_file():
        return _response(HTTPStatus.NOT_FOUND, b"This file does not exist.", "text/plain; charset=utf-8")
    kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
    if name.endswith(".js"):
        kind = "text/javascript"
    charset = "; charset=utf-8" if kind.startswith(("text/", "image/svg")) else ""
    return _response(HTTPStatus.OK, file.read_bytes(), kind + charset, more)


def _response(status: HTTPStatus, body: bytes, kind: str, more: Mapping[str, str] | None = None) -> Response:
    headers = {
        "Content-Type": kind,
        "Content-Length": str(len(body)),
        "Connection": "close",
        **SECURITY_HEADERS,
        **(more or {}),
    }
    return Response(status.value, status.phrase, Headers(headers), body)
