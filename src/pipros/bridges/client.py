"""The connection of one client of a bridge: writes what its outbox holds, as fast as the client reads.

Theory of operation. `Outbox` wakes the event loop, once for all clients. A client's frames are written
without a task: until its connection is full, and again when asyncio says that there is room. A connection
that stays full without any progress is aborted after `bridge_stall_s`. Frames go to the transport directly:
`send` of websockets would copy a large message twice and take several times as long for a small one, and
`broadcast` would not say when to stop. (The head of a frame without mask and extensions, by RFC 6455, is
three lines.)
"""

from __future__ import annotations

import asyncio
import struct
import threading
from collections.abc import Callable
from typing import Final

from websockets.frames import CloseCode
from websockets.protocol import State

from pipros.basics.limits import Limits
from pipros.bridges.outbox import Frame, Outbox, Traffic
from pipros.web.server_port import PortConnection

JOINED_BYTES: Final = 16 * 1024
"""Up to this size, copying the parts of a frame takes less time than another system call."""
TURN_BYTES: Final = 1024 * 1024
"""Bytes that a client is written before other clients have their turn."""
CLOSING_S: Final = 1.0
"""Time for a client to acknowledge that it is disconnected."""
_LONGEST_REASON: Final = 120


class Wakeups:
    """Calls functions in an event loop for other threads, with one wake-up for many of them."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._due: list[Callable[[], object]] = []
        self._lock = threading.Lock()

    def wake(self, function: Callable[[], object]) -> None:
        """Call a function in the event loop soon. Does nothing if the loop has ended. Thread-safe."""
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
    """Connection that says when it has room.

    Attributes:
        is_page: whether it serves the page.
        is_known: whether the request contained the token, or none is required.
        on_room: called when the connection is no longer full.
        on_full: called when it is full.
    """

    is_page = False
    is_known = False
    on_room: Callable[[], object] | None = None
    on_full: Callable[[], object] | None = None

    def pause_writing(self) -> None:
        super().pause_writing()
        if self.on_full is not None:
            self.on_full()

    def resume_writing(self) -> None:
        super().resume_writing()
        if self.on_room is not None:
            self.on_room()

    @property
    def has_room(self) -> bool:
        """Whether a frame may be written now."""
        return not self.paused and self.protocol.state is State.OPEN and not self.transport.is_closing()

    def write(self, frame: Frame) -> None:
        """Write a frame. Only while `has_room`, or to complete a message."""
        head = frame_head(frame.size, is_text=frame.is_text)
        if frame.size <= JOINED_BYTES:
            self.transport.write(b"".join((head, *frame.parts)))
            return
        *before, last = frame.parts
        self.transport.write(b"".join((head, *before)))
        self.transport.write(last)


def frame_head(size: int, *, is_text: bool) -> bytes:
    """Return the head of an unmasked, final WebSocket frame."""
    first = 0x81 if is_text else 0x82
    if size < 126:
        return struct.pack("!BB", first, size)
    if size < 1 << 16:
        return struct.pack("!BBH", first, 126, size)
    return struct.pack("!BBQ", first, 127, size)


class Client:
    """One connected client. Methods are for the event loop, unless they say otherwise.

    Attributes:
        number: distinguishes it from all other clients of the server.
        protocol: its subprotocol, or the name of the protocol that it speaks.
        address: IP address and port.
        agent: its `User-Agent`, or an empty string.
        outbox: data for the client; thread-safe.
        received: what the client has sent.
    """

    def __init__(
        self, connection: BridgeConnection, number: int, protocol: str, limits: Limits, wakeups: Wakeups
    ) -> None:
        self.number = number
        self.protocol = protocol
        host, port = connection.remote_address[:2]
        self.address = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        self.agent = connection.request.headers.get("User-Agent", "") if connection.request else ""
        self.outbox = Outbox(limits.bridge_queue_bytes, lambda: wakeups.wake(self._flush))
        self.received = Traffic()
        self._connection = connection
        self._stall_s = limits.bridge_stall_s
        self._loop = asyncio.get_running_loop()
        self._watch: asyncio.TimerHandle | None = None
        self._turn = asyncio.Lock()
        self._sent: asyncio.Future[None] | None = None  # set once no answer waits
        self._ending: asyncio.Task[None] | None = None
        connection.on_room = self._flush
        connection.on_full = self._watch_progress

    def send(self, *frames: Frame) -> None:
        """Send an answer, or another message that must not get lost. Thread-safe."""
        self.outbox.answer(*frames)

    async def send_large(self, frame: Frame) -> None:
        """Send an answer that may be large, after all others have been sent.

        Several wait for their turn, so that they never overrun the outbox.
        """
        async with self._turn:
            while self.outbox.has_answers:
                self._sent = self._loop.create_future()
                await self._sent
            self.outbox.answer(frame)

    def end(self, reason: str, code: int = CloseCode.POLICY_VIOLATION) -> None:
        """Disconnect the client, with a reason that it can show. Does not wait."""
        if self._ending is None:
            self.outbox.close()
            self._ending = asyncio.create_task(self._connection.close(code, _shortened(reason)))
            self._loop.call_later(CLOSING_S, self._connection.transport.abort)

    def close(self) -> None:
        """Forget everything that waits: the connection has ended."""
        self.outbox.close()
        self._connection.on_room = self._connection.on_full = None
        if self._watch is not None:
            self._watch.cancel()

    def _flush(self) -> None:
        if self.outbox.is_overrun:
            self.end("Too many answers wait for this client.", CloseCode.TRY_AGAIN_LATER)
            return
        connection = self._connection
        left = TURN_BYTES
        while connection.has_room:
            frames = self.outbox.pop()
            if frames is None:
                return
            for frame in frames:
                connection.write(frame)
                left -= frame.size
            if self._sent is not None and not self._sent.done() and not self.outbox.has_answers:
                self._sent.set_result(None)
            if left < 0:
                self._loop.call_soon(self._flush)
                return

    def _watch_progress(self) -> None:
        """Abort the connection if it stays full, and nothing more is read from it."""
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
    """Return as much of a text as fits into a closing frame."""
    return text.encode()[:_LONGEST_REASON].decode(errors="ignore")
