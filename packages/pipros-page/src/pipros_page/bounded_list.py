"""Limit the length of lists that are sent to browsers, because other nodes control their content."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

PAGE_VIEW_BYTES = 8 * 1024 * 1024
"""Limit: data that a page keeps for one of its tabs, such as log entries, diagnostics or parameters; also
the messages of one topic that are kept after a jump in a bag. Beyond it, the oldest log entries are dropped
and counted; further values, parameters and topics are omitted; after a jump in a bag, only the newest
messages of a topic are kept, at least one.
"""

T = TypeVar("T")


def bounded_list(rows: Iterable[T], share: int = 1) -> list[T]:
    """Return the first rows, up to a total text size of `PAGE_VIEW_BYTES` divided by `share`.

    >>> bounded_list(["/a", "/b"])
    ['/a', '/b']
    """
    left_bytes = PAGE_VIEW_BYTES // share
    found: list[T] = []
    for row in rows:
        left_bytes -= len(str(row))
        if left_bytes < 0:
            break
        found.append(row)
    return found
