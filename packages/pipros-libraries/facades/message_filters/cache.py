"""`Cache`, a history of messages that can be searched by time."""

from __future__ import annotations

from typing import Any

from message_filters.simple_filter import SimpleFilter, stamp_of
from pipros_libraries.filters.history import MessageHistory


class Cache(SimpleFilter):
    """Filter that passes messages on and keeps the most recent messages in order of arrival.

    Args:
        f: the input filter.
        cache_size: maximum number of messages.
        allow_headerless: whether to use the time of arrival as the timestamp of messages without a header,
            instead of dropping them.
    """

    def __init__(self, f: SimpleFilter, cache_size: int = 1, allow_headerless: bool = False) -> None:
        super().__init__()
        self._history = MessageHistory(cache_size)
        self.allow_headerless = allow_headerless
        self.connectInput(f)

    @property
    def cache_size(self) -> int:
        """Maximum number of messages."""
        return self._history.size

    @cache_size.setter
    def cache_size(self, value: int) -> None:
        self._history.size = value

    @property
    def cache_msgs(self) -> list[Any]:
        """The messages in order of arrival."""
        return self._history.messages

    @property
    def cache_times(self) -> list[Any]:
        """The timestamps of the messages in order of arrival."""
        return self._history.stamps

    def connectInput(self, f: SimpleFilter) -> None:
        """Connect another filter as an input."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Add a message and pass it on."""
        stamp = stamp_of(msg, self.allow_headerless)
        if stamp is not None:
            self._history.add(stamp, msg)
            self.signalMessage(msg)

    def getInterval(self, from_stamp: Any, to_stamp: Any) -> list[Any]:
        """Return the messages with timestamps from `from_stamp` to `to_stamp`, inclusive.

        Raises AssertionError if `from_stamp` is after `to_stamp`, as in Noetic.
        """
        if from_stamp > to_stamp:
            raise AssertionError(f"from_stamp must not be after to_stamp, got {from_stamp} and {to_stamp}")
        return self._history.between(from_stamp, to_stamp)

    def getElemAfterTime(self, stamp: Any) -> Any:
        """Return the first message in order of arrival whose timestamp is >= `stamp`, or None."""
        return self._history.first_from(stamp)

    def getElemBeforeTime(self, stamp: Any) -> Any:
        """Return the last message in order of arrival whose timestamp is <= `stamp`, or None."""
        return self._history.last_until(stamp)

    def getLatestTime(self) -> Any:
        """Return the timestamp of the message that arrived last, or None if the cache is empty."""
        stamps = self._history.stamps
        return stamps[-1] if stamps else None

    def getLastestTime(self) -> Any:
        """Same as `getLatestTime`, under Noetic's deprecated misspelt name."""
        return self.getLatestTime()

    def getOldestTime(self) -> Any:
        """Return the timestamp of the cached message that arrived first, or None if the cache is empty."""
        stamps = self._history.stamps
        return stamps[0] if stamps else None

    def getLast(self) -> Any:
        """Return the first message with a timestamp >= `getLatestTime()`, or None if the cache is empty."""
        latest = self.getLatestTime()
        return None if latest is None else self.getElemAfterTime(latest)
