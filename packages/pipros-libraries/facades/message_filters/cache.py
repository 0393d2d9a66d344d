"""`Cache`, a history of messages that can be searched by time."""

from __future__ import annotations

from threading import Lock
from typing import Any

from message_filters.simple_filter import SimpleFilter, stamp_of


class Cache(SimpleFilter):
    """Filter that passes messages on and keeps the most recent messages in order of arrival.

    Methods may be called from any thread.

    Args:
        f: the input filter.
        cache_size: maximum number of messages.
        allow_headerless: whether to use the time of arrival as the timestamp of messages without a header,
            instead of dropping them.

    Attributes:
        cache_msgs, cache_times: the messages and their timestamps in order of arrival. Programs may replace
            both lists, for example by empty ones.
    """

    def __init__(self, f: SimpleFilter, cache_size: int = 1, allow_headerless: bool = False) -> None:
        super().__init__()
        self.cache_size = cache_size
        self.cache_msgs: list[Any] = []
        self.cache_times: list[Any] = []
        self.allow_headerless = allow_headerless
        self._lock = Lock()
        self.connectInput(f)

    def connectInput(self, f: SimpleFilter) -> None:
        """Connect another filter as an input."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Add a message and pass it on."""
        stamp = stamp_of(msg, self.allow_headerless)
        if stamp is None:
            return
        with self._lock:
            self.cache_times.append(stamp)
            self.cache_msgs.append(msg)
            if len(self.cache_msgs) > self.cache_size:
                del self.cache_msgs[0], self.cache_times[0]
        self.signalMessage(msg)

    def _pairs(self) -> list[tuple[Any, Any]]:
        with self._lock:
            return list(zip(self.cache_times, self.cache_msgs, strict=False))

    def getInterval(self, from_stamp: Any, to_stamp: Any) -> list[Any]:
        """Return the messages with timestamps from `from_stamp` to `to_stamp`, inclusive.

        Raises AssertionError if `from_stamp` is after `to_stamp`, as in Noetic.
        """
        if from_stamp > to_stamp:
            raise AssertionError(f"from_stamp must not be after to_stamp, got {from_stamp} and {to_stamp}")
        return [msg for stamp, msg in self._pairs() if from_stamp <= stamp <= to_stamp]

    def getElemAfterTime(self, stamp: Any) -> Any:
        """Return the first message in order of arrival whose timestamp is >= `stamp`, or None."""
        return next((msg for known, msg in self._pairs() if known >= stamp), None)

    def getElemBeforeTime(self, stamp: Any) -> Any:
        """Return the last message in order of arrival whose timestamp is <= `stamp`, or None."""
        return next((msg for known, msg in reversed(self._pairs()) if known <= stamp), None)

    def getLatestTime(self) -> Any:
        """Return the timestamp of the message that arrived last, or None if the cache is empty."""
        stamps = self.cache_times[-1:]
        return stamps[0] if stamps else None

    def getLastestTime(self) -> Any:
        """Same as `getLatestTime`, under Noetic's deprecated misspelt name."""
        return self.getLatestTime()

    def getOldestTime(self) -> Any:
        """Return the timestamp of the cached message that arrived first, or None if the cache is empty."""
        stamps = self.cache_times[:1]
        return stamps[0] if stamps else None

    def getLast(self) -> Any:
        """Return the first message with a timestamp >= `getLatestTime()`, or None if the cache is empty."""
        latest = self.getLatestTime()
        return None if latest is None else self.getElemAfterTime(latest)
