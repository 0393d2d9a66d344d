"""Connection to one client of a bridge. It sends the client's outbox as fast as the client reads.

Theory of operation. Outboxes are filled in any thread. `Wakeups` wakes the event loop once for several
outboxes with new frames. No task writes a client's frames: the event loop writes them until the socket buffer
is full, and again when asyncio reports that there is room. A connection whose buffer stays full is aborted if
the client reads nothing for `bridge_stall_s`. Frames bypass websockets' `send`, which copies a large message
twice and is several times slower for a small message, and `broadcast`, which does not report a full buffer.
Frame headers are therefore encoded here (unmasked, without extensions; RFC 6455). A large frame is sent
without copying it; while it is being written, control frames wait.
"""

from __future__ import annotations

import asyncio
import struct
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from typing import Any, Final

from websockets.frames import CloseCode
from websockets.protocol import State

from pipros.basics.limits import Limits
from pipros.bridges.limits import BridgeLimits
from pipros.bridges.outbox import ClientOutbox, ClientTraffic, WebSocketFrame
from pipros.bridges.shares import ClientShares
from pipros.net import sockets
from pipros.net.backlog import Backlog, Buffer
from pipros.server.port import PortConnection

JOINED_BYTES: Final = 16 * 1024
"""Up to this size, copying the parts of a frame takes less time than another system call."""
CHUNK_BYTES: Final = 16 * 1024
"""Bytes of a large frame to pass to the transport when the socket is full, so that the transport reports when
there is room.
"""
ENCRYPTED_BYTES: Final = 256 * 1024
"""Like `CHUNK_BYTES`, for TLS connections, whose data always passes through the transport."""
TURN_BYTES: Final = 1024 * 1024
"""Number of bytes to write to one client before the other clients are served."""
FRAME_OVERHEAD_BYTES: Final = 8 * 1024
"""Overhead of writing a frame, as an equivalent number of bytes that count towards `TURN_BYTES`."""
CLOSING_S: Final = 1.0
"""Time (s) for a client to acknowledge that the connection is being closed."""
_LONGEST_REASON: Final = 120


class Wakeups:
    """Calls functions in an event loop on behalf of other threads, with one wake-up for several calls."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._due: list[Callable[[], object]] = []
        self._lock = threading.Lock()

    def wake(self, function: Callable[[], object]) -> None:
        """Schedule a call in the event loop. Do nothing if the loop has stopped. Thread-safe."""
        with self._lock:
            self._due.append(function)
            if len(self._due) > 1:
                return
        try:
            self._loop.call_soon_threadsafe(self._run)
        except RuntimeError:
            self._due.clear()

    def _run(self) -> None:
        with self._lock:
            due, self._due = self._due, []
        for function in due:
            function()


class BridgeConnection(PortConnection):
    """WebSocket connection that reports when its socket buffer is full and when it has room again.

    Attributes:
        is_page: whether the request was for the page.
        is_known: whether the request contained the token; True if no token is required.
        shares: the resources that the client may use, once it has been admitted; None for the page's clients.
        on_writable: called when the buffer is no longer full.
        on_full: called when the buffer becomes full.
        on_lost: called when the connection is lost.
    """

    is_page = False
    is_known = False
    shares: ClientShares | None = None
    on_writable: Callable[[], object] | None = None
    on_full: Callable[[], object] | None = None
    on_lost: Callable[[], object] | None = None
    _is_encrypted = False

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._rest = Backlog()  # unwritten part of the current large frame
        self._owner: object = None  # `WebSocketFrame.owner` of this frame

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._is_encrypted = transport.get_extra_info("ssl_object") is not None
        if not self._is_encrypted:  # with TLS, asyncio would pause even with an empty buffer
            self.transport.set_write_buffer_limits(high=0)

    def enter(self, shares: ClientShares) -> None:
        """Admit a client of a bridge. When the connection is lost, the client's shares are given back."""
        self.shares = shares
        self.admit(shares.input, shares.message_bytes)

    def connection_lost(self, exc: Exception | None) -> None:
        if self.shares is not None:
            self.shares.close()
        self._rest.clear()
        self._owner = None
        if self.on_lost is not None:
            self.on_lost()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        super().pause_writing()
        if self.on_full is not None:
            self.on_full()

    def resume_writing(self) -> None:
        super().resume_writing()
        # If a write failed within this call, asyncio would close the transport twice.
        self.loop.call_soon(self._resume)

    def _resume(self) -> None:
        self._write_rest()
        if self.on_writable is not None:
            self.on_writable()

    def send_data(self) -> None:
        """Write control frames, or leave them to `_write_rest` while a large frame is incomplete."""
        if not self._rest:
            super().send_data()

    @property
    def is_writable(self) -> bool:
        """Whether a frame may be written now."""
        is_free = not self.paused and not self._rest
        return is_free and self.protocol.state is State.OPEN and not self.transport.is_closing()

    def write(self, frame: WebSocketFrame) -> None:
        """Start writing a frame.

        Call only if `is_writable` is True. Afterwards, `is_writable` is False until the whole frame is
        written.
        """
        parts = (frame_head(frame.size, is_text=frame.is_text), *frame.parts)
        if frame.size <= JOINED_BYTES:
            self.transport.write(b"".join(parts))
            return
        self._owner = frame.owner
        self._rest.append_rest(parts, self._send_now(parts))
        self._write_rest()

    def _write_rest(self) -> None:
        """Write as much of a large frame as the socket accepts, and then the delayed control frames."""
        while self._rest and not self.paused:
            buffers = self._rest.next_buffers()
            sent = self._send_now(buffers)
            if not sent:  # the transport calls `resume_writing` when there is room again
                if self.transport.is_closing():
                    self._rest.clear()
                    return
                chunk = _first_bytes(buffers, ENCRYPTED_BYTES if self._is_encrypted else CHUNK_BYTES)
                self.transport.write(chunk)
                sent = len(chunk)
            self._rest.remove_sent(sent)
            if not self._rest:
                self._owner = None
                self.send_data()

    def _send_now(self, parts: Sequence[Buffer]) -> int:
        """Send as much as the socket accepts, without copying. Return the number of bytes sent."""
        if self._is_encrypted or self.transport.get_write_buffer_size():
            return 0
        try:
            return sockets.send_gathered(self._accepted_socket, parts)
        except OSError:  # the socket is full or broken; the transport's next write handles both cases
            return 0


def _first_bytes(buffers: Sequence[Buffer], max_bytes: int) -> bytes:
    """Return a copy of the first bytes of several buffers."""
    pieces: list[memoryview] = []
    for buffer in buffers:
        pieces.append(memoryview(buffer)[:max_bytes])
        max_bytes -= len(pieces[-1])
    return b"".join(pieces)


def frame_head(size: int, *, is_text: bool) -> bytes:
    """Return the header of an unmasked, final WebSocket frame."""
    first = 0x81 if is_text else 0x82
    if size < 126:
        return struct.pack("!BB", first, size)
    if size < 1 << 16:
        return struct.pack("!BBH", first, 126, size)
    return struct.pack("!BBQ", first, 127, size)


class BridgeClient:
    """One connected client. Call methods from the event loop unless they are documented as thread-safe.

    Attributes:
        number: distinguishes this client from all other clients of the server.
        protocol: the WebSocket subprotocol, or the protocol's name if there is no subprotocol.
        address: IP address and port.
        agent: the `User-Agent` header, or an empty string.
        outbox: data for the client; thread-safe.
        shares: the resources that the client may use.
        received: number and size of the messages from the client.
        host: IP address.
        active_s: time of the last message from the client, or of the connection; monotonic.
    """

    def __init__(
        self,
        connection: BridgeConnection,
        number: int,
        protocol: str,
        limits: Limits,
        wakeups: Wakeups,
        shares: ClientShares,
    ) -> None:
        self.number = number
        self.protocol = protocol
        host, port = connection.remote_address[:2]
        self.address = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        self.agent = connection.request.headers.get("User-Agent", "") if connection.request else ""
        self.shares = shares
        self.outbox = ClientOutbox(
            limits.of(BridgeLimits).bridge_queue_bytes, lambda: wakeups.wake(self._flush), shares.queue
        )
        self.received = ClientTraffic()
        self.host = host
        self.active_s = time.monotonic()
        self._connection = connection
        self._stall_s = limits.of(BridgeLimits).bridge_stall_s
        self._loop = asyncio.get_running_loop()
        self._frames: deque[WebSocketFrame] = deque()  # remaining frames of the current message
        self._watch: asyncio.TimerHandle | None = None
        self._turn = asyncio.Lock()
        self._sent = asyncio.Event()  # set while no response waits or is being written
        self._is_lost = False
        self._ending: asyncio.Task[None] | None = None
        connection.on_writable = self._flush
        connection.on_full = self._watch_progress
        connection.on_lost = self._note_lost

    def send(self, *frames: WebSocketFrame) -> None:
        """Send a response, or another message that must not be dropped. Thread-safe."""
        self.outbox.answer(*frames)

    async def send_large(self, make: Callable[[], Awaitable[WebSocketFrame]]) -> None:
        """Send a response that may be large, once all other responses have been written.

        Large responses are created and sent one at a time. Therefore, they never overrun the outbox, and at
        most one of them is in memory, even if a client requests many responses and does not read them.
        """
        async with self._turn:
            while not self._is_lost and (self.outbox.has_answers or self._is_writing):
                self._sent.clear()
                await self._sent.wait()
            if not self._is_lost:
                self.outbox.answer(await make())

    @property
    def _is_writing(self) -> bool:
        return bool(self._frames) or not self._connection.is_writable

    @property
    def has_left(self) -> bool:
        """Whether the client can no longer receive anything; some of its messages may still be unhandled."""
        return self._is_lost or self._connection.has_left

    def _note_lost(self) -> None:
        self._is_lost = True
        self.outbox.close()
        self._sent.set()

    def end(self, reason: str, code: int = CloseCode.POLICY_VIOLATION) -> None:
        """Disconnect the client, with a reason that it can display. Does not block."""
        if self._ending is None:
            self.outbox.close()
            self._ending = asyncio.create_task(self._connection.close(code, _shortened(reason)))
            self._loop.call_later(CLOSING_S, self._connection.transport.abort)

    async def replace(self) -> None:
        """Disconnect the client to make room for another client. Return once it is disconnected."""
        self.end("This connection was closed to make room for a new client.", CloseCode.TRY_AGAIN_LATER)
        await self._connection.wait_closed()

    def close(self) -> None:
        """Discard all queued data after the connection has closed."""
        self.outbox.close()
        self._connection.on_writable = self._connection.on_full = None
        if self._watch is not None:
            self._watch.cancel()

    def _flush(self) -> None:
        if self.outbox.is_overrun:
            self.end("This client has too many unread responses.", CloseCode.TRY_AGAIN_LATER)
            return
        self._write_frames()
        if not (self._sent.is_set() or self._is_writing or self.outbox.has_answers):
            self._sent.set()

    def _write_frames(self) -> None:
        connection, frames = self._connection, self._frames
        left = TURN_BYTES
        while connection.is_writable:
            if not frames:
                popped = self.outbox.pop()
                if not popped:
                    return
                frames.extend(popped)
            frame = frames.popleft()
            connection.write(frame)
            left -= frame.size + FRAME_OVERHEAD_BYTES
            if left < 0:
                self._loop.call_soon(self._flush)
                return

    def _watch_progress(self) -> None:
        """Abort the connection if the buffer stays full and the client reads nothing."""
        if self._watch is not None:
            self._watch.cancel()
        size = self._connection.transport.get_write_buffer_size()
        self._watch = self._loop.call_later(self._stall_s, self._check_progress, size)

    def _check_progress(self, size_before: int) -> None:
        self._watch = None
        if self._connection.paused:
            if self._connection.transport.get_write_buffer_size() >= size_before:
                self._connection.transport.abort()
            else:
                self._watch_progress()


def _shortened(text: str) -> str:
    """Return a close reason, truncated to fit into a close frame."""
    return text.encode()[:_LONGEST_REASON].decode(errors="ignore")
