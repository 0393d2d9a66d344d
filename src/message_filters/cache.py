"""The newest messages of a filter, to be asked for by time."""

from __future__ import annotations

from typing import Any

from message_filters.simple_filter import SimpleFilter, stamp_of
from pipros.filters.history import History


class Cache(SimpleFilter):
    """Keeps the newest messages of a filter in the order of their arrival, and passes them on.

    Args:
        f: the filter whose messages are kept.
        cache_size: how many.
        allow_headerless: keep messages without header by the time of their arrival; otherwise they are
        dropped.
    """

    def __init__(self, f: SimpleFilter, cache_size: int = 1, allow_headerless: bool = False) -> None:
        super().__init__()
        self._history = History(cache_size)
        self.allow_headerless = allow_headerless
        self.connectInput(f)

    @property
    def cache_size(self) -> int:
        """How many messages are kept."""
        return self._history.size

    @cache_size.setter
    def cache_size(self, value: int) -> None:
        self._history.size = value

    @property
    def cache_msgs(self) -> list[Any]:
        """The messages, in the order of their arrival."""
        return self._history.messages

    @property
    def cache_times(self) -> list[Any]:
        """Their stamps."""
        return self._history.stamps

    def connectInput(self, f: SimpleFilter) -> None:
        """Keeps the messages of this filter, too."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Keeps a message and passes it on."""
        stamp = stamp_of(msg, self.allow_headerless)
        if stamp is not None:
            self._history.add(stamp, msg)
            self.signalMessage(msg)

    def getInterval(self, from_stamp: Any, to_stamp: Any) -> list[Any]:
        """The messages from one stamp to another, both included.

        Raises AssertionError if the first is later than the second, as Noetic's does.
        """
        if from_stamp > to_stamp:
            raise AssertionError(f"from_stamp must not be after to_stamp, got {from_stamp} and {to_stamp}")
        return self._history.between(from_stamp, to_stamp)

    def getElemAfterTime(self, stamp: Any) -> Any:
        """The first message with this stamp or a later one, None without any."""
        return self._history.first_from(stamp)

    def getElemBeforeTime(self, stamp: Any) -> Any:
        """The last message with this stamp or an earlier one, None without any."""
        return self._history.last_until(stamp)

    def getLatestTime(self) -> Any:
        """The stamp of the message that arrived last, None without any."""
        stamps = self._history.stamps
        return stamps[-1] if stamps else None

    def getLastestTime(self) -> Any:
        """The same as `getLatestTime`: an old name."""
        return self.getLatestTime()

    def getOldestTime(self) -> Any:
        """The stamp of the message that arrived first of those that are kept, None without any."""
        stamps = self._history.stamps
        return stamps[0] if stamps else None

    def getLast(self) -> Any:
        """The first message with the newest stamp or a later one, None without any."""
        latest = self.getLatestTime()
        return None if latest is None else self.getElemAfterTime(latest)
