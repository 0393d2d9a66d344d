"""Connection to one client of a bridge. It sends the client's outbox as fast as the client reads.

Theory of operation. Outboxes are filled in any thread. `Wakeups` wakes the event loop once for several
outboxes with new frames. No task writes a client's frames: the event loop writes them until the socket buffer
is full, and again when asyncio reports that there is room. A connection whose buffer stays full is aborted if
the client reads nothing for `BRIDGE_STALL_S`. Frames bypass websockets' `send`, which copies a large message
twice and is several times slower for a small message, and `broadcast`, which does not report a full buffer.
Frame headers are therefore encoded here (unmasked, without extensions; RFC 6455). A large frame is sent
without copying it; while it is being written, control frames wait.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Final

from websockets.frames import CloseCode

from pipros.basics.limits import Limits
from pipros_bridges.connection import BridgeConnection, Wakeups
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import ClientOutbox, ClientTraffic, WebSocketFrame
from pipros_bridges.shares import ClientShares

BRIDGE_STALL_S = 10.0
"""Limit: the time after which a client that does not read from a full connection is disconnected. Beyond it,
the client is disconnected.
"""

TURN_BYTES: Final = 1024 * 1024
"""Number of bytes to write to one client before the other clients are served."""
FRAME_OVERHEAD_BYTES: Final = 8 * 1024
"""Overhead of writing a frame, as an equivalent number of bytes that count towards `TURN_BYTES`."""
CLOSING_S: Final = 1.0
"""Time (s) for a client to acknowledge that the connection is being closed."""
_LONGEST_REASON: Final = 120


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
        self._stall_s = BRIDGE_STALL_S
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
