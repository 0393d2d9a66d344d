"""`Chain` and `PassThrough`, as in roscpp's message_filters."""

from __future__ import annotations

from typing import Any

from message_filters.simple_filter import SimpleFilter


class PassThrough(SimpleFilter):
    """Filter that passes messages on unchanged."""

    def __init__(self, f: SimpleFilter | None = None) -> None:
        super().__init__()
        if f is not None:
            self.connectInput(f)

    def connectInput(self, f: SimpleFilter) -> None:
        """Connect a filter as an input."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, *msg: Any) -> None:
        """Pass a message on."""
        self.signalMessage(*msg)


class Chain(SimpleFilter):
    """Filters in series, in the order in which they were added.

    The chain's output is the last filter's output.
    """

    def __init__(self, f: SimpleFilter | None = None) -> None:
        super().__init__()
        self._filters: list[Any] = []
        self._input = PassThrough(f)

    def connectInput(self, f: SimpleFilter) -> None:
        """Connect a filter as the input of the chain."""
        self._input.connectInput(f)

    def add(self, *msg: Any) -> None:
        """Pass a message to the first filter."""
        self._input.add(*msg)

    def addFilter(self, f: Any) -> int:
        """Append a filter, which must have `connectInput`. Return its index."""
        f.connectInput(self._filters[-1] if self._filters else self._input)
        self._filters.append(f)
        number = len(self._filters) - 1
        f.registerCallback(lambda *msg: self._pass_on(number, msg))
        return number

    def getFilter(self, index: int) -> Any:
        """Return the filter with the given index, or None if it does not exist."""
        return self._filters[index] if 0 <= index < len(self._filters) else None

    def _pass_on(self, number: int, msg: tuple[Any, ...]) -> None:
        if number == len(self._filters) - 1:
            self.signalMessage(*msg)
