"""Find the newest message at or before a time in a bag, without reading the whole bag."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

from pipros.msg.time import NS_PER_S
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.errors import NoMessages
from pipros_tools.bag.reader import BagReader

FIRST_WINDOW_NS: Final = NS_PER_S // 10
"""Length of the first time window that is searched for the newest message before a moment."""
WINDOW_GROWTH: Final = 4

IsOver = Callable[[], bool]
"""Returns whether the messages being read are no longer needed."""


def newest_before(
    reader: BagReader,
    connections: Sequence[Connection],
    moment_ns: int,
    is_over: IsOver = lambda: False,
) -> StoredMessage | None:
    """Return the newest message at or before a time, or None if there is none or `is_over` returns True.

    Reads backwards, in time windows of increasing length.
    """
    try:
        begin_ns = reader.range_ns[0]
    except NoMessages:
        return None
    end_ns, window_ns = moment_ns, FIRST_WINDOW_NS
    while connections and end_ns >= begin_ns:
        first_ns = max(begin_ns, end_ns - window_ns)
        messages = reader.stored_messages(connections, first_ns, end_ns)
        newest = deque(itertools.takewhile(lambda _: not is_over(), messages), maxlen=1)
        if is_over():
            return None
        if newest:
            return newest[0]
        end_ns, window_ns = first_ns - 1, window_ns * WINDOW_GROWTH
    return None
