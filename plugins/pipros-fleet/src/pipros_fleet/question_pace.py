"""How often each member may ask."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from pipros_fleet.directory import FLEET_MEMBERS, FLEET_TOPICS

FLEET_QUESTIONS = 1000
"""Maximum number of questions and calls of a member per second that another answers, besides a burst of two
for each topic that a fleet can have. Beyond it, a question has no answer.
"""


_EACH_NS = 1_000_000_000 // FLEET_QUESTIONS


class QuestionPace:
    """Counts questions of each asker. Thread-safe."""

    def __init__(self, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._clock_ns = clock_ns
        self._due_ns: dict[str, int] = {}
        self._lock = threading.Lock()

    def allows(self, asker: str) -> bool:
        """Count a question, and return True, unless its asker asks too often."""
        now_ns = self._clock_ns()
        with self._lock:
            due_ns = max(self._due_ns.pop(asker, 0), now_ns - 2 * FLEET_TOPICS * _EACH_NS)
            is_allowed = due_ns < now_ns
            self._due_ns[asker] = due_ns + is_allowed * _EACH_NS
            if len(self._due_ns) > FLEET_MEMBERS:
                del self._due_ns[next(iter(self._due_ns))]  # the one that has not asked for the longest time
        return is_allowed
