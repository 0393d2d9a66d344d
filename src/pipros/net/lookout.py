"""Receiving with a look before the sleep.

Theory of operation. A thread that sleeps in `recv` has to be woken by the sender's processor: tens of
microseconds, which the receiver pays in latency and the sender in its `send`. What answers a request,
or belongs to a stream, is there sooner than that. So a `Lookout` looks at the socket for a moment before
it sleeps, and between two looks gives the processor to whoever wants it: to the sender above
all, when both run on one core, whose cache then still holds the message.

Whether looking pays is learnt, see `Trial`: a topic at 100 Hz is looked at once in a thousand messages,
and only a peer that sends more than 1 / STREAM_LOOK_S messages a second keeps a processor busy.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from typing import Any, Final, TypeVar

from pipros.net import sockets

T = TypeVar("T")

#: The longest look for the next of many messages: about what being woken costs both sides together.
STREAM_LOOK_S: Final = 50e-6

#: The longest look for an answer, which somebody waits for and nobody waits for often.
ANSWER_LOOK_S: Final = 100e-6

#: How many opportunities, at most, pass before something that did not pay is tried again.
LONGEST_PAUSE: Final = 1024

_DONTWAIT: Final[int] = getattr(socket, "MSG_DONTWAIT", 0)
#: With a single processor the sender gets nowhere while we look.
_MAY_LOOK: Final = bool(_DONTWAIT) and (os.cpu_count() or 1) > 1

_give_way: Final[Callable[[], object]] = getattr(os, "sched_yield", lambda: time.sleep(0))


class Trial:
    """Whether something that pays at times, and costs a little at others, is worth trying now.

    After a trial in vain the next opportunity passes, then the next two, four, ... LONGEST_PAUSE; one
    that pays ends that.
    """

    __slots__ = ("_passing", "_pause")

    def __init__(self) -> None:
        self._pause = 0  # the opportunities let pass after the last trial in vain
        self._passing = 0  # how many of them are still to come

    def is_due(self) -> bool:
        """Asked at each opportunity; who gets True tries, and tells `note` how it went."""
        if self._passing > 0:
            self._passing -= 1
            return False
        return True

    def note(self, *, pays: bool) -> None:
        self._pause = self._passing = 0 if pays else min(max(1, 2 * self._pause), LONGEST_PAUSE)


class Lookout:
    """Receives from blocking sockets, and remembers whether looking before sleeping paid.

    For one waiting thread at a time; two that share one only learn less well.
    Without MSG_DONTWAIT (Windows), and on a machine with one processor, it sleeps at once.
    """

    __slots__ = ("_longest_s", "_trial")

    def __init__(self, longest_s: float = STREAM_LOOK_S) -> None:
        """`longest_s` is how long one look lasts at most."""
        self._longest_s = longest_s
        self._trial = Trial()

    def receive_into(self, sock: socket.socket, room: memoryview) -> int:
        """Waits for bytes and receives them into `room`; returns how many, 0 at the end of the stream."""
        count = self._look(sock.recv_into, room, 0, _DONTWAIT)
        return sock.recv_into(room) if count is None else count

    def receive(self, sock: socket.socket, most: int, deadline: float | None = None) -> bytes:
        """Waits for bytes; returns `most` of them at most, and none at the end of the stream.

        Raises:
            TimeoutError: none came before `deadline` (of `time.monotonic`), or it has passed already.
        """
        left_s = None if deadline is None else deadline - time.monotonic()
        if left_s is not None and left_s <= 0:
            raise TimeoutError("the time is over")
        data = self._look(sock.recv, most, _DONTWAIT)
        if data is not None:
            return data
        if left_s is not None and not sockets.wait_readable(sock, left_s):
            raise TimeoutError("the time is over")
        return sock.recv(most)

    def _look(self, receive: Callable[..., T], *args: Any) -> T | None:
        """What `receive` returns during a look, if one is worth a try."""
        if not _MAY_LOOK or not self._trial.is_due():
            return None
        end = 0.0
        while True:
            try:
                received = receive(*args)
            except BlockingIOError:
                now = time.perf_counter()
                end = end or now + self._longest_s
                if now > end:
                    self._trial.note(pays=False)
                    return None
                _give_way()
            else:
                self._trial.note(pays=True)
                return received
