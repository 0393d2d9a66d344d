"""One connection of an `RpcServer`: HTTP and XML-RPC in, answers out, in order.

Theory of operation: the connections take turns. A quick method is answered at once, in the callback
that brought the bytes; each further request that has come by then, and each slice of a large answer, is
left to a later turn of the event loop (`_turn`), so that whoever asks for much delays nobody else.
Values that are large are read and written in a thread, and methods may wait; a task (`_task`) then goes on
with the answer. As long as any of these is pending, or the peer does not read (`_is_stalled`), the connection
is busy: the requests that come wait in the reader, and the socket is read no further.
"""

from __future__ import annotations

import asyncio
import inspect
import logging
from collections.abc import Awaitable, Callable
from concurrent.futures import Executor
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from pipros.errors import ProtocolError
from pipros.net.address import plain_address
from pipros.net.connections import Connections, Refusals
from pipros.wire.http import CONTINUE, HttpError, Request, RequestReader, build_response, response_head
from pipros.wire.xmlrpc import TooLarge, decode_call, encode_fault, encode_response

if TYPE_CHECKING:
    from pipros.net.rpc_server import RpcLimits

_log = logging.getLogger("pipros.rpc")

_LARGE_BODY_BYTES: Final = 64 * 1024
LARGE_ANSWER: Final = 2_000
"""From here on bodies are decoded and answers encoded in a thread, so that the loop goes on answering
others. Methods must therefore return values that nobody changes afterwards."""
_SLICE_BYTES: Final = 256 * 1024
"""How much of an answer is given to the socket in one turn."""

_LINGER_S: Final = 5.0
_LINGER_BYTES: Final = 64 * 1024 * 1024
"""How long, and for how much, a peer whose request was refused may go on sending it. One that is cut off
in the middle of a request never reads why: the system throws our answer away."""

T = TypeVar("T")


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
        self._task: asyncio.Task[None] | None = None
        self._turn: asyncio.Handle | None = None
        self._linger: asyncio.TimerHandle | None = None
        self._linger_bytes = _LINGER_BYTES
        self._unsent = memoryview(b"")
        self._is_stalled = False
        self._is_reading = True
        self._is_incomplete = False  # the reader has nothing more before more bytes come
        self._is_last_answer = False
        self._has_peer_ended = False
        self._is_closing = False
        self.peer = ""
        self.last_used = loop.time()

    # ---- called by asyncio

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  # a TCP server makes no others
        self._transport = transport
        address = transport.get_extra_info("peername")
        self.peer = plain_address(address[0]) if address else ""
        if self._server.admits(self.peer):
            self._server.connections.enter(self)
        else:
            transport.abort()

    def connection_lost(self, _error: Exception | None) -> None:
        self._transport = None
        self._unsent = memoryview(b"")
        for pending in (self._linger, self._turn, self._task):
            if pending:
                pending.cancel()
        self._server.connections.leave(self)

    def data_received(self, data: bytes) -> None:
        if self._is_closing:
            self._linger_bytes -= len(data)
            if self._linger_bytes < 0:
                self.abort()
            return
        self._reader.feed(data)
        self._is_incomplete = False
        if self._is_busy:
            self._hold_reading()
        else:
            self._go_on()

    def eof_received(self) -> bool:
        # Whoever is half closed may still want the answers to what it has sent.
        self._has_peer_ended = True
        if self._is_closing or not self._is_busy:
            self._close_softly()
        return True

    def pause_writing(self) -> None:
        self._is_stalled = True
        self._update_deadline()

    def resume_writing(self) -> None:
        self._is_stalled = False
        self._see_what_is_next()

    # ---- called by the server

    def abort(self) -> None:
        """Closes at once; what was not sent is lost."""
        self._is_closing = True
        if self._transport:
            self._transport.abort()

    # ---- turns, deadlines and back pressure

    @property
    def _is_busy(self) -> bool:
        return bool(self._task or self._turn or self._is_stalled)

    def _go_on(self) -> None:
        """A turn: a slice of the last answer, or else the next request."""
        self._turn = None
        if self._unsent:
            self._send_slice()
        else:
            self._answer_next()
        self._see_what_is_next()

    def _see_what_is_next(self) -> None:
        if self._transport is None or self._is_closing:
            return
        if not self._is_busy:
            if self._unsent:
                self._turn = self._loop.call_soon(self._go_on)
            elif self._is_last_answer:
                self._close_softly()
            elif not (self._reader.is_idle or self._is_incomplete):
                self._turn = self._loop.call_soon(self._go_on)
            elif self._has_peer_ended:
                self._close_softly()
            else:
                self._go_on_reading()
        self._update_deadline()

    def _update_deadline(self) -> None:
        """Runs while a request is incomplete or our answer is not read; single bytes do not extend it."""
        if self._is_closing:
            return
        if self._is_stalled or (self._is_incomplete and not self._reader.is_idle):
            self._expect_progress()
        else:
            self._server.connections.expect_nothing(self)

    def _expect_progress(self) -> None:
        self._server.connections.expect_by(self, self._loop.time() + self._server.limits.request_s)

    def _hold_reading(self) -> None:
        if self._is_reading and self._transport:
            self._is_reading = False
            self._transport.pause_reading()

    def _go_on_reading(self) -> None:
        if not self._is_reading and self._transport:
            self._is_reading = True
            self._transport.resume_reading()

    # ---- answering

    def _answer_next(self) -> None:
        try:
            request = self._reader.next_request()
        except HttpError as error:
            self._refuse(error)
            return
        if request:
            self.last_used = self._loop.time()
            self._server.connections.touch(self)
            self._answer(request)
        else:
            self._is_incomplete = True
            if self._transport and self._reader.wants_continue():
                self._transport.write(CONTINUE)

    def _answer(self, request: Request) -> None:
        """Answers at once what is quick; else a task does."""
        if len(request.body) >= _LARGE_BODY_BYTES:
            self._answer_by_task(request, self._answer_to_large(request.body))
            return
        value: Any = None
        try:
            value = self._call(request.body)
            if inspect.isawaitable(value):
                self._answer_by_task(request, self._answer_of(value))
                return
            document = encode_response(value, size_limit=LARGE_ANSWER)
        except TooLarge:
            self._answer_by_task(request, self._apart(encode_response, value))
            return
        except Exception as error:
            document = self._fault(error)
        self._send(request, document)

    def _call(self, body: bytes | bytearray) -> Any:
        name, params = decode_call(body, limit_bytes=self._server.limits.body_bytes)
        return self._server.call(name, params, caller=self.peer)

    async def _answer_to_large(self, body: bytes | bytearray) -> bytes:
        decode = partial(decode_call, limit_bytes=self._server.limits.body_bytes)
        name, params = await self._apart(decode, body)
        return await self._answer_of(self._server.call(name, params, caller=self.peer))

    async def _answer_of(self, value: Any) -> bytes:
        if inspect.isawaitable(value):
            value = await value
        try:
            return encode_response(value, size_limit=LARGE_ANSWER)
        except TooLarge:
            return await self._apart(encode_response, value)

    def _apart(self, function: Callable[[Any], T], value: Any) -> Awaitable[T]:
        """Does something with a large value in a thread."""
        return self._loop.run_in_executor(self._server.large_values, function, value)

    def _answer_by_task(self, request: Request, answer: Awaitable[bytes]) -> None:
        self._task = self._loop.create_task(self._answer_later(request, answer))

    async def _answer_later(self, request: Request, answer: Awaitable[bytes]) -> None:
        try:
            document = await answer
        except Exception as error:
            document = self._fault(error)
        self._task = None
        self._send(request, document)
        self._see_what_is_next()

    def _fault(self, error: Exception) -> bytes:
        if isinstance(error, ProtocolError):
            self._server.refusals.note(self.peer, str(error))
        elif not isinstance(error, UnknownMethod):
            _log.debug("a method raised for %s", self.peer, exc_info=error)
        return encode_fault(1, fault_text(error))

    def _send(self, request: Request, document: bytes) -> None:
        if self._transport is None:
            return
        asks_keep_alive = request.keep_alive and "connection" in request.headers
        head = response_head(len(document), keep_alive=request.keep_alive, says_keep_alive=asks_keep_alive)
        self._is_last_answer = not request.keep_alive
        if len(document) <= _SLICE_BYTES:
            self._transport.write(head + document)
        else:
            self._transport.write(head)
            self._unsent = memoryview(document)

    def _send_slice(self) -> None:
        """A large answer goes out in slices, because the transport copies what the socket does not take."""
        if self._transport:
            piece, self._unsent = self._unsent[:_SLICE_BYTES], self._unsent[_SLICE_BYTES:]
            self._transport.write(piece)

    def _refuse(self, error: HttpError) -> None:
        self._server.refusals.note(self.peer, str(error))
        if self._transport:
            body = f"{error}\n".encode("utf-8", "replace")
            self._transport.write(build_response(body, status=error.status, keep_alive=False))
            if self._has_peer_ended:
                self._close_softly()
            else:
                self._is_closing = True
                self._server.connections.expect_nothing(self)
                self._transport.write_eof()
                self._go_on_reading()
                self._linger = self._loop.call_later(_LINGER_S, self.abort)

    def _close_softly(self) -> None:
        """Closes when what was written is sent; the deadline sees to it that this does not take for ever."""
        self._is_closing = True
        if self._transport:
            self._expect_progress()
            self._transport.close()


def fault_text(error: BaseException) -> str:
    """An exception in the words of Python's XML-RPC server, which scripts compare."""
    if isinstance(error, UnknownMethod):
        return f'{Exception}:method "{error}" is not supported'
    return f"{type(error)}:{error}"
