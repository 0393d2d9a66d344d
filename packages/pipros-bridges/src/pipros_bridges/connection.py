"""Connections of bridges that write frames without websockets' `send`; see `client`."""

from __future__ import annotations

import asyncio
import struct
import threading
from collections.abc import Callable, Sequence
from typing import Any, Final

from websockets.protocol import State

from pipros.net import sockets
from pipros.net.backlog import Backlog, Buffer
from pipros_bridges.outbox import WebSocketFrame
from pipros_bridges.shares import ClientShares
from pipros_server.port_connection import PortConnection

JOINED_BYTES: Final = 16 * 1024
"""Up to this size, copying the parts of a frame takes less time than another system call."""
CHUNK_BYTES: Final = 16 * 1024
"""Bytes of a large frame to pass to the transport when the socket is full, so that the transport reports when
there is room.
"""
ENCRYPTED_BYTES: Final = 256 * 1024
"""Like `CHUNK_BYTES`, for TLS connections, whose data always passes through the transport."""


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
