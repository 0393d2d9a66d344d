"""The receiving end of one TCPROS topic link: a thread that reads, keeps the newest, delivers.

Theory of operation. One thread a link receives large chunks, cuts all complete frames and calls
`deliver` for each itself, so that the common message has no hand-over at all. Frames that still
wait are kept undecoded. Whenever a delivery took a while, the thread looks at the socket again
before the next one and keeps only the newest `queue_size` frames: a slow callback with
queue_size=1 sees the newest message, however large it is and whatever the socket holds
(ros_comm#536, ros_comm#1901).
"""

from __future__ import annotations

import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from pipros.errors import ProtocolError
from pipros.net import sockets
from pipros.net.lookout import Lookout, Trial
from pipros.wire.frames import FRAME_LIMIT_BYTES, FrameBuffer

#: A delivery longer than this is followed by a look at the socket. Less would cost fast callbacks.
SLOW_DELIVERY_S = 0.001

#: So long a link may deliver before the others of its topic have a turn. (To pass it on after each message
#: would cost more than the messages.)
TURN_S = 0.001

#: A nap, which is as long as the system's timers make it (some 60 microseconds on Linux), pays when so
#: many frames have gathered meanwhile.
NAP_S = 1e-6
NAP_FRAMES = 8

#: How long one look at the socket may go on when the peer sends faster than we can read.
DRAIN_LIMIT_S = 0.1

#: A socket that held this much had its window closed: the peer's side holds more, and sends it at
#: once; the look goes on until nothing has come for QUIET_S.
BACKLOG_BYTES = 64 * 1024
QUIET_S = 0.002


@dataclass(slots=True)
class ReceiveStatistics:
    """What came over a link so far, and what was dropped because the callbacks were too slow."""

    frames: int = 0
    bytes: int = 0
    dropped: int = 0


class Turn:
    """Lets the links of one topic deliver one after the other.

    Who has just had a turn comes after those that wait already: they hold the gate. With one lock alone
    a link with a backlog takes it again before the one that is woken up gets there.
    """

    __slots__ = ("_gate", "_lock", "release")

    def __init__(self) -> None:
        self._gate = threading.Lock()
        self._lock = threading.Lock()
        self.release = self._lock.release

    @property
    def is_wanted(self) -> bool:
        """Whether somebody waits for it."""
        return self._gate.locked()

    def take(self) -> bool:
        """Waits for the turn, which `release` ends; True when it had to wait."""
        waited = not self._gate.acquire(blocking=False) and self._gate.acquire()
        try:
            return (not self._lock.acquire(blocking=False) and self._lock.acquire()) or waited
        finally:
            self._gate.release()

    def pass_on(self) -> None:
        """Lets those that wait have their turns first."""
        self.release()
        self.take()


class IncomingLink:
    """Receives the frames of one publisher and delivers them in order, in a thread of its own.

    `turn` is had during each delivery: links that share one never deliver at the same time.
    The frame given to `deliver` is valid during the call only. `on_closed` is called once, from
    the link's thread, with the reason when the link ended by an error.
    """

    def __init__(
        self,
        sock: socket.socket,
        *,
        name: str,
        deliver: Callable[[memoryview | bytes], object],
        turn: Turn,
        queue_size: int | None,
        on_closed: Callable[[IncomingLink, Exception | None], object],
        limit_bytes: int = FRAME_LIMIT_BYTES,
    ) -> None:
        sock.setblocking(True)
        self.peer = sockets.peer_name(sock)
        self.queue_size = queue_size
        self.statistics = ReceiveStatistics()
        self._sock = sock
        self._deliver = deliver
        self._turn = turn
        self._on_closed = on_closed
        self._buffer = FrameBuffer(limit_bytes)
        self._between = Lookout()  # waits for a frame to begin
        self._within = Lookout()  # waits for the rest of one
        self._waiting: deque[memoryview | bytes] = deque()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self, first: bytes = b"") -> None:
        """Starts reading; `first` is what came behind the handshake already."""
        self._first = first
        self._thread.start()

    def close(self) -> None:
        """Ends the link now; a delivery under way ends by itself. Harmless when repeated."""
        sockets.abort(self._sock)

    def join(self, timeout_s: float) -> None:
        """Waits for the thread to end, unless it is the one that calls."""
        if self._thread is not threading.current_thread():
            self._thread.join(timeout_s)

    def _run(self) -> None:
        error: Exception | None = None
        try:
            self._accept_first()
            statistics, nap, has_napped = self.statistics, Trial(), False
            while count := self._receive():
                if has_napped:
                    sockets.acknowledge(self._sock)
                before = statistics.frames + statistics.dropped
                if self.queue_size:
                    self._accept(count)
                    self._deliver_waiting()
                else:
                    self._deliver_all(count)
                if has_napped:
                    nap.note(pays=statistics.frames + statistics.dropped - before >= NAP_FRAMES)
                has_napped = nap.is_due()
                if has_napped:
                    time.sleep(NAP_S)
        except (OSError, ProtocolError) as reason:
            error = reason
        finally:
            self._sock.close()
            self._on_closed(self, error)

    def _receive(self) -> int:
        """Waits for the next bytes, with more hope when a frame has begun: its rest is on the way."""
        room = self._buffer.room()
        lookout = self._within if self._buffer.is_within else self._between
        return lookout.receive_into(self._sock, room)

    def _deliver_all(self, count: int) -> None:
        """Delivers the frames that `count` received bytes complete, straight from the buffer."""
        statistics, turn, deliver, clock = self.statistics, self._turn, self._deliver, time.monotonic
        statistics.bytes += count
        turn.take()
        try:
            end = clock() + TURN_S
            for frame in self._buffer.received(count):
                statistics.frames += 1
                deliver(frame)
                if clock() > end:
                    turn.pass_on()
                    end = clock() + TURN_S
        finally:
            turn.release()

    def _accept_first(self) -> None:
        first = memoryview(self._first)
        while first:
            room = self._buffer.room()
            count = min(len(room), len(first))
            room[:count] = first[:count]
            first = first[count:]
            self._accept(count)
            self._keep_waiting()
        self._deliver_waiting()

    def _accept(self, count: int) -> None:
        """Takes over `count` received bytes; the frames they complete wait as views of the buffer."""
        self.statistics.bytes += count
        waiting = self._waiting
        waiting.extend(self._buffer.received(count))
        if self.queue_size:
            while len(waiting) > self.queue_size:
                waiting.popleft()
                self.statistics.dropped += 1

    def _deliver_waiting(self) -> None:
        waiting, turn, statistics = self._waiting, self._turn, self.statistics
        while waiting:
            waited = turn.take()
            try:
                if waited:
                    self._look_again()
                before = time.monotonic()
                self._deliver(waiting.popleft())
            finally:
                turn.release()
            statistics.frames += 1
            if self.queue_size and time.monotonic() - before > SLOW_DELIVERY_S:
                self._look_again()

    def _look_again(self) -> None:
        """Takes what the socket holds by now, so that only the newest frames wait."""
        end = time.monotonic() + DRAIN_LIMIT_S
        before = self.statistics.bytes
        while self.queue_size and time.monotonic() < end:
            self._keep_waiting()
            try:
                count = sockets.receive_now(self._sock, self._buffer.room())
            except BlockingIOError:
                is_backlog = self.statistics.bytes - before >= BACKLOG_BYTES
                if is_backlog and sockets.wait_readable(self._sock, QUIET_S):
                    continue
                return
            if not count:
                return  # the stream has ended; the next blocking read tells
            self._accept(count)

    def _keep_waiting(self) -> None:
        """Copies the waiting frames out of the buffer, which is about to be used again."""
        waiting = self._waiting
        for _ in range(len(waiting)):
            waiting.append(bytes(waiting.popleft()))
