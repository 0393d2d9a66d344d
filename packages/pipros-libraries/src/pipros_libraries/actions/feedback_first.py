"""Keep an action's result from overtaking the feedback before it."""

from __future__ import annotations

import time
from typing import Final

from pipros.basics import one_thread

FEEDBACK_FIRST_S: Final = 0.002
"""Least time between feedback and the next result. Clients receive the two over different connections, in
threads that compete, and ignore feedback that comes after the result. Genuine servers take about as long.
"""


class FeedbackFirst:
    """Waits before a result that would follow too soon. Not thread-safe."""

    def __init__(self) -> None:
        self._last_s = float("-inf")

    def note_feedback(self) -> None:
        """Call it after feedback was published."""
        self._last_s = time.monotonic()

    def wait(self) -> None:
        """Call it before a result is published."""
        left_s = self._last_s + FEEDBACK_FIRST_S - time.monotonic()
        if left_s > 0 and one_thread.has_threads():
            time.sleep(left_s)
