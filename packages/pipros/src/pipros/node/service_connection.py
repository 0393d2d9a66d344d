"""One client's connection to a service server.

Theory of operation. At any moment, a connection has one of these owners:

- the event loop, while it waits for a request without using a thread;
- a worker thread, while it handles a call. Before the call, and after the reply to a client that keeps its
  connection, the thread waits up to `THREAD_WAIT_S` for the next request, because it can handle that request
  much sooner than the event loop could. At most `WAITING_THREADS` threads of a node wait in this way,
  regardless of the number of connections;
- the event loop, while it sends the rest of a reply that the client did not read at once.

The owner closes the connection. Other threads `abort` it, and the owner closes it soon after.

A Unix stream stays open after a reply, for the client's next call, because connecting costs both ends several
times as much as the call. After `KEPT_S` without a request, or to make room for other clients, the server
closes the stream for receiving. On a Unix stream this is atomic: a request that was sent before is answered,
and sending a later request fails, so the client can use a new connection, and no call runs twice.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Protocol

from pipros.basics.budget import Slots
from pipros.basics.errors import ProtocolError
from pipros.net import local_stream, sockets
from pipros.net.busy_poll import REPLY_POLL_S, PollingReceiver
from pipros.net.connection_table import ConnectionTable
from pipros.net.held_bytes import HeldBytes
from pipros.net.loop import BackgroundLoop
from pipros.net.tcpros import TcprosConnection
from pipros.wire.messages import MessageReader

KEPT_S = 5.0
"""How long a Unix stream stays open without a request."""

THREAD_WAIT_S = 0.05
"""How long a thread waits for a request, or for room for a reply, before the event loop takes over."""

SEND_S = 0.5
"""How long a thread keeps sending a reply to a client that reads it slowly."""

WAITING_THREADS = 8
"""Maximum number of a node's connections that have a thread waiting for a request."""

PROGRESS_BYTES = 1024 * 1024
"""A peer that sends or reads this many bytes gets another `WHOLE_REQUEST_S` for the rest."""

_TURN_BYTES = 256 * 1024
"""Maximum number of bytes that the event loop reads from one connection in one turn."""

_FLOWING_BYTES = 4 * 1024
"""A thread keeps waiting for a client that sends or reads at least this many bytes at a time."""

_HELD_STEP_BYTES = 64 * 1024
"""An incomplete request is counted again after every step of this size. Smaller requests are not counted."""

_PIECES = 8
"""Maximum number of pieces smaller than `_FLOWING_BYTES` that a thread waits for, per request."""

_pack_reply = struct.Struct("<BI").pack

Reply = tuple[bool, Sequence[bytes | memoryview]]
"""Whether the call succeeded, and the response or the error text."""


class Server(Protocol):
    """The attributes and methods of a service server that its connections use.

    A protocol because its implementation, `ServiceServer`, imports this module.

    Attributes:
        loop: the event loop in which its connections wait.
        connections: the table of all the node's connections.
        waiting_threads: slots for the threads that wait for a request.
        unread: the reply bytes that clients have not read.
        incomplete: the bytes of requests whose rest has not arrived; for use in the event loop.
        request_s, frame_bytes: see `Limits`.
        is_closed: whether the server has stopped answering calls.
    """

    loop: BackgroundLoop
    connections: ConnectionTable
    waiting_threads: Slots
    unread: HeldBytes
    incomplete: HeldBytes
    request_s: float
    frame_bytes: int
    is_closed: bool

    def run(self, serve: Callable[[], None]) -> bool:
        """Call `serve` in a worker thread as soon as one is free. Return False if none can be started."""

    def answer(self, data: memoryview | bytes, fields: Mapping[str, str]) -> Reply | None:
        """Answer one call. Return None if the request was malformed and the connection must be closed."""

    def forget(self, connection: ServiceConnection) -> None:
        """Forget a connection that has been closed."""


class ServiceConnection:
    """Waits for one client's requests, passes them to the server, and sends the replies."""

    __slots__ = (
        "_buffer",
        "_fields",
        "_held_bytes",
        "_idle_timer",
        "_is_answered",
        "_is_ended",
        "_is_local",
        "_moved",
        "_poller",
        "_request",
        "_requests",
        "_server",
        "_sock",
        "_unsent",
        "is_persistent",
        "last_used",
        "peer",
    )

    def __init__(self, connection: TcprosConnection, server: Server) -> None:
        self.peer = connection.peer
        self.last_used = 0.0
        self.is_persistent = connection.fields.get("persistent") == "1"
        self._is_local = local_stream.is_local(connection.sock)
        self._idle_timer: asyncio.TimerHandle | None = None
        self._sock = connection.sock
        self._fields = connection.fields
        self._server = server
        self._poller = PollingReceiver(REPLY_POLL_S)
        self._buffer = MessageReader(server.frame_bytes)
        self._requests: Iterator[memoryview | bytes] = self._buffer.feed(connection.rest)
        self._request: memoryview | bytes | None = None  # the next request, if the event loop has received it
        self._unsent = memoryview(b"")
        self._is_answered = False
        self._is_ended = False
        self._moved = 0
        self._held_bytes = 0  # the part of an incomplete request that `Server.incomplete` counts

    def start(self, unsent: bytes) -> None:
        """Start serving; `unsent` is the rest of the reply header. Called from the event loop."""
        self._unsent = memoryview(unsent)
        if not self.is_persistent:
            self._expect_progress()
        if self._unsent:
            self._send_in_loop()
        elif self._server.waiting_threads.try_acquire():
            self._have_served(self._wait_and_serve)
        else:
            self._continue()

    def abort(self) -> None:
        """End the connection to make room for others; its owner closes it.

        A call that the client has already sent over a Unix stream is still answered. May be called
        repeatedly, from any thread.
        """
        self._is_ended = True
        if self._is_local and not self._unsent:
            with contextlib.suppress(OSError):  # the client has disconnected
                self._sock.shutdown(socket.SHUT_RD)
        else:
            self.end()

    def end(self) -> None:
        """End the connection at once; its owner closes it. May be called repeatedly, from any thread."""
        self._is_ended = True
        sockets.abort(self._sock)

    # -- in a worker thread -------------------------------------------------------

    def _wait_and_serve(self) -> None:
        self._serve(waits=True)

    def _serve(self, *, waits: bool = False) -> None:
        """Answer calls as long as they arrive in quick succession.

        If `waits` is true, wait for the first call; a slot of `waiting_threads` was acquired for this wait.
        """
        server = self._server
        is_held = is_handed_over = False
        try:
            while (request := self._next_request(THREAD_WAIT_S if waits else 0.0)) is not None:
                if waits:
                    server.waiting_threads.release()
                    waits = False
                if not is_held:
                    is_held = True
                    server.connections.mark_busy(self)
                reply = server.answer(request, self._fields)
                if reply is None:
                    return
                if not self._send(reply):
                    is_handed_over = self._hand_over(self._send_in_loop)
                    return
                if not self._stays_open:
                    return
                waits = server.waiting_threads.try_acquire()
            is_handed_over = self._hand_over(self._wait_in_loop)
        except (OSError, ProtocolError):
            pass  # the client has disconnected or violated the protocol; only its own connection ends
        finally:
            if waits:
                server.waiting_threads.release()
            if not is_handed_over:
                self.close()

    def _hand_over(self, proceed: Callable[[], None]) -> bool:
        """Pass the connection to the event loop, which calls `proceed`.

        Return False if the loop is shutting down.
        """
        if self._server.is_closed:
            return False
        self._server.loop.call(proceed)
        return True

    def _next_request(self, wait_s: float) -> memoryview | bytes | None:
        """Return the next request, or None if it does not arrive in time.

        Raises:
            OSError: the connection has ended.
            LimitExceeded: the request is too large.
        """
        request, self._request = self._request, None
        if request is None:
            request = next(self._requests, None)
        pieces = 0
        while request is None:
            count = self._poller.receive_with_timeout(self._sock, self._buffer.space(), wait_s)
            if count is None:
                return None
            if not count:
                raise ConnectionResetError("the client has closed the connection")
            self._requests = self._buffer.received(count)
            request = next(self._requests, None)
            if request is None:
                self._note_incomplete()
            if count >= _FLOWING_BYTES:
                self._note_progress(count)
            elif request is None and (pieces := pieces + 1) == _PIECES:
                return None
        self._note_complete()
        return request

    def _send(self, reply: Reply) -> bool:
        """Send a reply; return False if the client does not read it at once."""
        is_success, body = reply
        self._is_answered = True
        data = b"".join((_pack_reply(is_success, sum(map(len, body))), *body))
        try:
            sent = self._sock.send(data)
        except BlockingIOError:  # the client has not read the previous bytes
            sent = 0
        if sent == len(data):
            return True
        self._unsent = memoryview(data)[sent:]
        end = time.monotonic() + SEND_S
        while time.monotonic() < end and sockets.wait_writable(self._sock, THREAD_WAIT_S):
            sent = self._sock.send(self._unsent)
            self._unsent = self._unsent[sent:]
            if not self._unsent:
                return True
            if sent < _FLOWING_BYTES:
                break
        return False

    # -- in the event loop ----------------------------------------------------------

    def _have_served(self, serve: Callable[[], None]) -> None:
        if not self._server.run(serve):
            if serve == self._wait_and_serve:
                self._server.waiting_threads.release()
            self.close()

    def _continue(self) -> None:
        """Pass the next request to a worker if it has arrived; otherwise wait for it."""
        try:
            self._request = next(self._requests, None)
        except ProtocolError:
            self.close()
            return
        if self._request is None:
            self._wait_in_loop()
        else:
            self._server.connections.mark_busy(self)
            self._have_served(self._serve)

    def _wait_in_loop(self) -> None:
        self._server.connections.mark_used(self)
        if self._buffer.has_partial_message:
            self._expect_progress()
        else:
            self._buffer.trim()
            if self._is_local and self._is_answered and not self.is_persistent:
                self._idle_timer = self._server.loop.asyncio.call_later(KEPT_S, self.abort)
        self._server.loop.asyncio.add_reader(self._sock.fileno(), self._read)

    def _read(self) -> None:
        """Read part of a request. Pass the request to a worker once it is complete."""
        if self._idle_timer is not None:
            self._idle_timer.cancel()
            self._idle_timer = None
        try:
            count = self._sock.recv_into(self._buffer.space()[:_TURN_BYTES])
            if count:
                self._requests = self._buffer.received(count)
                self._request = next(self._requests, None)
        except (BlockingIOError, InterruptedError):
            return
        except (OSError, ProtocolError):
            count = 0
        if count and self._request is None:
            self._note_incomplete()
            self._note_progress(count)
            return
        self._server.loop.asyncio.remove_reader(self._sock.fileno())
        if count:
            self._server.connections.mark_busy(self)
            self._have_served(self._serve)
        else:
            self.close()

    def _send_in_loop(self) -> None:
        """Send the rest of a reply as the client reads it, until a deadline."""
        self._server.connections.mark_used(self)
        self._expect_progress()
        self._server.unread.note(self, len(self._unsent))
        self._server.loop.asyncio.add_writer(self._sock.fileno(), self._write)

    def _write(self) -> None:
        is_broken = False
        try:
            sent = self._sock.send(self._unsent[:_TURN_BYTES])
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            sent, is_broken = 0, True
        self._unsent = self._unsent[sent:]
        self._note_progress(sent)
        if self._unsent and not is_broken:
            return
        self._server.loop.asyncio.remove_writer(self._sock.fileno())
        self._server.unread.forget(self)
        if is_broken or (self._is_answered and not self._stays_open):
            self.close()
            return
        if self._stays_open:
            self._server.connections.clear_deadline(self)
        self._unsent = memoryview(b"")
        self._continue()

    @property
    def _stays_open(self) -> bool:
        return self.is_persistent or self._is_local

    # -- in either thread --------------------------------------------------------------------

    def _note_progress(self, count: int) -> None:
        """Count transferred bytes. Extend the deadline if the client is fast enough."""
        self._moved += count
        if self._moved >= PROGRESS_BYTES:
            self._moved = 0
            self._server.connections.clear_deadline(self)
        self._expect_progress()

    def _note_incomplete(self) -> None:
        """Count an incomplete request, which may be closed if all of them together are too large."""
        size = self._buffer.partial_bytes
        if size - self._held_bytes >= _HELD_STEP_BYTES and not self._is_ended:
            self._held_bytes = size
            self._server.loop.call(self._server.incomplete.note, self, size)

    def _note_complete(self) -> None:
        if self._held_bytes:
            self._held_bytes = 0
            self._server.loop.call(self._server.incomplete.forget, self)

    def _expect_progress(self) -> None:
        self.last_used = time.monotonic()
        self._server.connections.set_deadline(self, self.last_used + self._server.request_s)

    def close(self) -> None:
        """Close the connection. Only its owner may call this."""
        self._sock.close()
        self._note_complete()
        self._server.connections.remove(self)
        self._server.forget(self)
