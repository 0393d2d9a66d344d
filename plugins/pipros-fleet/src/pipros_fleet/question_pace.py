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


class QuestionPace:
    """Counts questions of each asker. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._due_s: dict[str, float] = {}
        self._lock = threading.Lock()

    def allows(self, asker: str) -> bool:
        """Count a question, and return True, unless its asker asks too often."""
        now_s = self._clock()
        with self._lock:
            due_s = max(self._due_s.pop(asker, 0.0), now_s - 2 * FLEET_TOPICS / FLEET_QUESTIONS)
            is_allowed = due_s < now_s
            self._due_s[asker] = due_s + is_allowed / FLEET_QUESTIONS
            if len(self._due_s) > FLEET_MEMBERS:
                del self._due_s[next(iter(self._due_s))]  # the one that has not asked for the longest time
        return is_allowed
