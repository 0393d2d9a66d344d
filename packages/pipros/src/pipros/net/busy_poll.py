"""Receive with a short busy poll of the socket before blocking.

Theory of operation. A thread that sleeps in `recv` has to be woken by the sender's processor. This takes tens
of microseconds, which are added to the receiver's latency and to the duration of the sender's `send`. Replies
and streamed messages often arrive sooner, so a `PollingReceiver` polls the socket briefly before it sleeps,
and yields the processor between polls. This helps most if the sender runs on the same core, whose cache then
still holds the message.

The receiver learns whether polling pays (see `AdaptiveBackoff`). For example, it polls only about once per
thousand messages of a topic at 100 Hz. A topic link polls for the full time only after the node has published
(`PublishCount`), because the next message may be a response. Otherwise, it polls only a few times. This
suffices for messages from processes that run between the polls, and does not keep an idle processor busy.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable
from typing import Any, Final, TypeVar

from pipros.basics.interruptible_wait import wait_in_slices
from pipros.net import sockets

T = TypeVar("T")

STREAM_POLL_S: Final = 50e-6
"""Maximum polling time for the next message of a stream: about as long as a wake-up takes on both sides
together.
"""

REPLY_POLL_S: Final = 100e-6
"""Maximum polling time for a reply. It is longer because the caller is waiting, and replies are rarer than
messages.
"""

LONGEST_PAUSE: Final = 1024
"""Maximum number of opportunities that are skipped after trials that were not useful."""

_DONTWAIT: Final[int] = getattr(socket, "MSG_DONTWAIT", 0)
MAY_POLL: Final = bool(_DONTWAIT) and (os.cpu_count() or 1) > 1
"""Whether polling is useful. On a single processor, the sender makes no progress while this process polls."""

_yield_cpu: Final[Callable[[], object]] = getattr(os, "sched_yield", lambda: time.sleep(0))


class PublishCount:
    """A counter that changes when a node publishes a message. Concurrent messages may count as one."""

    __slots__ = ("value",)

    def __init__(self) -> None:
        self.value = 0


class AdaptiveBackoff:
    """Decides when to try an optimization that is only sometimes useful.

    After a trial that was not useful, the next opportunity is skipped, then the next two, four, and so on up
    to `longest_pause`. After a useful trial, no opportunity is skipped.
    """

    __slots__ = ("_longest_pause", "_passing", "_pause")

    def __init__(self, longest_pause: int = LONGEST_PAUSE) -> None:
        self._longest_pause = longest_pause
        self._pause = 0  # opportunities to skip after the last trial that was not useful
        self._passing = 0  # number of opportunities still to be skipped

    def is_due(self) -> bool:
        """Return whether to make a trial. Call this at each opportunity, and `note` after each trial."""
        if self._passing > 0:
            self._passing -= 1
            return False
        return True

    def note(self, *, pays: bool) -> None:
        self._pause = self._passing = 0 if pays else min(max(1, 2 * self._pause), self._longest_pause)


class PollingReceiver:
    """Receives from sockets, and learns whether polling before waiting pays.

    Intended for one waiting thread at a time. If two threads share a receiver, it learns less reliably.
    If the system lacks MSG_DONTWAIT (Windows) or has only one processor, it never polls.
    """

    __slots__ = ("_backoff", "_longest_s", "_may_poll")

    def __init__(
        self,
        longest_s: float = STREAM_POLL_S,
        *,
        longest_pause: int = LONGEST_PAUSE,
        may_poll: bool = MAY_POLL,
    ) -> None:
        """Poll for at most `longest_s` before blocking; see `AdaptiveBackoff` for `longest_pause`."""
        self._longest_s = longest_s
        self._may_poll = may_poll
        self._backoff = AdaptiveBackoff(longest_pause)

    def receive_into(self, sock: socket.socket, buffer: memoryview, max_polls: int | None = None) -> int:
        """Wait for bytes and receive them into `buffer`. Return their number, or 0 at the end of the stream.

        `max_polls` limits the number of polls. The polling time is always limited.
        """
        if self._backoff.is_due():
            count = self._poll(sock.recv_into, buffer, 0, _DONTWAIT, max_polls=max_polls)
            if count is not None:
                return count
        return sock.recv_into(buffer)

    def receive_with_timeout(self, sock: socket.socket, buffer: memoryview, timeout_s: float) -> int | None:
        """Like `receive_into`, but return None after `timeout_s`; 0 requires a non-blocking socket."""
        if timeout_s > 0:
            if (
                self._backoff.is_due()
                and (count := self._poll(sock.recv_into, buffer, 0, _DONTWAIT)) is not None
            ):
                return count
            if not sockets.wait_readable(sock, timeout_s):
                return None
        try:
            return sock.recv_into(buffer)
        except BlockingIOError:
            return None

    def receive(self, sock: socket.socket, max_bytes: int, deadline: float | None = None) -> bytes:
        """Wait for bytes and return at most `max_bytes` of them; return `b""` at the end of the stream.

        Raises:
            TimeoutError: no bytes arrived before `deadline` (a `time.monotonic()` time).
        """
        left_s = None if deadline is None else deadline - time.monotonic()
        if left_s is not None and left_s <= 0:
            raise TimeoutError("the deadline has passed")
        if self._backoff.is_due() and (data := self._poll(sock.recv, max_bytes, _DONTWAIT)) is not None:
            return data
        if threading.get_ident() == threading.main_thread().ident:
            # Wait in slices: Python handles a signal that arrives just before a wait only after the wait.
            if not wait_in_slices(lambda slice_s: sockets.wait_readable(sock, slice_s), left_s):
                raise TimeoutError("the deadline has passed")
        elif left_s is not None and not sockets.wait_readable(sock, left_s):
            raise TimeoutError("the deadline has passed")
        return sock.recv(max_bytes)

    def _poll(self, receive: Callable[..., T], *args: Any, max_polls: int | None = None) -> T | None:
        """Poll with `receive` and return its result, or None if nothing arrived or polling is impossible."""
        if not self._may_poll:
            self._backoff.note(pays=False)
            return None
        end, polls = 0.0, 0
        while True:
            try:
                received = receive(*args)
            except BlockingIOError:
                now = time.perf_counter()
                end = end or now + self._longest_s
                polls += 1
                if now > end or polls == max_polls:
                    self._backoff.note(pays=False)
                    return None
                _yield_cpu()
            else:
                self._backoff.note(pays=True)
                return received
