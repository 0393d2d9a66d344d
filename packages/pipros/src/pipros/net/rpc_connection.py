"""One connection of an `RpcServer`: reads XML-RPC requests over HTTP, and sends the responses in order.

Theory of operation: connections take turns in the event loop. A call to a fast method is handled at once, in
the callback that received the bytes; each further request that has arrived, and each slice of a large
response, is left to a later turn, so that a peer with many or large requests does not delay others. Large
values are decoded and encoded in a thread, and methods may wait; in these cases, a task sends the response.
While a turn or task is pending, or the peer does not read, the connection is busy: further requests wait in
the reader, and the socket is not read. `pipros.net.rpc_state` defines the states and their transitions.
"""

from __future__ import annotations

import asyncio
import inspect
import logging
from collections.abc import Awaitable, Callable
from concurrent.futures import Executor
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from pipros.basics.errors import ProtocolError
from pipros.net.connection_table import WHOLE_REQUEST_S, ConnectionTable
from pipros.net.held_bytes import HeldBytes
from pipros.net.loop_turns import LoopTurns
from pipros.net.refusals import Refusals
from pipros.net.rpc_state import BUSY, FINAL, RpcEvent, RpcState, Step, after, next_step
from pipros.net.this_machine import ThisMachineCaller
from pipros.wire.http import CONTINUE, HttpError, Request, RequestReader, build_response, response_head
from pipros.wire.xmlrpc import ValueTooLarge, decode_call, encode_fault, encode_response

if TYPE_CHECKING:
    from pipros.basics.limits import Limits

_log = logging.getLogger("pipros.rpc")

_LARGE_BODY_BYTES: Final = 64 * 1024
LARGE_ANSWER: Final = 2_000
"""Threads decode bodies of at least _LARGE_BODY_BYTES, and encode responses with more than LARGE_ANSWER
elements, so that the loop can serve other peers in the meantime. Methods must therefore return values that
are not changed afterwards.
"""
_SLICE_BYTES: Final = 256 * 1024
"""Number of bytes of a response that are written to the socket in one turn."""

_DRAIN_LIMIT_S: Final = 5.0
_DRAIN_LIMIT_BYTES: Final = 64 * 1024 * 1024
"""Limits on the time that a peer may continue to send after a refusal, and on the number of bytes. If the
connection were closed in the middle of a request, the system would discard the response with the reason.
"""

T = TypeVar("T")


class UnknownMethod(LookupError):
    """The method table does not contain the called method."""


class Answerer(Protocol):
    """The part of the server's interface that a connection uses."""

    limits: Limits
    connections: ConnectionTable
    bodies: HeldBytes
    refusals: Refusals
    turns: LoopTurns
    on_lost: Callable[[ThisMachineCaller], object] | None

    @property
    def large_values(self) -> Executor: ...

    def admits(self, caller: ThisMachineCaller) -> bool: ...

    def call(self, name: str, params: tuple[Any, ...], *, caller: ThisMachineCaller) -> Any: ...


class RpcConnection(asyncio.Protocol):
    """Reads one peer's requests and writes the responses."""

    def __init__(self, server: Answerer, loop: asyncio.AbstractEventLoop, received: bytes = b"") -> None:
        """Handle the requests on one connection.

        `received` contains the bytes that have already been read from the connection.
        """
        self._server = server
        self._loop = loop
        self._received = received
        self._reader = RequestReader(body_limit=server.limits.body_bytes)
        self._transport: asyncio.Transport | None = None
        self._state = RpcState.READING
        self._pending: asyncio.Task[None] | asyncio.Handle | None = None  # that the state waits for
        self._drain_bytes_left = _DRAIN_LIMIT_BYTES
        self._unsent = memoryview(b"")
        self._needs_bytes = False  # whether the reader needs more bytes to complete a request
        self._is_last_answer = False
        self._has_peer_ended = False
        self.caller = ThisMachineCaller()
        self.peer = ""
        self.last_used = loop.time()

    # ---- called by asyncio

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  # a TCP server makes no others
        self._transport = transport
        names = (transport.get_extra_info(name) for name in ("peername", "sockname"))
        self.caller = ThisMachineCaller.from_names(*names)
        self.peer = self.caller.host
        if not self._server.admits(self.caller) or not self._server.connections.add(self):
            transport.abort()
        elif self._received:  # process these bytes before the bytes that arrive from now on
            self._loop.call_soon(self.data_received, self._received)
            self._received = b""

    def connection_lost(self, _error: Exception | None) -> None:
        self._note(RpcEvent.ABORTED)
        self._transport = None
        self._unsent = memoryview(b"")
        if self._pending:
            self._pending.cancel()
        self._server.connections.remove(self)
        self._server.bodies.forget(self)
        if self._server.on_lost:
            self._server.on_lost(self.caller)

    def data_received(self, data: bytes) -> None:
        if self._state in FINAL:
            self._drain_bytes_left -= len(data)
            if self._drain_bytes_left < 0:
                self.abort()
            return
        self._reader.feed(data)
        self._needs_bytes = False
        if self._state is RpcState.READING:
            self._take_turn()
        elif self._transport:
            self._transport.pause_reading()

    def eof_received(self) -> bool:
        # A peer that has closed the connection for sending may still be waiting for responses.
        self._has_peer_ended = True
        if self._state not in BUSY:
            self._close_gracefully()
        return True

    def pause_writing(self) -> None:
        self._note(RpcEvent.WRITING_PAUSED)
        self._update_deadline()

    def resume_writing(self) -> None:
        self._note(RpcEvent.WRITING_RESUMED)
        self._continue()

    # ---- called by the server

    def abort(self) -> None:
        """Close immediately; unsent data is lost."""
        self._note(RpcEvent.ABORTED)
        if self._transport:
            self._transport.abort()

    # ---- turns, deadlines and back pressure

    def _note(self, event: RpcEvent) -> None:
        self._state = after(self._state, event)

    def _take_turn(self) -> None:
        """Send a slice of the current response, or handle the next request."""
        if self._unsent:
            self._send_slice()
        else:
            self._answer_next()
        self._continue()

    def _take_queued_turn(self) -> None:
        if self._state is RpcState.QUEUED:
            self._note(RpcEvent.TURN_BEGAN)
            self._take_turn()

    def _continue(self) -> None:
        """Take the next step, unless the connection is busy."""
        if self._transport is None or self._state in FINAL:
            return
        if self._state is RpcState.READING:
            step = next_step(
                has_unsent=bool(self._unsent),
                is_last_answer=self._is_last_answer,
                has_input=not (self._needs_bytes or self._reader.is_idle),
                has_peer_ended=self._has_peer_ended,
            )
            if step is Step.READ:
                self._transport.resume_reading()
            elif step is Step.QUEUE_TURN:
                self._server.turns.put(self.peer, self._take_queued_turn)
                self._note(RpcEvent.TURN_QUEUED)
            else:
                self._close_gracefully()
        self._update_deadline()

    def _update_deadline(self) -> None:
        """Set a deadline while a request is incomplete or a response is unread.

        The arrival of more bytes does not extend the deadline.
        """
        if self._state in FINAL:
            return
        if self._state is RpcState.STALLED or (self._needs_bytes and not self._reader.is_idle):
            self._expect_progress()
        else:
            self._server.connections.clear_deadline(self)

    def _expect_progress(self) -> None:
        self._server.connections.set_deadline(self, self._loop.time() + WHOLE_REQUEST_S)

    # ---- responding

    def _answer_next(self) -> None:
        try:
            request = self._reader.next_request()
        except HttpError as error:
            self._refuse(error)
            return
        if request:
            self.last_used = self._loop.time()
            self._server.connections.mark_used(self)
            self._answer(request)
        else:
            self._needs_bytes = True
            self._server.bodies.note(self, self._reader.held_bytes)
            if self._transport and self._reader.wants_continue():
                self._transport.write(CONTINUE)

    def _answer(self, request: Request) -> None:
        """Respond at once if the method is fast and the values are small; otherwise start a task."""
        if len(request.body) >= _LARGE_BODY_BYTES:
            self._server.bodies.note(self, len(request.body))  # until a thread has decoded the body
            self._answer_by_task(request, self._answer_to_large(request.body))
            return
        self._server.bodies.forget(self)
        value: Any = None
        try:
            value = self._call(request.body)
            if inspect.isawaitable(value):
                self._answer_by_task(request, self._answer_of(value))
                return
            document = encode_response(value, size_limit=LARGE_ANSWER)
        except ValueTooLarge:
            self._answer_by_task(request, self._in_worker(encode_response, value))
            return
        except Exception as error:
            document = self._fault(error)
        self._send(request, document)

    def _call(self, body: bytes | bytearray) -> Any:
        name, params = decode_call(body, limit_bytes=self._server.limits.body_bytes)
        return self._server.call(name, params, caller=self.caller)

    async def _answer_to_large(self, body: bytes | bytearray) -> bytes:
        decode = partial(decode_call, limit_bytes=self._server.limits.body_bytes)
        try:
            name, params = await self._in_worker(decode, body)
        finally:
            self._server.bodies.forget(self)
        return await self._answer_of(self._server.call(name, params, caller=self.caller))

    async def _answer_of(self, value: Any) -> bytes:
        if inspect.isawaitable(value):
            value = await value
        try:
            return encode_response(value, size_limit=LARGE_ANSWER)
        except ValueTooLarge:
            return await self._in_worker(encode_response, value)

    def _in_worker(self, function: Callable[[Any], T], value: Any) -> Awaitable[T]:
        """Run a function on a large value in a thread."""
        return self._loop.run_in_executor(self._server.large_values, function, value)

    def _answer_by_task(self, request: Request, answer: Awaitable[bytes]) -> None:
        self._pending = self._loop.create_task(self._answer_later(request, answer))
        self._note(RpcEvent.TASK_BEGAN)

    async def _answer_later(self, request: Request, answer: Awaitable[bytes]) -> None:
        try:
            document = await answer
        except Exception as error:
            document = self._fault(error)
        self._pending = None
        self._note(RpcEvent.TASK_DONE)
        self._send(request, document)
        self._continue()

    def _fault(self, error: Exception) -> bytes:
        if isinstance(error, ProtocolError):
            self._server.refusals.count(self.peer, str(error))
        elif not isinstance(error, UnknownMethod):
            _log.debug("a method raised for %s", self.peer, exc_info=error)
        return encode_fault(1, fault_text(error))

    def _send(self, request: Request, document: bytes) -> None:
        if self._transport is None:
            return
        asks_keep_alive = request.keep_alive and "connection" in request.headers
        head = response_head(len(document), keep_alive=request.keep_alive, send_keep_alive=asks_keep_alive)
        self._is_last_answer = not request.keep_alive
        if len(document) <= _SLICE_BYTES:
            self._transport.write(head + document)
        else:
            self._transport.write(head)
            self._unsent = memoryview(document)

    def _send_slice(self) -> None:
        """Send the next slice of a large response.

        Slices are needed because the transport copies any data that the socket does not accept.
        """
        if self._transport:
            piece, self._unsent = self._unsent[:_SLICE_BYTES], self._unsent[_SLICE_BYTES:]
            self._transport.write(piece)

    def _refuse(self, error: HttpError) -> None:
        self._server.refusals.count(self.peer, str(error))
        if self._transport:
            body = f"{error}\n".encode("utf-8", "replace")
            self._transport.write(build_response(body, status=error.status, keep_alive=False))
            if self._has_peer_ended:
                self._close_gracefully()
            else:
                self._note(RpcEvent.REQUEST_REFUSED)
                self._server.connections.clear_deadline(self)
                self._transport.write_eof()
                self._transport.resume_reading()
                self._pending = self._loop.call_later(_DRAIN_LIMIT_S, self.abort)

    def _close_gracefully(self) -> None:
        """Close after all written data has been sent, or after a deadline."""
        self._note(RpcEvent.CLOSED_GRACEFULLY)
        if self._transport:
            self._expect_progress()
            self._transport.close()


def fault_text(error: BaseException) -> str:
    """Format an exception as Python's XML-RPC server does, because scripts compare this text."""
    if isinstance(error, UnknownMethod):
        return f'{Exception}:method "{error}" is not supported'
    return f"{type(error)}:{error}"
