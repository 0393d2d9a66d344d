"""The sending end of one TCPROS topic link: a bounded queue in front of a socket.

Theory of operation. The publishing thread calls `send`. While the socket accepts data, `send` writes
directly, without another thread. If the socket is full, the message is queued in the link's backlog. The
publishing thread then calls `pipros.net.flush.flush_or_queue`, which waits until the message is sent or
leaves it to the event loop, depending on `queue_size`. A large message rarely fits into a socket at once, but
a peer that is reading empties the socket within microseconds, so `flush_or_queue` waits briefly before it
leaves the rest to the loop. `pipros.net.outgoing_state` defines the states of a link.

The meaning of `queue_size`, as in rospy:
    None  the publisher waits until the socket has accepted the message, at most `Limits.stall_s` (genuine
          rospy waits without limit). A subscriber that takes longer has stalled: until it has caught up,
          its link behaves as if queue_size were 1.
    0     any number of messages wait.
    n     at most n messages wait.
In all cases, at most `Limits.queue_bytes` are queued, but the newest message is always kept.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
import threading
import time
from collections.abc import Callable, Sequence

from pipros.basics.limits import Limits
from pipros.net import local_stream, sockets
from pipros.net.backlog import Backlog, Buffer, WireMessage
from pipros.net.loop import BackgroundLoop
from pipros.net.outgoing_state import (
    NOT_WAITED_FOR,
    WAITING,
    WRITTEN_BY_LOOP,
    LinkEvent,
    LinkState,
    SendStatistics,
    after,
)
from pipros.net.timings import LINK_TIMINGS, LinkTimings

SUBSCRIBER_BYTES = 4 * 1024
"""Limit: the bytes that a subscriber may send on a topic link after its header. Beyond it, the link is
closed, with a log entry; the limit counts the bytes that a subscriber sends after its header.
"""

CHECK_STALLED_INTERVAL_S = 0.1
"""Interval between checks of whether a stalled link has caught up."""

TURN_BYTES = 4 * 1024 * 1024
"""After sending this many bytes on a link, the event loop turns to other links, because a peer might read as
fast as the loop writes.
"""

STREAM_SPARED_BYTES = 128 * 1024
"""On a Unix stream, `queue_size` does not limit a backlog of up to this size. The stream itself holds only a
few hundred small messages, whereas a TCP connection holds many thousands, so a short burst would lose
messages.
"""

_READ_BYTES = 4096

_IDLE, _RECOVERING = (
    LinkState.IDLE,
    LinkState.RECOVERING,
)  # aliases: enum lookups per message are slow


class OutgoingLink:
    """Sends messages to one subscriber without delaying others.

    Thread-safe. Messages from the same thread arrive in order. `on_closed` is called once, in the event loop,
    when the link has ended, unless the loop has stopped.

    Attributes:
        state: changed while the lock is held; read without the lock to decide whether to call
            `flush_or_queue`.
        may_share_packets: whether `share_packets` has an effect: over TCP, unless the link has `tcp_nodelay`.
        end_reason: why this side closed the link; empty if the peer or the owner closed it.
    """

    def __init__(
        self,
        sock: socket.socket,
        loop: BackgroundLoop,
        *,
        queue_size: int | None,
        limits: Limits,
        may_share_packets: bool = False,
        timings: LinkTimings = LINK_TIMINGS,
        on_closed: Callable[[OutgoingLink], object],
    ) -> None:
        sock.setblocking(False)
        self.sock = sock
        self.peer = sockets.peer_name(sock)
        self.transport = local_stream.transport_of(sock)
        self.descriptor = sock.fileno()
        self.queue_size = queue_size
        self.statistics = SendStatistics()
        self.state = LinkState.IDLE
        self.end_reason = ""
        self._limits = limits
        self._timings = timings
        self._is_local = local_stream.is_local(sock)
        self.may_share_packets = may_share_packets and not self._is_local
        self._loop = loop
        self._on_closed = on_closed
        self._lock = threading.Lock()
        self._backlog = Backlog()
        self._received_bytes = 0
        self._checks: dict[Callable[[], None], asyncio.TimerHandle] = {}
        loop.call(self._watch_peer)

    def send(self, message: WireMessage, size: int) -> None:
        """Write a message of `size` bytes; queue the part that the socket does not accept. Never blocks."""
        with self._lock:
            if self.state is _IDLE or self.state is _RECOVERING:
                try:
                    if len(message) == 1:
                        sent = self.sock.send(message[0])
                    else:
                        sent = sockets.send_gathered(self.sock, message)
                except (BlockingIOError, InterruptedError):
                    self._backlog.append(message, size)
                except OSError:
                    self._give_up()
                else:
                    statistics = self.statistics
                    statistics.bytes += sent
                    if sent == size:
                        statistics.frames += 1
                        return
                    self._backlog.append_rest(message, sent)
                self._apply(LinkEvent.SOCKET_FULL)
            elif not self.is_closed:
                self._backlog.append(message, size)
                self._flush()
            self._drop_oldest()

    def send_together(self, messages: Sequence[Buffer], joined: bytes) -> None:
        """Like `send`, but write several messages at once. `joined` is their concatenation."""
        with self._lock:
            if self.state is _IDLE or self.state is _RECOVERING:
                try:
                    sent = self.sock.send(joined)
                except (BlockingIOError, InterruptedError):
                    sent = 0
                except OSError:
                    self._give_up()
                    return
                statistics = self.statistics
                statistics.bytes += sent
                if sent == len(joined):
                    statistics.frames += len(messages)
                    return
                for message in messages:
                    if sent >= len(message):
                        sent -= len(message)
                        statistics.frames += 1
                    elif sent:
                        self._backlog.append_rest((message,), sent)
                        sent = 0
                    else:
                        self._backlog.append((message,), len(message))
                self._apply(LinkEvent.SOCKET_FULL)
            elif not self.is_closed:
                for message in messages:
                    self._backlog.append((message,), len(message))
                self._flush()
            self._drop_oldest()

    def share_packets(self, *, share: bool) -> None:
        """Set whether small messages may wait to share a packet while earlier data is unacknowledged.

        This is Nagle's algorithm. Does nothing for a link with `tcp_nodelay`.
        """
        if self.may_share_packets:
            sockets.share_packets(self.sock, share=share)

    @property
    def is_behind(self) -> bool:
        """Whether messages are queued."""
        return self.state in WAITING

    @property
    def is_closed(self) -> bool:
        return self.state is LinkState.CLOSED

    @property
    def is_waited_for(self) -> bool:
        """Whether the publisher must wait until the backlog is empty."""
        return self.queue_size is None and self.state not in NOT_WAITED_FOR

    @property
    def is_briefly_waited_for(self) -> bool:
        """Whether the rest of a large message is queued for a subscriber that has read in time so far."""
        with self._lock:
            return self.state is LinkState.BEHIND and self._backlog.is_in_large_buffer

    def stop_waiting(self) -> None:
        """Leave queued messages to the event loop, because the link did not become writable in time.

        The publisher does not wait for the link again until the link has caught up.
        """
        with self._lock:
            self._apply(LinkEvent.WAITED_IN_VAIN if self.is_waited_for else LinkEvent.LEFT_TO_LOOP)
            self._drop_oldest()

    def flush(self) -> bool:
        """Write as much as the socket accepts; return whether the socket accepted anything. Never blocks."""
        with self._lock:
            before = self.statistics.bytes
            self._flush()
            return self.statistics.bytes != before

    def queue_for_loop(self) -> None:
        """Leave queued messages to the event loop. Never blocks."""
        with self._lock:
            self._apply(LinkEvent.LEFT_TO_LOOP)

    def drain(self, limit_s: float) -> None:
        """Send queued messages, blocking for at most `limit_s`."""
        end = time.monotonic() + limit_s
        while self.is_behind and (left_s := end - time.monotonic()) > 0:
            with contextlib.suppress(OSError, ValueError):  # the link was closed in the meantime
                sockets.wait_writable(self.sock, left_s)
            self.flush()

    def send_header(self, header: bytes) -> None:
        """Send the reply header, before any messages. It is not counted in the statistics."""
        self.send((header,), len(header))
        self.queue_for_loop()
        self.statistics = SendStatistics()

    def close(self) -> None:
        """Close the link.

        Queued messages are dropped and counted. May be called repeatedly, from any thread.
        """
        with self._lock:
            self._give_up()

    # -- with the lock held ---------------------------------------------------

    def _apply(self, event: LinkEvent) -> None:
        before, self.state = self.state, after(self.state, event)
        if self.state in WRITTEN_BY_LOOP and before not in WRITTEN_BY_LOOP:
            self._loop.call(self._start_writer)
        # for a recovering link, the check is still scheduled
        if self.state is LinkState.STALLED and before is not _RECOVERING:
            self._loop.call(self._check_stalled)

    def _flush(self, max_bytes: float = math.inf) -> None:
        """Write as much of the backlog as the socket accepts, up to about `max_bytes`."""
        end = self.statistics.bytes + max_bytes
        while self._backlog and self.statistics.bytes < end and self._write():
            pass

    def _write(self) -> bool:
        """Write as much of the backlog as one call accepts; return whether anything was written."""
        try:
            sent = sockets.send_gathered(self.sock, self._backlog.next_buffers())
        except (BlockingIOError, InterruptedError):
            return False
        except OSError:
            self._give_up()
            return False
        self.statistics.bytes += sent
        self.statistics.frames += self._backlog.remove_sent(sent)
        if not self._backlog:
            self._apply(LinkEvent.EMPTIED)
        return True

    def _drop_oldest(self) -> None:
        limit = 1 if self.queue_size is None and self.state is LinkState.STALLED else self.queue_size
        spared_bytes = STREAM_SPARED_BYTES if self._is_local else 0
        self.statistics.dropped += self._backlog.drop_oldest(limit, self._limits.queue_bytes, spared_bytes)

    def _give_up(self) -> None:
        if not self.is_closed:
            self._apply(LinkEvent.CLOSED)
            self.statistics.dropped += self._backlog.clear()
            sockets.abort(self.sock)
            if not self._loop.call(self._end):
                self.sock.close()

    # -- in the event loop ----------------------------------------------------

    def _watch_peer(self) -> None:
        if not self.is_closed:
            self._loop.asyncio.add_reader(self.sock, self._read)
            if not self._is_local:  # the kernel reports the end of a local peer at once
                self._check_peer()

    def _check_again(self, check: Callable[[], None], interval_s: float) -> None:
        self._checks[check] = self._loop.asyncio.call_later(interval_s, check)

    def _check_peer(self) -> None:
        """Close a link whose peer has disappeared without closing it, for example after a power failure."""
        if self.is_closed:
            return
        if sockets.is_unanswered(self.sock, self._timings.unanswered_s):
            self.end_reason = f"it has not acknowledged data for {self._timings.unanswered_s:g} s"
            self.close()
        else:
            self._check_again(self._check_peer, self._timings.check_peer_interval_s)

    def _check_stalled(self) -> None:
        """End the stalled state once the link has caught up.

        An accepted message does not prove that the link has caught up, because the system buffers megabytes
        for a peer that barely reads.
        """
        with self._lock:
            if self.state is _RECOVERING and sockets.is_nearly_drained(self.sock):
                self._apply(LinkEvent.CAUGHT_UP)
            has_caught_up = self.state not in NOT_WAITED_FOR
        if not has_caught_up:
            self._check_again(self._check_stalled, CHECK_STALLED_INTERVAL_S)

    def _read(self) -> None:
        """Detect that the subscriber closed the link. Subscribers send nothing after their header."""
        try:
            received = len(self.sock.recv(_READ_BYTES))
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            received = 0  # the peer reset the connection
        self._received_bytes += received
        if received and self._received_bytes > SUBSCRIBER_BYTES:
            self.end_reason = f"it sent more than {SUBSCRIBER_BYTES} bytes after its header"
        elif received:
            return
        self.close()

    def _start_writer(self) -> None:
        if self.state in WRITTEN_BY_LOOP:
            self._loop.asyncio.add_writer(self.sock, self._write_waiting)

    def _write_waiting(self) -> None:
        with self._lock:
            if self.state in WRITTEN_BY_LOOP:
                self._flush(TURN_BYTES)
            if self.state not in WRITTEN_BY_LOOP:
                self._loop.asyncio.remove_writer(self.sock)

    def _end(self) -> None:
        for check in self._checks.values():
            check.cancel()
        self._loop.asyncio.remove_reader(self.sock)
        self._loop.asyncio.remove_writer(self.sock)
        # do not close during a send, which could then write to another connection's descriptor
        with self._lock:
            self.sock.close()
        self._on_closed(self)
