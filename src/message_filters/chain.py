"""Filters one behind the other, as roscpp's message_filters has them."""

from __future__ import annotations

from typing import Any

from message_filters.simple_filter import SimpleFilter


class PassThrough(SimpleFilter):
    """Passes on what it gets."""

    def __init__(self, f: SimpleFilter | None = None) -> None:
        super().__init__()
        if f is not None:
            self.connectInput(f)

    def connectInput(self, f: SimpleFilter) -> None:
        """Passes on the messages of this filter."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, *msg: Any) -> None:
        """Passes on a message."""
        self.signalMessage(*msg)


class Chain(SimpleFilter):
    """Filters that feed each other in the order in which they were added; the output is that of the last."""

    def __init__(self, f: SimpleFilter | None = None) -> None:
        super().__init__()
        self._filters: list[Any] = []
        self._input = PassThrough(f)

    def connectInput(self, f: SimpleFilter) -> None:
        """Feeds the first filter with the messages of this one."""
        self._input.connectInput(f)

    def add(self, *msg: Any) -> None:
        """Feeds a message to the first filter."""
        self._input.add(*msg)

    def addFilter(self, f: Any) -> int:
        """Adds a filter, which must have `connectInput`, to the end. Returns its number."""
        f.connectInput(self._filters[-1] if self._filters else self._input)
        self._filters.append(f)
        number = len(self._filters) - 1
        f.registerCallback(lambda *msg: self._pass_on(number, msg))
        return number

    def getFilter(self, index: int) -> Any:
        """The filter with this number, None where there is none."""
        return self._filters[index] if 0 <= index < len(self._filters) else None

    def _pass_on(self, number: int, msg: tuple[Any, ...]) -> None:
        if number == len(self._filters) - 1:
            self.signalMessage(*msg)
