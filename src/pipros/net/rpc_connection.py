"""One connection of an `RpcServer`: HTTP and XML-RPC in, answers out, in order.

Theory of operation: quick methods are answered at once, in the callback that brought the bytes.
While a method that waits is in progress (or a large body is decoded in a thread), the requests
behind it queue up in `_waiting`, bytes that are no request as the error that they are; when there
are too many, the socket is read no further. It is also read no further while the peer does not
read our answers.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from concurrent.futures import Executor
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Protocol

from pipros.errors import ProtocolError
from pipros.net.connections import Connections, Refusals
from pipros.wire.http import CONTINUE, HttpError, Request, RequestReader, build_response, response_head
from pipros.wire.xmlrpc import Encoded, TooManyElements, decode_call, encode_fault, encode_response

if TYPE_CHECKING:
    from pipros.net.rpc_server import RpcLimits

_log = logging.getLogger("pipros.rpc")

_LARGE_BODY_BYTES: Final = 64 * 1024
LARGE_ANSWER_ELEMENTS: Final = 5_000
"""From here on bodies are decoded and answers encoded in a thread, so that the loop goes on answering
others. Methods must therefore return values that nobody changes afterwards."""

_LINGER_S: Final = 5.0
_LINGER_BYTES: Final = 64 * 1024 * 1024
"""How long, and for how much, a peer whose request was refused may go on sending it. One that is cut off
in the middle of a request never reads why: the system throws our answer away."""


class UnknownMethod(LookupError):
    """A call of a method that is not in the table."""


class Answerer(Protocol):
    """What a connection asks of its server."""

    limits: RpcLimits
    connections: Connections
    refusals: Refusals

    @property
    def large_values(self) -> Executor: ...

    def admits(self, peer: str) -> bool: ...

    def call(self, name: str, params: tuple[Any, ...], *, caller: str) -> Any: ...


class RpcConnection(asyncio.Protocol):
    """Reads the requests of one peer, has them answered and writes the answers."""

    def __init__(self, server: Answerer, loop: asyncio.AbstractEventLoop) -> None:
        self._server = server
        self._loop = loop
        self._reader = RequestReader(body_limit=server.limits.body_bytes)
        self._transport: asyncio.Transport | None = None
        self._waiting: deque[Request | HttpError] = deque()
        self._task: asyncio.Task[None] | None = None
        self._is_closing = False
        self._is_stalled = False
        self._is_reading = True
        self._linger: asyncio.TimerHandle | None = None
        self._linger_bytes = _LINGER_BYTES
        self.peer = ""
        self.last_used = loop.time()

    # ---- called by asyncio

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  # a TCP server makes no others
        self._transport = transport
        address = transport.get_extra_info("peername")
        self.peer = address[0] if address else ""
        if self._server.admits(self.peer):
            self._server.connections.enter(self)
        else:
            transport.abort()

    def connection_lost(self, _error: Exception | None) -> None:
        self._transport = None
        self._waiting.clear()
        if self._linger:
            self._linger.cancel()
        if self._task:
            self._task.cancel()
        self._server.connections.leave(self)

    def data_received(self, data: bytes) -> None:
        if self._is_closing or self._reader.failure:
            self._linger_bytes -= len(data)
            if self._linger_bytes < 0:
                self.abort()
            return
        requests: list[Request] = []
        with contextlib.suppress(HttpError):  # it is the reader's `failure` as well
            requests = self._reader.feed(data)
        if requests:
            self.last_used = self._loop.time()
            self._server.connections.touch(self)
            self._waiting.extend(requests)
        if self._reader.failure:
            self._waiting.append(self._reader.failure)
        if self._waiting:
            self._answer_waiting()
        if self._transport and self._reader.wants_continue():
            self._transport.write(CONTINUE)
        self._update_deadline()

    def eof_received(self) -> bool:
        # Whoever is half closed may still want the answers to what it has sent.
        self._is_closing = True
        self._update_deadline()
        return bool(self._task or self._waiting)

    def pause_writing(self) -> None:
        self._is_stalled = True
        self._hold_reading()
        self._update_deadline()

    def resume_writing(self) -> None:
        self._is_stalled = False
        self._answer_waiting()
        self._update_deadline()

    # ---- called by the server

    def abort(self) -> None:
        """Closes at once; what was not sent is lost."""
        self._is_closing = True
        if self._transport:
            self._transport.abort()

    # ---- deadlines and back pressure

    def _update_deadline(self) -> None:
        """Runs while a request is incomplete or our answer is not read; single bytes do not extend it."""
        connections = self._server.connections
        if self._is_stalled or not (self._is_closing or self._reader.is_idle):
            connections.expect_by(self, self._loop.time() + self._server.limits.request_s)
        else:
            connections.expect_nothing(self)

    def _hold_reading(self) -> None:
        if self._is_reading and self._transport:
            self._is_reading = False
            self._transport.pause_reading()

    def _go_on_reading(self) -> None:
        if not self._is_reading and self._transport and not self._transport.is_closing():
            self._is_reading = True
            self._transport.resume_reading()

    # ---- answering

    def _answer_waiting(self) -> None:
        while self._waiting and not self._task and not self._is_stalled and self._transport:
            request = self._waiting.popleft()
            if isinstance(request, HttpError):
                self._refuse(request)
            else:
                self._answer(request)
        if self._is_stalled or len(self._waiting) > self._server.limits.requests_ahead:
            self._hold_reading()
        else:
            self._go_on_reading()
        is_done = self._is_closing and not self._linger
        if is_done and not self._waiting and not self._task and self._transport:
            self._transport.close()

    def _answer(self, request: Request) -> None:
        """Answers at once what is quick; else a task does, and the requests behind it wait."""
        if len(request.body) >= _LARGE_BODY_BYTES:
            self._answer_by_task(request, self._call_large(request.body))
            return
        value: Any = None
        try:
            value = self._call(request.body)
            if inspect.isawaitable(value):
                self._answer_by_task(request, value)
                return
            document = encode_response(value, elements_limit=LARGE_ANSWER_ELEMENTS)
        except TooManyElements:
            self._answer_by_task(request, self._apart(Encoded, value))
            return
        except Exception as error:
            document = self._fault(error)
        self._send(request, document)

    def _call(self, body: bytes) -> Any:
        name, params = decode_call(body, limit_bytes=self._server.limits.body_bytes)
        return self._server.call(name, params, caller=self.peer)

    async def _call_large(self, body: bytes) -> Any:
        decode = partial(decode_call, limit_bytes=self._server.limits.body_bytes)
        name, params = await self._apart(decode, body)
        value = self._server.call(name, params, caller=self.peer)
        return await value if inspect.isawaitable(value) else value

    def _apart(self, function: Callable[[Any], Any], value: Any) -> Awaitable[Any]:
        """Does something with a large value in a thread."""
        return self._loop.run_in_executor(self._server.large_values, function, value)

    def _answer_by_task(self, request: Request, value: Awaitable[Any]) -> None:
        self._task = self._loop.create_task(self._answer_later(request, value))

    async def _answer_later(self, request: Request, awaitable: Awaitable[Any]) -> None:
        try:
            value = await awaitable
            try:
                document = encode_response(value, elements_limit=LARGE_ANSWER_ELEMENTS)
            except TooManyElements:
                document = await self._apart(encode_response, value)
        except Exception as error:
            document = self._fault(error)
        self._task = None
        self._send(request, document)
        self._answer_waiting()

    def _fault(self, error: Exception) -> bytes:
        if isinstance(error, ProtocolError):
            self._server.refusals.note(self.peer, str(error))
        elif not isinstance(error, UnknownMethod):
            _log.debug("a method raised for %s", self.peer, exc_info=error)
        return encode_fault(1, fault_text(error))

    def _send(self, request: Request, document: bytes) -> None:
        if self._transport is None or self._transport.is_closing():
            return
        asks_keep_alive = request.keep_alive and "connection" in request.headers
        head = response_head(len(document), keep_alive=request.keep_alive, says_keep_alive=asks_keep_alive)
        if len(document) < _LARGE_BODY_BYTES:
            self._transport.write(head + document)
        else:
            self._transport.write(head)
            self._transport.write(memoryview(document))
        if not request.keep_alive:
            self._close_softly()

    def _refuse(self, error: HttpError) -> None:
        self._server.refusals.note(self.peer, str(error))
        if self._transport:
            body = f"{error}\n".encode("utf-8", "replace")
            self._transport.write(build_response(body, status=error.status, keep_alive=False))
            if self._is_closing:  # the peer has said that it sends no more
                self._close_softly()
            else:
                self._is_closing = True
                self._waiting.clear()
                self._transport.write_eof()
                self._linger = self._loop.call_later(_LINGER_S, self.abort)

    def _close_softly(self) -> None:
        """Closes when what was written is sent; the deadline sees to it that this does not take for ever."""
        self._is_closing = True
        self._waiting.clear()
        if self._transport:
            self._server.connections.expect_by(self, self._loop.time() + self._server.limits.request_s)
            self._transport.close()


def fault_text(error: BaseException) -> str:
    """An exception in the words of Python's XML-RPC server, which scripts compare."""
    if isinstance(error, UnknownMethod):
        return f'{Exception}:method "{error}" is not supported'
    return f"{type(error)}:{error}"
