"""Serve the page's files over HTTP, and all live data over one WebSocket per browser.

The files contain nothing secret. The first message on a WebSocket authenticates the browser:
`{"token": "…"}`, or `{"code": "…"}` with a one-time code; the response is
`{"id": 0, "data": {"token": "…"}}`. Then the browser requests views and actions:
`{"id": 3, "view": "graph", "args": {…}}`, `{"id": 3, "stop": true}`,
`{"id": 4, "action": "set_param", "args": {…}}`. Responses contain the id: `{"id": 3, "data": …}`,
`{"id": 3, "error": "…"}`, or, in binary, the id as four big-endian bytes followed by the data. A read-only
view is retried after an error, unless the request was refused. The server also sends `{"id": -2}` every
`BEAT_S`, so that the page notices a suspended server and an interrupted link, which TCP does not report.
For the same reason, responses of more than `PART_BYTES` are sent in parts: in binary, the id plus 2^31 as
four big-endian bytes, a byte (0 if more parts follow, 1 after a text, 2 after binary data), and the content.
Other messages can be sent in between.

Each view is a task that sends new values only after the browser has received the previous ones. A slow
browser therefore receives fewer values, but current ones, and does not delay other browsers.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import ssl
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, Final, NoReturn

from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from pipros.basics.budget import Budget
from pipros.basics.errors import PiprosError
from pipros.basics.limits import process_limits
from pipros.net.tcpros import HANDSHAKES
from pipros_server.access import LOOPBACK_HOSTS, Access, is_forwarded_tls
from pipros_server.browser_share import set_current_browser
from pipros_server.json_text import json_text
from pipros_server.listener import Listener
from pipros_server.port import ServerPort
from pipros_server.port_connection import READ_AHEAD_BYTES, PortConnection
from pipros_server.responses import file_response, only_header, plain_response
from pipros_server.secret import Denied, Secret

if TYPE_CHECKING:
    pass

logger = logging.getLogger("pipros_server")

SOCKET_PATH = "/live"
VIEWS_OF_A_BROWSER = 200
REQUEST_BYTES = 1_000_000
VALUES_OF_A_REQUEST: Final = 100_000
"""Maximum number of values in a request: parsing them takes 10 ms, and a hundred bytes each."""
OPEN_CHARACTERS: Final = 2 * REQUEST_BYTES
"""Maximum total size of the requests for a browser's open views, whose arguments need far more."""
BROWSERS = 100
BROWSERS_SHARE: Final = 3 / 4
"""Share of the connections that browsers may keep open. The rest is reserved for files and new browsers."""
RESUME_S: Final = 1.0
"""Delay before a failed view is retried."""
BEAT_S: Final = 1.0
"""Interval at which each browser gets a message, even if nothing is new; see `page/silence.js`."""
PART_BYTES: Final = 32 * 1024
"""Size of the parts of a large message. They take less than the page's 2.5 s if a link has 15 kB/s."""
_FIRST_NUMBER_OF_PARTS: Final = 1 << 31
LONGEST_ERROR: Final = 2000

_EXPECTED = (PiprosError, OSError, ValueError, TypeError)
"""Errors that arguments or the system may cause. Other exceptions are defects, which are logged."""

View = Callable[[Mapping[str, Any]], AsyncIterator[Any]]
"""Called with the arguments of a request. Yields values for the browser: JSON values or bytes."""
Action = Callable[[Mapping[str, Any]], Awaitable[Any]]
"""Called with the arguments of a request. Returns the data for the response."""


class RequestRefused(PiprosError):
    """A request for a view or an action is refused. The page shows the error text."""


class _Arguments(dict[str, Any]):
    """The arguments of a request. Unlike any other KeyError, a missing one is the browser's fault."""

    def __missing__(self, name: str) -> NoReturn:
        raise RequestRefused(f"missing argument {name!r}")


@dataclass(frozen=True, slots=True)
class ServedViews:
    """Views and actions that browsers can request.

    Attributes:
        views, actions: functions by name.
        changing: names of the views and actions that change the system.
        permitted: the names in `changing` that are allowed.
        pages: packages whose `page` folders contain the page's files, in search order.
    """

    views: Mapping[str, View] = field(default_factory=dict)
    actions: Mapping[str, Action] = field(default_factory=dict)
    changing: frozenset[str] = frozenset()
    permitted: frozenset[str] = frozenset()
    pages: Sequence[str] = ("pipros_server",)


class PageServer:
    """Serves the page from `start` until `close`. For use in one event loop."""

    def __init__(self, served: ServedViews, secret: Secret | None = None) -> None:
        """Create a server. `secret` defaults to a new secret."""
        self._served = served
        self._secret = secret or Secret()
        self._limits = process_limits()
        listener = Listener(self._limits, limit=BROWSERS + HANDSHAKES, log=logger)
        self._port = ServerPort(listener, self._limits)
        self._browsers = 0
        self._input = Budget(BROWSERS * REQUEST_BYTES // 2)
        self._logged: set[tuple[str, type[BaseException]]] = set()
        self.access = Access(0, secret=self._secret)

    async def start(
        self, host: str, port: int, *, names: Collection[str] = (), tls: ssl.SSLContext | None = None
    ) -> None:
        """Open the port.

        Args:
            host: address to listen on.
            port: port to listen on; 0 selects a free one.
            names: names allowed in `Host` headers besides the loopback names. If any are given, all IP
                addresses are allowed, too.

        Raises:
            OSError: the port is in use, or the address does not belong to this machine.
        """
        number = await self._port.open(
            host,
            port,
            handle_websocket=self.handle_websocket,
            respond=self.respond,
            max_bytes=REQUEST_BYTES,
            tls=tls,
        )
        self.access = Access(
            number,
            frozenset({*LOOPBACK_HOSTS, *names}),
            is_secure=tls is not None,
            takes_addresses=bool(names),
            secret=self._secret,
        )

    async def close(self) -> None:
        """Close the port and all connections; see `ServerPort.close`."""
        await self._port.close()

    def respond(self, connection: PortConnection, request: Request) -> Response | None:
        """Return the response to a request, or None to continue with the WebSocket handshake."""
        connection.note_request()
        headers = request.headers
        path = request.path.partition("?")[0]
        try:
            host = only_header(headers, "Host")
            self.access.check_host(host)
            if path == SOCKET_PATH:
                is_behind_tls = is_forwarded_tls(only_header(headers, "X-Forwarded-Proto"))
                self.access.check_origin(only_header(headers, "Origin"), host, is_behind_tls=is_behind_tls)
                return None
        except Denied as error:
            return plain_response(HTTPStatus.FORBIDDEN, str(error))
        return file_response(path, self._served.pages, headers)

    async def handle_websocket(self, connection: PortConnection) -> None:
        """Serve one browser until it disconnects."""
        set_current_browser(connection.ping)
        try:
            first = await asyncio.wait_for(connection.recv(), self._limits.login_s)
            self.access.secret.check_first_message(first)
        except asyncio.TimeoutError:
            # After this code, the page connects again. After POLICY_VIOLATION, it would forget its token.
            await connection.close(CloseCode.TRY_AGAIN_LATER, "The token must be the first message.")
            return
        except Denied as error:
            await connection.close(CloseCode.POLICY_VIOLATION, str(error))
            return
        except ConnectionClosed:
            return
        limit = min(BROWSERS, int(self._port.limit * BROWSERS_SHARE))
        if self._browsers >= limit:
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"{limit} browsers are already connected.")
            return
        with_spare = 2 * (REQUEST_BYTES + READ_AHEAD_BYTES)
        budget = Budget(with_spare, self._input, part=0.5, own=READ_AHEAD_BYTES)
        connection.admit(budget, REQUEST_BYTES)
        self._browsers += 1
        browser = _Browser(connection, self._served, self._logged)
        try:
            await browser.welcome(self.access.secret.token)
            await connection.share.run(browser.handle_all)
        except ConnectionClosed:
            pass
        finally:
            self._browsers -= 1
            budget.close()
            await browser.close()


class _Browser:
    """The open views of one browser."""

    def __init__(
        self,
        connection: PortConnection,
        served: ServedViews,
        logged: set[tuple[str, type[BaseException]]],
    ) -> None:
        """Create the state of a browser.

        Args:
            logged: the errors already logged for any browser, as pairs of view or action name and exception
                type. Updated in place.
        """
        self._connection = connection
        self._served = served
        self._logged = logged
        self._tasks: dict[int, asyncio.Task[None]] = {}
        self._share = connection.share
        self._open_characters = 0
        self._beats = asyncio.create_task(self._beat())

    async def _beat(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await asyncio.sleep(BEAT_S)
                await self._send({"id": -2})

    async def welcome(self, token: str) -> None:
        """Send the token in reply to the first message.

        A browser that sent a one-time code does not have the token yet.
        """
        await self._send({"id": 0, "data": {"token": token}})

    async def handle_all(self) -> None:
        """Start the requested views and actions, and stop views, until the browser disconnects."""
        async for text in self._connection:
            await self._handle(text)
            await self._share.end_long_step()

    async def _handle(self, text: str | bytes) -> None:
        try:
            data = text.encode() if isinstance(text, str) else text
            if sum(map(data.count, (b",", b"{", b"["))) > VALUES_OF_A_REQUEST:
                raise ValueError(f"it has more than {VALUES_OF_A_REQUEST} values")
            request = json.loads(text)
            number = request["id"]
            if not isinstance(number, int) or not 0 <= number < 1 << 31:
                raise ValueError(f"id must be an integer from 0 to 2^31 - 1, got {number!r}")
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
                {"id": number, "error": f"{VIEWS_OF_A_BROWSER} views are already open; close some of them"}
            )
            return
        if self._open_characters + len(text) > OPEN_CHARACTERS:
            what = f"the requests for the open views have more than {OPEN_CHARACTERS} characters"
            await self._send({"id": number, "error": f"{what}; close some of them"})
            return
        self._open_characters += len(text)
        task = asyncio.create_task(self._share.run(self._serve, number, request))
        self._tasks[number] = task
        task.add_done_callback(lambda done: self._ended(number, done, len(text)))

    def _ended(self, number: int, task: asyncio.Task[None], characters: int) -> None:
        self._open_characters -= characters
        if self._tasks.get(number) is task:
            del self._tasks[number]

    async def close(self) -> None:
        tasks = [self._beats, *self._tasks.values()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, number: int, request: Mapping[str, object]) -> None:
        """Serve a request. A read-only view is retried after an error."""
        name = str(request.get("action", request.get("view")))
        is_once = "action" in request or name in self._served.changing
        sent = ""
        with contextlib.suppress(ConnectionClosed):
            while True:
                try:
                    async with contextlib.aclosing(self._answers(number, request)) as messages:
                        async for message in messages:
                            await self._send_in_parts(number, message)
                            sent = ""
                    return
                except ConnectionClosed:
                    raise
                except Exception as error:
                    text = self._text_of(error, name)
                    if text != sent:
                        await self._send({"id": number, "error": text})
                    if is_once or isinstance(error, RequestRefused):
                        return
                    sent = text
                await asyncio.sleep(RESUME_S)

    async def _answers(self, number: int, request: Mapping[str, Any]) -> AsyncGenerator[str | bytes, None]:
        arguments = request.get("args") or {}
        if not isinstance(arguments, dict):
            raise RequestRefused(f"args must be an object, got {type(arguments).__name__}")
        arguments = _Arguments(arguments)
        if "action" in request:
            yield await json_text({"id": number, "data": await self._act(request["action"], arguments)})
            return
        view = self._served.views.get(str(request.get("view")))
        if view is None:
            raise RequestRefused(f"unknown view {request.get('view')!r}")
        self._check_control(str(request["view"]))
        async with contextlib.aclosing(view(arguments)) as values:  # type: ignore[type-var]
            async for value in values:
                if isinstance(value, bytes):
                    yield number.to_bytes(4, "big") + value
                else:
                    yield await json_text({"id": number, "data": value})

    def _text_of(self, error: Exception, name: str) -> str:
        """Return the error text for the browser. Log unexpected errors, once per view or action and type."""
        if isinstance(error, _EXPECTED):
            return (str(error) or type(error).__name__)[:LONGEST_ERROR]
        if (name, type(error)) not in self._logged:
            self._logged.add((name, type(error)))
            logger.error("%s failed (further errors of this kind are not logged)", name, exc_info=error)
        return f"{type(error).__name__}: {error}"[:LONGEST_ERROR]

    async def _act(self, name: str, arguments: Mapping[str, object]) -> Any:
        action = self._served.actions.get(str(name))
        if action is None:
            raise RequestRefused(f"unknown action {name!r}")
        self._check_control(name)
        return await action(arguments)

    def _check_control(self, name: str) -> None:
        if name in self._served.changing - self._served.permitted:
            what = "cannot do this" if self._served.permitted else "is read-only"
            raise RequestRefused(f"this page {what}; start it with --control to change the system")

    async def _send_in_parts(self, number: int, message: str | bytes) -> None:
        if len(message) <= PART_BYTES:
            await self._connection.send(message)
            return
        content = memoryview(message.encode() if isinstance(message, str) else message)
        head = (_FIRST_NUMBER_OF_PARTS + number).to_bytes(4, "big")
        for begin in range(0, len(content), PART_BYTES):
            is_last = begin + PART_BYTES >= len(content)
            kind = 0 if not is_last else 1 if isinstance(message, str) else 2
            await self._connection.send(head + bytes([kind]) + content[begin : begin + PART_BYTES])
            await asyncio.sleep(0)  # a browser that reads at once would let no other task run

    async def _send(self, value: Mapping[str, object]) -> None:
        await self._connection.send(await json_text(value))
