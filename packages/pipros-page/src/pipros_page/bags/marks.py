"""Find the moments in a bag that the timeline marks: errors in the log, and diagnostics that get worse."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg.time import NS_PER_S
from pipros_page.bags.curve import PIECE_S
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.reader import BagReader

BINS: Final = 500
MARKS_OF_A_BIN: Final = 4
"""The bag is divided into `BINS` parts of equal duration, each of which has at most this many marks."""
LONGEST_TEXT: Final = 200
MAX_COMPONENTS: Final = 3000
ERROR_LEVEL: Final = 8
LOG: Final = ("/rosout_agg", "/rosout")
DIAGNOSTICS: Final = ("/diagnostics", "/diagnostics_agg")
"""Of each pair, only the first topic that is in the bag is read, because both have the same contents."""
DIAGNOSTIC_KINDS: Final = ("ok", "warning", "error", "stale")

Mark = tuple[float, str, str]
"""A time (s since 1970), a kind and a text. Kinds are `log` and all but the first of `DIAGNOSTIC_KINDS`."""


class BagMarks:
    """The marks of a bag, collected in pieces. All methods block. `reader` is closed by the caller.

    Attributes:
        left_out: number of marks that were left out so far, because too many are close to each other.
    """

    def __init__(self, reader: BagReader) -> None:
        self._reader = reader
        self._begin_ns, end_ns = reader.range_ns
        self._bin_ns = max(end_ns - self._begin_ns, 1) / BINS
        self._levels: dict[str, int] = {}
        self._bins: Counter[int] = Counter()
        self._known: set[tuple[int, str, str]] = set()
        self.left_out = 0
        log, diagnostics = (_first(reader, names) for names in (LOG, DIAGNOSTICS))
        self._log = {each.id for each in log}
        self._messages = reader.stored_messages([*log, *diagnostics])

    def next_piece(self) -> list[Mark] | None:
        """Return the next marks, or None at the end of the bag. Raise `BagError` if the bag is damaged."""
        marks: list[Mark] = []
        until_s = time.monotonic() + PIECE_S
        for message in self._messages:
            for kind, text in self._events(message):
                marks += self._mark(message.time_ns, kind, text[:LONGEST_TEXT])
            if time.monotonic() > until_s:
                return marks
        return marks or None

    def _mark(self, time_ns: int, kind: str, text: str) -> Iterator[Mark]:
        at = int((time_ns - self._begin_ns) / self._bin_ns)
        if (at, kind, text) in self._known:
            return
        if self._bins[at] >= MARKS_OF_A_BIN:
            self.left_out += 1
            return
        self._bins[at] += 1
        self._known.add((at, kind, text))
        yield time_ns / NS_PER_S, kind, text

    def _events(self, message: StoredMessage) -> Iterator[tuple[str, str]]:
        is_log = message.connection.id in self._log
        if is_log and _log_level(message.data) < ERROR_LEVEL:
            return
        try:
            decoded = self._reader.class_of(message.connection)._from_bytes(message.data)
            yield from self._log_events(decoded) if is_log else self._diagnostic_events(decoded)
        except (PiprosError, AttributeError, TypeError):  # the topic has another type
            return

    def _log_events(self, entry: Any) -> Iterator[tuple[str, str]]:
        if entry.level >= ERROR_LEVEL:
            yield "log", f"{entry.name}: {entry.msg}"

    def _diagnostic_events(self, array: Any) -> Iterator[tuple[str, str]]:
        for status in array.status:
            level = status.level if isinstance(status.level, int) else ord(status.level)
            if status.name not in self._levels and len(self._levels) >= MAX_COMPONENTS:
                continue
            before = self._levels.get(status.name, 0)
            self._levels[status.name] = level
            if before < level < len(DIAGNOSTIC_KINDS):
                yield DIAGNOSTIC_KINDS[level], f"{status.name}: {status.message}"


def _first(reader: BagReader, names: tuple[str, ...]) -> list[Connection]:
    return next((found for name in names if (found := reader.connections_of(name))), [])


def _log_level(data: bytes) -> int:
    """Return the level of a serialized `rosgraph_msgs/Log` without decoding it; 0 if it is too short.

    Its header consists of 12 bytes, the length of the frame's name in four bytes, and that name.
    """
    at = 16 + int.from_bytes(data[12:16], "little")
    return data[at] if at < len(data) else 0
