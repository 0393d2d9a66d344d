"""Statistics and newest message of a topic that browsers watch."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import Limits, limit_text, process_limits
from pipros.node.any_msg import AnyMsg
from pipros_page.limits import PageLimits
from pipros_page.stale import is_stale
from pipros_server.browser_share import browser_or_none
from pipros_tools.graph.raw_decoder import RawDecoder, decode_as
from pipros_tools.graph.samples import BandwidthWindow, RateWindow

if TYPE_CHECKING:
    from pipros.msg.base import Message

WINDOW = 200
"""Number of messages over which rates and bandwidths are computed."""
QUIET_S = 3.0
"""A topic has no rate if no message has arrived for this time (s) and for three times the mean interval."""

MAX_LATCHED = 1000
"""Maximum number of latching publishers of a topic whose newest messages are kept for later listeners."""
REGULAR = 5
"""A topic can be stale only after this number of messages."""
SHORTEST_S = 0.1
"""If fewer than `WINDOW` messages have arrived, they must span at least this time to yield a rate."""

Listener = Callable[[AnyMsg, float], object]
"""Called in the link's thread with each message and the wall time of its arrival (s)."""
Record = Callable[[str, AnyMsg, float], object]
"""Called in the link's thread with a topic, each of its messages, and the wall time of its arrival (s)."""


@dataclass(frozen=True, slots=True)
class Newest:
    """The newest message of a topic.

    Attributes:
        number: number of messages received up to and including this one.
        message: the serialized message.
        wall_s: time of arrival, in seconds since 1970.
    """

    number: int
    message: AnyMsg
    wall_s: float


class TopicWatch:
    """Statistics and newest message of one topic. Messages are added by the threads that receive them.

    Attributes:
        browser: the browser that began to watch the topic, whose share it counts against.
    """

    def __init__(
        self,
        topic: str,
        decoder: RawDecoder,
        queue_size: int = WINDOW,
        limits: Limits | None = None,
        clock: Callable[[], float] = time.monotonic,
        listeners: Iterable[Listener] = (),
    ) -> None:
        """Create empty statistics. `clock` returns the time (s) used to measure rates."""
        self.topic = topic
        self._max_bytes = (limits or process_limits()).of(PageLimits).page_message_bytes
        self.queue_size = queue_size
        self.users = 0
        self.browser = browser_or_none()
        self.newest: Newest | None = None
        self._decoder = decoder
        self._clock = clock
        self._lock = threading.Lock()
        self._rate = RateWindow(WINDOW)
        self._bandwidth = BandwidthWindow(WINDOW)
        self._last_s = 0.0
        self._count = 0
        self._listeners: list[Listener] = list(listeners)
        self._leading: list[tuple[AnyMsg, float]] = []
        self._latched: dict[str, tuple[AnyMsg, float]] = {}

    def note(self, message: AnyMsg, received_s: float | None = None, *, is_leading: bool = False) -> None:
        """Count a message, and pass it to the listeners.

        Args:
            received_s: the message's time in a bag; defaults to the current time.
            is_leading: whether listeners that are added later also receive the message.
        """
        moment_s = self._clock() if received_s is None else received_s
        wall_s = time.time() if received_s is None else received_s
        with self._lock:
            self._count += 1
            self._rate.add(moment_s)
            self._bandwidth.add(moment_s, len(message.body))
            self._last_s = moment_s
            self.newest = Newest(self._count, message, wall_s)
            listeners = list(self._listeners)
            if is_leading:
                self._leading.append((message, wall_s))
            elif message.header.get("latching") == "1":
                self._keep_latched(message, wall_s)
        for listener in listeners:
            listener(message, wall_s)

    def _keep_latched(self, message: AnyMsg, wall_s: float) -> None:
        """Keep a publisher's newest message. If the limits are exceeded, drop the oldest kept messages."""
        sender = message.header.get("callerid", "")
        self._latched.pop(sender, None)
        self._latched[sender] = message, wall_s
        size = sum(len(kept.body) for kept, _ in self._latched.values())
        while len(self._latched) > 1 and (size > self._max_bytes or len(self._latched) > MAX_LATCHED):
            oldest, _ = self._latched.pop(next(iter(self._latched)))
            size -= len(oldest.body)

    @property
    def is_latched(self) -> bool:
        """Whether a publisher latches its messages."""
        return bool(self._latched)

    def figures(self) -> Mapping[str, float | int | None]:
        """Return the messages and bytes per second, the mean size in bytes, and the total number of messages.

        The rates are None if the topic is quiet, or too few messages have arrived. The size is None before
        the second message. `stale` is the age (s) of the last message if messages that arrived regularly have
        stopped.
        """
        now_s = self._clock()
        with self._lock:
            rate, bandwidth = self._rate.figures(), self._bandwidth.figures(now_s)
            is_quiet = now_s - self._last_s > max(QUIET_S, 3 * rate.mean if rate else 0.0)
            # Delayed messages arrive in bursts, so their intervals do not show the rate.
            is_quiet |= rate is not None and rate.count < WINDOW - 1 and rate.mean * rate.count < SHORTEST_S
            age_s = now_s - self._last_s
            is_regular = rate is not None and rate.count >= REGULAR
            return {
                "stale": age_s if is_regular and is_stale(age_s, rate.mean if rate else None) else None,
                "rate": 1.0 / rate.mean if rate and rate.mean > 0 and not is_quiet else None,
                "bandwidth": bandwidth[0] if bandwidth and not is_quiet else None,
                "size": bandwidth[1].mean if bandwidth else None,
                "count": self._count,
            }

    @contextlib.contextmanager
    def listening(self, listener: Listener, *, from_newest: bool = False) -> Iterator[None]:
        """Call `listener` with leading messages (see `note`) and each message received within the context.

        If `from_newest` is true, begin with the current messages instead; see `current_messages`.
        """
        with self._lock:
            self._listeners.append(listener)
            first = self._current() if from_newest else list(self._leading)
        try:
            for message, wall_s in first:
                listener(message, wall_s)
            yield
        finally:
            with self._lock:
                self._listeners.remove(listener)

    def current_messages(self) -> list[tuple[AnyMsg, float]]:
        """Return the leading messages (see `note`), each latching publisher's newest, and the newest one."""
        with self._lock:
            return self._current()

    def _current(self) -> list[tuple[AnyMsg, float]]:
        found, newest = [*self._leading, *self._latched.values()], self.newest
        if newest is not None and not (found and found[-1][0] is newest.message):
            found.append((newest.message, newest.wall_s))
        return found

    def decode(self, message: AnyMsg) -> object:
        """Decode a message with its publisher's definition. Raise `PiprosError` if that fails."""
        self._check_size(message)
        return self._decoder.decode(message)

    def decode_as(self, message: AnyMsg, message_class: type[Message]) -> Any:
        """Decode a message as an instance of `message_class`.

        Raises:
            WrongDefinition: the publisher uses another definition.
            PiprosError: the message cannot be decoded.
        """
        self._check_size(message)
        return decode_as(message, self.topic, message_class)

    def _check_size(self, message: AnyMsg) -> None:
        if len(message.body) > self._max_bytes:
            what = f"{self.topic}: a message of {len(message.body)} bytes is too large to show"
            raise LimitExceeded(f"{what}; {limit_text('page_message_bytes', self._max_bytes)}")
