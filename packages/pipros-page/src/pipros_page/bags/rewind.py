"""Live rewind: the messages that the page received recently, which browsers open like a bag."""

from __future__ import annotations

import dataclasses
import io
import itertools
import threading
import time
from bisect import bisect_left, bisect_right
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pipros.msg.time import NS_PER_S
from pipros.node.any_msg import AnyMsg
from pipros_tools.bag.connection import Connection, StoredMessage, received_connection
from pipros_tools.bag.errors import NoMessages
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.records import Version

NAME: Final = "the past"
KEPT_TOPICS: Final = frozenset({"/tf", "/tf_static", "/rosout_agg", "/diagnostics", "/clock"})
"""Topics that are recorded while a browser is connected, if they are published.

`/rosout_agg` contains the `/rosout` messages of all nodes, over one connection.
"""
OVERHEAD_BYTES: Final = 300
"""Approximate memory of a message, without its content."""


@dataclass(slots=True)
class _Source:
    """A connection, the key that identifies it, the size of its header, and its number of messages."""

    key: tuple[str, ...]
    connection: Connection
    size: int
    messages: int = 0


class RecentMessages:
    """The newest messages of all watched topics, for all browsers. Thread-safe.

    When a limit is exceeded, the oldest messages are dropped. Each publisher's last message on a latched
    topic is dropped last, because it is still current.

    Args:
        span_s: maximum age of a message (s).
        limit_bytes: maximum memory. Larger messages are not kept.
    """

    def __init__(self, span_s: float, limit_bytes: int) -> None:
        self.span_s: Final = span_s
        self._limit_bytes = limit_bytes
        self._lock = threading.Lock()
        self._sources: dict[tuple[str, ...], _Source] = {}
        self._by_id: dict[int, _Source] = {}
        self._numbers = itertools.count()
        self._messages: deque[StoredMessage] = deque()
        self._latched: dict[int, StoredMessage] = {}
        self._bytes = 0

    def add(self, topic: str, message: AnyMsg, wall_s: float) -> None:
        """Add a message that was received at `wall_s` (s since 1970)."""
        if len(message.body) + OVERHEAD_BYTES > self._limit_bytes:
            return
        header = message.header
        key = (topic, *(header.get(name, "") for name in ("callerid", "type", "md5sum", "latching")))
        with self._lock:
            source = self._sources.get(key) or self._new_source(key, topic, header)
            source.messages += 1
            self._bytes += len(message.body) + OVERHEAD_BYTES
            self._messages.append(StoredMessage(source.connection, round(wall_s * NS_PER_S), message.body))
            self._trim(self._messages[-1].time_ns)

    def figures(self) -> tuple[float, int]:
        """Return the age of the oldest message (s), and the memory in use in bytes."""
        now_ns = time.time_ns()
        with self._lock:
            self._trim(now_ns)
            first_ns = self._messages[0].time_ns if self._messages else now_ns
            return max(0.0, (now_ns - first_ns) / NS_PER_S), self._bytes

    def recording(self) -> Recording:
        """Return the messages that are kept now. Messages are not copied.

        Raises:
            NoMessages: no messages are kept.
        """
        now_ns = time.time_ns()
        with self._lock:
            self._trim(now_ns)
            latched, messages = list(self._latched.values()), list(self._messages)
        begin_ns = min((each.time_ns for each in messages), default=now_ns)
        found = [*(each._replace(time_ns=begin_ns) for each in latched), *messages]
        if not found:
            raise NoMessages("no message has been received yet: open a view of a published topic")
        return Recording(sorted(found, key=lambda each: each.time_ns), max(now_ns, found[-1].time_ns))

    def _new_source(self, key: tuple[str, ...], topic: str, header: Mapping[str, str]) -> _Source:
        connection = dataclasses.replace(received_connection(topic, header), id=next(self._numbers))
        size = sum(len(name) + len(value) for name, value in connection.header.items())
        source = self._sources[key] = self._by_id[connection.id] = _Source(key, connection, size)
        self._bytes += size
        return source

    def clear(self) -> None:
        """Drop all messages."""
        with self._lock:
            self._messages.clear()
            self._latched.clear()
            self._sources.clear()
            self._by_id.clear()
            self._bytes = 0

    def _trim(self, now_ns: int) -> None:
        oldest_ns = now_ns - round(self.span_s * NS_PER_S)
        while self._messages and (self._bytes > self._limit_bytes or self._messages[0].time_ns < oldest_ns):
            message = self._messages.popleft()
            if message.connection.is_latching:
                before = self._latched.pop(message.connection.id, None)
                self._latched[message.connection.id] = message
                if before is not None:
                    self._forget(before)
            else:
                self._forget(message)
        while self._bytes > self._limit_bytes and self._latched:
            self._forget(self._latched.pop(next(iter(self._latched))))

    def _forget(self, message: StoredMessage) -> None:
        source = self._by_id[message.connection.id]
        self._bytes -= len(message.data) + OVERHEAD_BYTES
        source.messages -= 1
        if not source.messages:
            self._bytes -= source.size
            del self._sources[source.key], self._by_id[message.connection.id]


class Recording(BagReader):
    """Reader of messages in memory.

    Args:
        messages: sorted by time.
        end_ns: end time of the recording.
    """

    def __init__(self, messages: Sequence[StoredMessage], end_ns: int) -> None:
        super().__init__(io.BytesIO(), name=NAME, layout=BagLayout(Version(2, 0)))
        self._messages = messages
        self._times = [each.time_ns for each in messages]
        self._end_ns = end_ns
        self.layout.connections.update((each.connection.id, each.connection) for each in messages)

    def again(self) -> Recording:
        """Return another reader of the same messages, for another thread."""
        return Recording(self._messages, self._end_ns)

    @property
    def size(self) -> int:
        return sum(len(each.data) for each in self._messages)

    @property
    def message_count(self) -> int:
        return len(self._messages)

    def count_by_connection(self) -> dict[int, int]:
        return Counter(each.connection.id for each in self._messages)

    @property
    def range_ns(self) -> tuple[int, int]:
        return self._times[0], self._end_ns

    def times_ns(self) -> dict[int, list[int]]:
        found: dict[int, list[int]] = {}
        for each in self._messages:
            found.setdefault(each.connection.id, []).append(each.time_ns)
        return found

    def stored_fields(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        *,
        as_views: bool = False,  # noqa: ARG002 # the messages are in memory
        where: Callable[[Connection, int], bool] | None = None,
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        wanted = {each.id for each in (self.connections if connections is None else connections)}
        first = 0 if start_ns is None else bisect_left(self._times, start_ns)
        last = len(self._times) if end_ns is None else bisect_right(self._times, end_ns)
        for at in range(first, last):
            each = self._messages[at]
            if each.connection.id in wanted and (where is None or where(each.connection, each.time_ns)):
                yield each
