"""The receiving end of one TCPROS topic link: a thread that reads and delivers the newest messages.

Theory of operation. One thread per link receives large chunks, splits off all complete messages and calls
`deliver` for each of them, so that most messages are not passed between threads. Queued messages are kept
undecoded. After a slow delivery, the thread reads the socket again before the next delivery and keeps only
the newest `queue_size` messages: a slow callback with queue_size=1 gets the newest message, regardless of the
size and number of messages in the socket (ros_comm#536, ros_comm#1901).
"""

from __future__ import annotations

import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from typing import Final

from pipros.basics import one_thread
from pipros.basics.errors import ProtocolError
from pipros.net import local_stream, sockets
from pipros.net.busy_poll import AdaptiveBackoff, PollingReceiver, PublishCount
from pipros.net.connection_table import LinkEntry
from pipros.net.delivery_lock import DeliveryLock
from pipros.net.shared_receiver import DescriptorSocket, HeldSlot, SlotReceiver
from pipros.net.timings import LINK_TIMINGS, LinkTimings
from pipros.wire.messages import MessageReader
from pipros.wire.slot_frames import FRAME_BYTES

COALESCE_SLEEP_S = 1e-6
COALESCE_MESSAGES = 8
"""Minimum number of messages that must arrive during a sleep to make it worthwhile. The actual duration of a
sleep depends on the system's timers (about 60 microseconds on Linux).
"""

FULL_WINDOW_BYTES = 64 * 1024
"""A socket that held this many bytes was full: its TCP window was closed, so the peer has more data to send.
"""

FULL_STREAM_MESSAGES = 128
"""A Unix stream that held this many messages was full. Linux accounts about 770 bytes for each small message,
so a stream with the default buffers holds only 278 of them.
"""

IDLE_POLLS = 4
"""Maximum number of polls before sleeping, on links of a node that has not published since the last message.
"""

KEEP_LARGE_S = 5.0
"""A link that is silent for this long frees the memory of its large messages."""

_WAITALL: Final = socket.MSG_WAITALL
_LARGEST: Final = 2**31 - 1  # larger lengths mark control frames

Received = memoryview | bytes | HeldSlot


class ReceiveStatistics:
    """Numbers of messages and bytes received.

    `frames` counts the messages whose callbacks have returned; `dropped` counts the messages that were lost
    because callbacks were too slow or the link broke.
    """

    __slots__ = ("bytes", "dropped", "frames")

    def __init__(self) -> None:
        self.frames = self.bytes = self.dropped = 0

    def as_dict(self) -> dict[str, int]:
        return {"frames": self.frames, "bytes": self.bytes, "dropped": self.dropped}

    def add(self, other: ReceiveStatistics) -> None:
        """Add another link's counts."""
        self.frames += other.frames
        self.bytes += other.bytes
        self.dropped += other.dropped


class IncomingLink:
    """Receives messages from one publisher and delivers them in order, in its own thread.

    `delivery_lock` is held during each delivery, so links that share a lock never deliver at the same time.
    The message passed to `deliver` is valid only during the call, unless `lends` is set. `on_closed` is
    called once, from the link's thread, with the error that ended the link, or with None. The link polls
    longer for the next message if the node has published since the last message, as counted by `published`;
    see `pipros.net.busy_poll`. `received_count` changes before messages are delivered.

    Attributes:
        lends: whether a message in shared memory is delivered as a view that is valid as long as anything
            refers to it.
    """

    def __init__(
        self,
        sock: socket.socket,
        *,
        name: str,
        deliver: Callable[[memoryview | bytes], object],
        delivery_lock: DeliveryLock,
        queue_size: int | None,
        on_closed: Callable[[IncomingLink, Exception | None], object],
        published: PublishCount,
        received_count: PublishCount,
        on_incomplete: Callable[[LinkEntry, int], object] = lambda *_: None,
        limit_bytes: int | None = None,
        keeps_large: bool = False,
        received: bytes = b"",
        timings: LinkTimings = LINK_TIMINGS,
    ) -> None:
        """Store the settings; `start` begins reading.

        Args:
            sock: the connection; a `DescriptorSocket` can also receive messages in shared memory.
            on_incomplete: called with the number of bytes held for a message whose rest has not arrived, if
                it makes the buffer grow or stalls; and with 0 when it is complete, or the link has ended.
            keeps_large: whether to pass large messages as `bytes`, which `deliver` can keep without a copy.
            received: the bytes that followed the handshake.
            timings: delays for reading again and for letting other links deliver; see `LinkTimings`.
        """
        sock.setblocking(True)
        self.peer = sockets.peer_name(sock)
        self.transport = local_stream.transport_of(sock)
        self.descriptor = sock.fileno()
        self.local_port = sockets.local_port(sock)
        self.queue_size = queue_size
        self.statistics = ReceiveStatistics()
        self._sock = sock
        self._is_local = local_stream.is_local(sock)
        self._deliver = deliver
        self._delivery_lock = delivery_lock
        self._timings = timings
        self._on_closed = on_closed
        self._buffer = MessageReader(limit_bytes, keeps_large=keeps_large)
        self.lends = False
        self._slots: SlotReceiver | None = None
        if isinstance(sock, DescriptorSocket):
            self._buffer.limit_bytes = limit = min(self._buffer.limit_bytes, _LARGEST)
            self._slots = SlotReceiver(sock, limit)
            self._buffer.on_control = self._receive_slot
        self._published = published
        self._received_count = received_count
        self._published_before = 0  # the value of `published` at the last wait for a message
        self._idle_poller = PollingReceiver()  # waits for the start of a message
        self._mid_message_poller = PollingReceiver()  # waits for the rest of a message
        self._on_incomplete = on_incomplete
        self._entry = LinkEntry(self.peer, self.close)
        self._capacity_bytes = 0  # of the buffer, when it last held part of a message
        self._reported_at = -1  # number of messages before the incomplete one that was reported, or -1
        self._waiting: deque[Received] = deque()
        self._received = received
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Start reading.

        Raises:
            RuntimeError: the system cannot start another thread.
        """
        one_thread.start_reader(self._sock, self._thread, self._take_turn)

    def close(self) -> None:
        """Close the link now. A running delivery is not interrupted. May be called repeatedly."""
        sockets.abort_blocked(self._sock)

    def join(self, timeout_s: float) -> None:
        """Wait for the thread to end, unless the caller is that thread."""
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(timeout_s)

    def _run(self) -> None:
        error: Exception | None = None
        try:
            received, self._received = self._received, b""
            self._accept(len(received), self._buffer.feed(received))
            self._deliver_waiting()
            backoff = AdaptiveBackoff()
            while count := self._receive():
                self._deliver_received(count)
                while backoff.is_due() and (count := self._sleep_and_receive()):
                    backoff.note(pays=self._deliver_received(count) >= COALESCE_MESSAGES)
        except (OSError, ProtocolError) as reason:
            error = reason
        finally:
            self._end(error)
            error = None  # the traceback would keep this frame, and thus shared memory, alive

    def _take_turn(self) -> bool | None:
        """Without a thread: deliver one message; see `one_thread.start_reader`."""
        if self._delivery_lock.is_held():
            return None  # a callback of the topic is running
        try:
            if self._received:
                received, self._received = self._received, b""
                self._accept(len(received), self._buffer.feed(received))
            elif not self._waiting:
                count = sockets.receive_now(self._sock, self._buffer.space())
                if not count:
                    self._end(None)
                    return False
                self._received_count.value += 1
                self._accept(count, self._buffer.received(count))
            self._deliver_waiting(once=True)
        except BlockingIOError:
            return False
        except (OSError, ProtocolError) as error:
            self._end(error)
            return False
        return bool(self._waiting)

    def _end(self, error: Exception | None) -> None:
        while self._waiting:
            self._drop(self._waiting.popleft())
        if self._slots is not None:
            self._slots.close()
        self._sock.close()
        self._forget_incomplete()
        self._on_closed(self, error)

    def _receive(self) -> int:
        """Wait for the next bytes.

        Within a message, a separate poller is used, because the rest of the message arrives soon.
        """
        buffer = self._buffer
        if self._reported_at >= 0 and self._reported_at != self._message_count:
            self._forget_incomplete()
        if buffer.has_partial_message:
            return self._receive_rest()
        space = buffer.space()
        if buffer.is_large:
            count = self._idle_poller.receive_with_timeout(self._sock, space, KEEP_LARGE_S)
            if count is not None:
                return count
            buffer.trim()
            space = buffer.space()
        published = self._published.value
        max_polls = IDLE_POLLS if published == self._published_before else None
        self._published_before = published
        return self._idle_poller.receive_into(self._sock, space, max_polls)

    def _receive_rest(self) -> int:
        buffer, before = self._buffer, self._capacity_bytes
        self._capacity_bytes = buffer.capacity_bytes
        if buffer.is_large and self._capacity_bytes > before:
            self._report_incomplete()
        if whole := buffer.whole_bytes:
            return buffer.feed_whole(self._sock.recv(whole, _WAITALL))
        space = buffer.space()
        if buffer.is_large and self._reported_at < 0:
            count = self._mid_message_poller.receive_with_timeout(self._sock, space, KEEP_LARGE_S)
            if count is not None:
                return count
            self._report_incomplete()
        return self._mid_message_poller.receive_into(self._sock, space)

    @property
    def _message_count(self) -> int:
        return self.statistics.frames + self.statistics.dropped

    def _report_incomplete(self) -> None:
        self._reported_at = self._message_count
        self._on_incomplete(self._entry, self._buffer.capacity_bytes // 2)

    def _forget_incomplete(self) -> None:
        if self._reported_at >= 0:
            self._reported_at = -1
            self._on_incomplete(self._entry, 0)

    def _sleep_and_receive(self) -> int:
        """Like `_receive`, but sleep first, so that more messages can arrive."""
        time.sleep(COALESCE_SLEEP_S)
        count = self._receive()
        if not self._is_local:
            sockets.acknowledge(self._sock)
        return count

    def _deliver_received(self, count: int) -> int:
        """Deliver the messages that are completed by `count` received bytes. Return their number."""
        self._received_count.value += 1
        if self.queue_size:
            accepted = self._accept(count, self._buffer.received(count))
            self._deliver_waiting()
            return accepted
        statistics, lock, deliver, clock = self.statistics, self._delivery_lock, self._deliver, time.monotonic
        is_wanted, before = lock.is_wanted, statistics.frames
        statistics.bytes += count
        lock.acquire()
        try:
            turn_s = self._timings.turn_s
            end = clock() + turn_s
            for message in self._buffer.received(count):
                if isinstance(message, HeldSlot):
                    self._deliver_slot(message)
                else:
                    deliver(message)
                statistics.frames += 1
                if is_wanted() and clock() > end:
                    lock.pass_on()
                    end = clock() + turn_s
        finally:
            lock.release()
        return statistics.frames - before

    def _receive_slot(self, data: memoryview, offset: int) -> HeldSlot | None:
        """Apply a control frame. A message in a slot is counted as if it had arrived in the stream."""
        slot = self._slots.receive(data, offset) if self._slots is not None else None
        self.statistics.bytes += (slot.size + 4 if slot is not None else 0) - FRAME_BYTES
        return slot

    def _deliver_slot(self, slot: HeldSlot) -> None:
        try:
            self._deliver(slot.lend() if self.lends else slot.read())
        finally:
            slot.release()

    def _drop(self, message: Received) -> None:
        self.statistics.dropped += 1
        if isinstance(message, HeldSlot):
            message.release()

    def _accept(self, count: int, messages: Iterable[Received]) -> int:
        """Queue the messages completed by `count` received bytes, as views of the buffer.

        Return their number.
        """
        self.statistics.bytes += count
        waiting = self._waiting
        before = len(waiting)
        waiting.extend(messages)
        accepted = len(waiting) - before
        if self.queue_size:
            while len(waiting) > self.queue_size:
                self._drop(waiting.popleft())
        return accepted

    def _deliver_waiting(self, *, once: bool = False) -> None:
        """Deliver queued messages, and those that arrive meanwhile; at most one if `once` is set."""
        waiting, lock, statistics = self._waiting, self._delivery_lock, self.statistics
        while waiting:
            waited = lock.acquire()
            try:
                if waited:
                    self._read_available()
                before = time.monotonic()
                message = waiting.popleft()
                if isinstance(message, HeldSlot):
                    self._deliver_slot(message)
                else:
                    self._deliver(message)
            finally:
                lock.release()
            statistics.frames += 1
            if self.queue_size and time.monotonic() - before > self._timings.slow_delivery_s:
                self._read_available()
            if once:
                return

    def _read_available(self) -> None:
        """Read all available data from the socket, so that only the newest messages stay queued."""
        end = time.monotonic() + self._timings.drain_limit_s
        before, messages = self.statistics.bytes, 0
        while self.queue_size and time.monotonic() < end:
            self._keep_waiting()
            try:
                count = sockets.receive_now(self._sock, self._buffer.space())
            except BlockingIOError:
                was_full = self.statistics.bytes - before >= FULL_WINDOW_BYTES or (
                    self._is_local and messages >= FULL_STREAM_MESSAGES
                )
                if was_full and sockets.wait_readable(self._sock, self._timings.quiet_s):
                    continue
                return
            if not count:
                return  # the stream has ended; the next blocking read will report it
            messages += self._accept(count, self._buffer.received(count))

    def _keep_waiting(self) -> None:
        """Copy queued messages out of the buffer before it is reused, except messages in slots."""
        waiting = self._waiting
        for _ in range(len(waiting)):
            message = waiting.popleft()
            waiting.append(message if isinstance(message, HeldSlot) else bytes(message))
