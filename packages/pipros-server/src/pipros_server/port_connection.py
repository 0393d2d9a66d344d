"""A WebSocket connection with limits on the data that it holds for its client.

Theory of operation. Until a client is admitted, it may send up to `LOGIN_BYTES`. Afterwards, all data that
has been read but not handled counts against the client's budget: the beginning of an incomplete frame, the
frames of an incomplete message, each with its overhead, and complete messages. If more than
`READ_AHEAD_BYTES` are complete, the connection is not read until at most half as many are left. An incomplete
message must grow by a MiB, or end, within `request_s`. A client that exceeds its budget is disconnected; the
close frame contains the reason.

The time for parsing depends far more on the number of frames than on their size, and a single read can
contain 40,000 frames. Data is therefore parsed in parts, which are small if the last part had many frames.
After a part that took long, the connection rests for `RESTS` times as long, so that other clients are served,
and for a while the parts of all connections are small, because twenty clients can send such data at the same
moment. Rests have a maximum duration, because a part may have taken long only because Python collected
garbage meanwhile. After short parts that together took long, only the other clients have their turn. All
parts, with the pongs that they require, count as work of the client's `LoopShare`, and a connection that has
used its share rests, too.
"""

from __future__ import annotations

import asyncio
import math
import socket
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Final

from websockets.asyncio.server import ServerConnection
from websockets.frames import DATA_OPCODES, CloseCode, Frame, Opcode

from pipros.basics.budget import Budget
from pipros.net import sockets
from pipros_server.listener import AcceptedSocket, Listener
from pipros_server.loop_share import BURST_S, LoopShare, LoopShares

CLOSING_S: Final = 0.2
"""Time (s) for clients to acknowledge the closing of connections, and again for the server's tasks to end."""
UNSENT_BYTES: Final = 131_072
"""Maximum number of unsent bytes in the kernel. With more, browsers on slow links would show old views."""
FRAME_BYTES: Final = 300
"""Memory of a frame besides its data. It is counted, because empty frames could fill the memory."""
READ_AHEAD_BYTES: Final = 256 * 1024
"""Maximum size of the complete messages that are read before earlier messages have been handled."""
_UNCOUNTED_BYTES: Final = 16 * 1024
WRITE_BYTES: Final = 64 * 1024
"""Unsent bytes after which the server waits until the client has read, before it sends more."""
PONG_BYTES: Final = 256 * 1024
"""Maximum size of the pongs for a client that does not read. They are sent without waiting."""
PART_BYTES: Final = 16 * 1024
"""Size of the parts in which received data is parsed."""
SMALL_PART_BYTES: Final = 2 * 1024
FEW_FRAMES: Final = 16
"""After a part with more frames, the next part is small."""
SMALL_PARTS_S: Final = 10.0
"""Time for which parts are small after a part took long."""
LONG_S: Final = 0.005
"""A part takes long if it needs more processor time than this. A frame of 64 kB needs a hundredth of it."""
RESTS: Final = 40
MAX_REST_S: Final = 1.0
_GROWTH_BYTES: Final = 1024 * 1024


class PartSize:
    """Size of the parts in which received data is parsed. Shared by all connections of a port."""

    def __init__(self) -> None:
        self._small_until_s = -math.inf

    def current_bytes(self, now_s: float) -> int:
        return SMALL_PART_BYTES if now_s < self._small_until_s else PART_BYTES

    def note_long_part(self, now_s: float) -> None:
        self._small_until_s = now_s + SMALL_PARTS_S


class PortConnection(ServerConnection):
    """Connection whose client can send only a few bytes before it is admitted.

    Attributes:
        held_bytes: the data that has been read but not handled, with the overhead of its frames.
        share: the client's share of the event loop.
    """

    def __init__(
        self,
        listener: Listener,
        limit_bytes: int,
        *args: Any,
        part_size: PartSize | None = None,
        shares: LoopShares | None = None,
        request_s: float = math.inf,
        work_clock: Callable[[], float] = time.thread_time,
        **options: Any,
    ) -> None:
        super().__init__(*args, **options)
        self._work_clock = work_clock
        self._part_size = part_size or PartSize()
        self.share = LoopShare(shares or LoopShares())
        self._unparsed = b""  # received, but not parsed until the pause ends
        self._frames = FEW_FRAMES + 1  # of the last part
        self._is_resting = False
        self._listener = listener
        self._bytes_left: float = limit_bytes
        self._accepted_socket: AcceptedSocket
        self._input: Budget | None = None
        self._message_bytes: float = math.inf
        self._request_s = request_s
        self.held_bytes = 0
        self._counted_bytes = 0  # the part of `held_bytes` that counts against the budget
        self._begun_bytes = 0  # complete frames of an incomplete message
        self._complete: deque[int] = deque()  # sizes of complete messages
        self._waiting_bytes = 0  # sum of these sizes
        self._handled_bytes = 0  # the message that is being handled
        self._deadline: asyncio.TimerHandle | None = None
        self._messages = 0
        self._pong_bytes = 0  # pongs since the client last kept up with reading
        self._is_reading = True
        self._is_cut = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._accepted_socket = self._listener.accepted_socket(transport)
        self._accepted_socket.set_transport(transport)
        option = getattr(socket, "TCP_NOTSENT_LOWAT", None)  # not available on Windows
        if option is not None:
            self._accepted_socket.setsockopt(socket.IPPROTO_TCP, option, UNSENT_BYTES)
        super().connection_made(transport)

    def data_received(self, data: bytes) -> None:
        self._bytes_left -= len(data)
        if self._bytes_left < 0:
            self._accepted_socket.abort()
        elif self._is_resting:
            self._unparsed += data
        elif not self._is_cut:
            self._parse(data)

    def _parse(self, data: bytes) -> None:
        """Parse received data. If this takes long, parse only a part now, and the rest after a pause."""
        position, turn_s = 0, 0.0
        while position < len(data) and not self._is_cut and not self._is_resting:
            has_many_frames = self._frames > FEW_FRAMES
            size = SMALL_PART_BYTES if has_many_frames else self._part_size.current_bytes(self.loop.time())
            part = data[position : position + size]
            position += len(part)
            self._frames = 0
            began_s = self._work_clock()
            super().data_received(part)
            work_s = self._work_clock() - began_s
            self.share.note(min(work_s, BURST_S))
            turn_s += work_s
            rest_s = max(self.share.pause_s(), 0.0)
            if work_s > LONG_S:
                self._part_size.note_long_part(self.loop.time())
                rest_s = max(rest_s, work_s * RESTS)
            if rest_s > 0 or turn_s > LONG_S:
                self._unparsed = data[position:]
                self._rest_for(min(rest_s, MAX_REST_S))
            if self._input is not None:
                self._check_input()

    def _rest_for(self, seconds: float) -> None:
        self._is_resting = True
        self.transport.pause_reading()
        self.loop.call_later(seconds, self._go_on)

    def _go_on(self) -> None:
        self._is_resting = False
        if self._is_cut:
            return
        data, self._unparsed = self._unparsed, b""
        self._parse(data)
        self._read_on()

    def _read_on(self) -> None:
        if self._is_reading and not self._is_resting and not self._is_cut:
            self.transport.resume_reading()

    def send_data(self) -> None:
        """Write pongs and control frames. Discard them if the connection is lost; asyncio would log each."""
        if self.transport.is_closing():
            self.protocol.data_to_send()
        else:
            super().send_data()

    def process_event(self, event: Any) -> None:
        super().process_event(event)
        self._frames += 1
        if isinstance(event, Frame) and event.opcode in DATA_OPCODES:
            self._begun_bytes += len(event.data) + FRAME_BYTES
            if event.fin:
                self._complete.append(self._begun_bytes)
                self._waiting_bytes += self._begun_bytes
                self._messages += 1
                self._begun_bytes = 0
        elif isinstance(event, Frame) and event.opcode is Opcode.PING:
            if self.transport.get_write_buffer_size() <= WRITE_BYTES:
                self._pong_bytes = 0
            self._pong_bytes += len(event.data) + FRAME_BYTES
            if self._pong_bytes > PONG_BYTES:
                self.cut("The client sends pings but does not read the pongs.", CloseCode.POLICY_VIOLATION)

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message. Until the next call, the message counts as being handled."""
        self._handled_bytes = 0
        if self._counted_bytes:
            self._count_input()
        message = await super().recv(decode)
        self._handled_bytes = self._complete.popleft()
        self._waiting_bytes -= self._handled_bytes
        if not self._is_reading and self._waiting_bytes <= READ_AHEAD_BYTES // 2 and not self._is_cut:
            self._is_reading = True
            self._read_on()
        return message

    def connection_lost(self, exc: Exception | None) -> None:
        self._is_cut = True
        if self._deadline is not None:
            self._deadline.cancel()
        self.share.close()
        super().connection_lost(exc)

    def cut(self, reason: str, code: int = CloseCode.TRY_AGAIN_LATER) -> None:
        """Disconnect the client with a reason, and ignore further data. Does not block."""
        if not self._is_cut:
            self._is_cut = True
            self.transport.pause_reading()
            self._ending = asyncio.ensure_future(self.close(code, reason))
            self.loop.call_later(CLOSING_S, self.transport.abort)

    @property
    def _incomplete_bytes(self) -> int:
        return self._begun_bytes + len(self.protocol.reader.buffer)

    def _check_input(self) -> None:
        """Apply the limits after new data has arrived."""
        incomplete = self._incomplete_bytes
        if incomplete > self._message_bytes:
            reason = f"A message exceeds {self._message_bytes} bytes, with {FRAME_BYTES} for each frame."
            self.cut(reason, CloseCode.MESSAGE_TOO_BIG)
        elif not self._count_input():
            self.cut("Incomplete or unhandled messages exceed the memory for this client.")
        elif self._waiting_bytes > READ_AHEAD_BYTES and self._is_reading:
            self._is_reading = False
            self.transport.pause_reading()
        if incomplete and self._deadline is None and self._request_s < math.inf:
            self._set_deadline()

    def _count_input(self) -> bool:
        """Count the data that is held now. Return False if it exceeds the budget."""
        unhandled = len(self._unparsed) + self._incomplete_bytes + self._waiting_bytes
        self.held_bytes = unhandled + self._handled_bytes
        counted = self.held_bytes if self.held_bytes > _UNCOUNTED_BYTES else 0
        if counted == self._counted_bytes or self._input is None:
            return True
        if not self._input.hold(self._counted_bytes, counted):
            return False
        self._counted_bytes = counted
        return True

    def _set_deadline(self) -> None:
        progress = self._messages, self._incomplete_bytes // _GROWTH_BYTES
        self._deadline = self.loop.call_later(self._request_s, self._check_progress, progress)

    def _check_progress(self, before: tuple[int, int]) -> None:
        """Disconnect the client if its incomplete message has not grown enough."""
        self._deadline = None
        if not self._incomplete_bytes or self._is_cut:
            return
        if before == (self._messages, self._incomplete_bytes // _GROWTH_BYTES) and self._is_reading:
            self.cut("The rest of a message did not arrive in time.", CloseCode.POLICY_VIOLATION)
        else:
            self._set_deadline()

    @property
    def has_left(self) -> bool:
        """Whether the client has closed the connection while it was not being read.

        While a connection is not read, asyncio does not report its end.
        """
        return not self._is_reading and sockets.has_left(self._accepted_socket)

    def note_request(self) -> None:
        """Cancel the deadline, because the request has arrived."""
        self._accepted_socket.note_request()

    def admit(self, input: Budget, message_bytes: int) -> None:  # noqa: A002
        """Replace the limits on unauthenticated clients, because this client has authenticated.

        Args:
            input: the memory for the data that the server holds for the client.
            message_bytes: maximum size of a message.
        """
        self._accepted_socket.admit()
        self._bytes_left = math.inf
        self._input = input
        self._message_bytes = message_bytes + _UNCOUNTED_BYTES
