"""The sending end of one TCPROS topic link: a bounded queue above a socket.

Theory of operation. `send` is called by whatever thread publishes. While the socket keeps up, it
writes there and then, without any hand-over. When the socket is full, the frame waits in the
link's own queue; `settle` sees that it goes out: the publishing thread takes the queue along at its
next call, and the event loop does when the publisher has gone quiet. A large frame rarely fits into
a socket at once, but a peer that reads makes room within microseconds, so `settle` lingers that
long before it hands over to the loop. A frame of which a part went out must follow whole, so only
frames of which nothing went out are ever dropped: the oldest first, and counted.

What `queue_size` means, as in rospy:
    None  `settle` waits until the frame is in the socket's hands. A peer that takes nothing for
          STALL_LIMIT_S is treated as queue_size=1 until it moves again, so that a subscriber that
          hangs cannot stop a robot (genuine rospy waits for ever).
    0     unlimited.
    n     at most n frames wait.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pipros.net import sockets
from pipros.net.loop import BackgroundLoop

#: How long a synchronous publisher waits for a subscriber that takes nothing at all.
STALL_LIMIT_S = 2.0

#: How often a link is asked whether its peer still acknowledges what it is sent.
CHECK_PEER_INTERVAL_S = 5.0

Buffer = bytes | memoryview
#: How long a publisher with a queue waits for a subscriber to make room for the rest of a large frame.
#: One that makes none is not waited for again until it has caught up.
LINGER_S = 0.0005
LARGE_BYTES = 64 * 1024

#: A wait for room looks this often whether the link was closed.
WATCH_CLOSE_S = 0.1

#: A frame as it goes over the wire, its length in front: buffers to be written in a row.
Frame = Sequence[Buffer]


@dataclass(slots=True)
class SendStatistics:
    """What went over a link so far, and what was dropped because the peer was too slow."""

    frames: int = 0
    bytes: int = 0
    dropped: int = 0


class OutgoingLink:
    """Sends frames to one subscriber, at no cost to any other.

    Safe to use from several threads; the frames of one thread arrive in order. `on_closed` is
    called once, in the event loop, when the peer has gone or `close` was called.
    """

    def __init__(
        self,
        sock: socket.socket,
        loop: BackgroundLoop,
        *,
        queue_size: int | None,
        may_share_packets: bool = False,
        on_closed: Callable[[OutgoingLink], object],
    ) -> None:
        sock.setblocking(False)
        self.peer = sockets.peer_name(sock)
        self.queue_size = queue_size
        self.statistics = SendStatistics()
        self.is_closed = False
        self._may_share_packets = may_share_packets
        self._sock = sock
        self._loop = loop
        self._on_closed = on_closed
        self._lock = threading.Lock()
        self._rest: deque[Buffer] = deque()  # of a frame that is partly out
        self._waiting: deque[Frame] = deque()  # whole frames
        self._is_watched = False
        self._is_stalled = False
        self._lingers = True
        self._next_check: asyncio.TimerHandle | None = None
        loop.call(self._watch_peer)

    def send(self, frame: Frame, size: int) -> None:
        """Writes a frame of `size` bytes, or queues what the socket does not take. Returns at once."""
        with self._lock:
            if self._waiting or self._rest:
                self._waiting.append(_own(frame))
                self._flush()
            else:
                try:
                    if len(frame) == 1:
                        sent = self._sock.send(frame[0])
                    else:
                        sent = sockets.send_gathered(self._sock, frame)
                except (BlockingIOError, InterruptedError):
                    self._waiting.append(_own(frame))
                except OSError:
                    self._give_up()
                else:
                    statistics = self.statistics
                    statistics.bytes += sent
                    if sent == size:
                        statistics.frames += 1
                        return
                    self._keep_rest(frame, sent)
            self._drop_oldest()

    def share_packets(self, *, share: bool) -> None:
        """Whether small frames may wait to go out in one packet while others are unacknowledged.

        Does nothing for a link whose subscriber wants no delay (`tcp_nodelay`).
        """
        if self._may_share_packets:
            sockets.share_packets(self._sock, share=share)

    @property
    def is_behind(self) -> bool:
        """True while something waits. Read without a lock, to decide whether `settle` is worth a call."""
        return bool(self._rest or self._waiting)

    def settle(self) -> None:
        """Sees that what waits goes out: waits for it if `queue_size` is None, else leaves it to the loop."""
        if self.queue_size is None and not self._is_stalled:
            self._is_stalled = not self._wait_for_room(STALL_LIMIT_S)
        elif self._lingers and self._rest and len(self._rest[0]) >= LARGE_BYTES:
            self._lingers = self._wait_for_room(LINGER_S)
        if self.is_behind:
            self.hand_over()

    def hand_over(self) -> None:
        """Leaves what waits to the event loop. Never blocks."""
        with self._lock:
            if self.is_behind and not self.is_closed and not self._is_watched:
                self._is_watched = True
                self._loop.call(self._start_writer)

    def drain(self, limit_s: float) -> None:
        """Gives what waits a last chance to go out; takes no longer than `limit_s` in all."""
        end = time.monotonic() + limit_s
        while self.is_behind and not self.is_closed and (left_s := end - time.monotonic()) > 0:
            with contextlib.suppress(OSError, ValueError):  # closed meanwhile
                sockets.wait_writable(self._sock, left_s)
            with self._lock:
                self._flush()

    def greet(self, header: bytes) -> None:
        """Sends the answering connection header, before anything else. It counts as no frame."""
        self.send((header,), len(header))
        self.hand_over()
        self.statistics = SendStatistics()

    def _wait_for_room(self, limit_s: float) -> bool:
        """Writes what waits as the peer makes room; False when it made none for `limit_s`."""
        moved, deadline = self.statistics.bytes, time.monotonic() + limit_s
        while self.is_behind and not self.is_closed:
            with contextlib.suppress(OSError, ValueError):  # closed meanwhile
                sockets.wait_writable(self._sock, min(limit_s, WATCH_CLOSE_S))
            with self._lock:
                self._flush()
            if self.statistics.bytes != moved:
                moved, deadline = self.statistics.bytes, time.monotonic() + limit_s
            elif time.monotonic() > deadline:
                return False
        return True

    def close(self) -> None:
        """Ends the link; what waits is dropped. Harmless when repeated, from any thread."""
        with self._lock:
            self._give_up()

    # -- with the lock held ---------------------------------------------------

    def _flush(self) -> None:
        """Writes as much of what waits as the socket takes."""
        while (self._rest or self._waiting) and not self.is_closed:
            waiting = itertools.chain.from_iterable(self._waiting)
            batch = list(itertools.islice(itertools.chain(self._rest, waiting), sockets.GATHER_LIMIT))
            try:
                sent = sockets.send_gathered(self._sock, batch)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                self._give_up()
                return
            self._is_stalled = False
            self.statistics.bytes += sent
            self._forget(sent)

    def _forget(self, sent: int) -> None:
        """Drops `sent` bytes from the front of what waits: they are out."""
        while self._rest and sent >= len(self._rest[0]):
            sent -= len(self._rest.popleft())
            if not self._rest:
                self.statistics.frames += 1
        if self._rest:
            self._rest[0] = memoryview(self._rest[0])[sent:]
            return
        while sent:
            frame = self._waiting.popleft()
            size = sum(map(len, frame))
            if sent < size:
                self._keep_rest(frame, sent)
                return
            sent -= size
            self.statistics.frames += 1

    def _keep_rest(self, frame: Frame, sent: int) -> None:
        for buffer in _own(frame):
            if sent >= len(buffer):
                sent -= len(buffer)
            else:
                self._rest.append(memoryview(buffer)[sent:])
                sent = 0

    def _drop_oldest(self) -> None:
        limit = 1 if self.queue_size is None and self._is_stalled else self.queue_size
        while limit and len(self._waiting) > limit:
            self._waiting.popleft()
            self.statistics.dropped += 1

    def _give_up(self) -> None:
        if not self.is_closed:
            self.is_closed = True
            self._rest.clear()
            self._waiting.clear()
            sockets.abort(self._sock)
            self._loop.call(self._end)

    # -- in the event loop ----------------------------------------------------

    def _watch_peer(self) -> None:
        if not self.is_closed:
            self._loop.asyncio.add_reader(self._sock, self._read)
            self._check_peer()

    def _check_peer(self) -> None:
        """Ends a link whose peer has vanished without a word: a cut cable, a host without power."""
        if self.is_closed:
            return
        if sockets.is_unanswered(self._sock, sockets.KEEPALIVE_LIMIT_S):
            self.close()
        else:
            self._next_check = self._loop.asyncio.call_later(CHECK_PEER_INTERVAL_S, self._check_peer)

    def _read(self) -> None:
        """A subscriber has nothing to say on a topic link; its silence ends when it leaves."""
        try:
            if self._sock.recv(4096):
                return
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            pass  # reset by the peer: gone all the same
        self.close()

    def _start_writer(self) -> None:
        if not self.is_closed:
            self._loop.asyncio.add_writer(self._sock, self._write_waiting)

    def _write_waiting(self) -> None:
        with self._lock:
            self._flush()
            if not self._rest and not self._waiting and not self.is_closed:
                self._is_watched = False
                self._lingers = True
                self._loop.asyncio.remove_writer(self._sock)

    def _end(self) -> None:
        if self._next_check is not None:
            self._next_check.cancel()
        self._loop.asyncio.remove_reader(self._sock)
        self._loop.asyncio.remove_writer(self._sock)
        with self._lock:  # not under a send: its descriptor would be another connection's
            self._sock.close()
        self._on_closed(self)


def _own(frame: Frame) -> Frame:
    """The frame in buffers that nobody can change any more: the publisher may reuse its message."""
    return [buffer if _is_constant(buffer) else bytes(buffer) for buffer in frame]


def _is_constant(buffer: Buffer) -> bool:
    return not isinstance(buffer, memoryview) or type(buffer.obj) is bytes
