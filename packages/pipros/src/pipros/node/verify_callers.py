"""Verify the claims of untrusted callers with the master."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress

Question = Callable[[], object]


class CallerVerification:
    """Queries the master about the claims of untrusted callers.

    The first query is sent immediately. Queries that are requested while it is running, or within
    `interval_s` after its response, are sent together afterwards, without duplicates. A peer that calls a
    thousand times therefore costs the master few calls, and a notice from a master with an unexpected address
    still takes effect, though later. Queries run in a separate thread, so that the event loop never waits.
    """

    def __init__(self, interval_s: float) -> None:
        self._interval_s = interval_s
        self._waiting: dict[str, Question] = {}
        self._is_busy = False

    def ask(self, about: str, question: Question) -> None:
        """Schedule `question` to be called in another thread. Must be called from the event loop.

        Args:
            about: the subject. A queued question with the same subject is replaced.
        """
        self._waiting[about] = question
        if not self._is_busy:
            self._send_next()

    def _send_next(self) -> None:
        questions, self._waiting = self._waiting, {}
        self._is_busy = bool(questions)
        if questions:
            loop = asyncio.get_running_loop()
            threading.Thread(
                target=self._ask_all, args=(questions, loop), name="question to the master", daemon=True
            ).start()

    def _ask_all(self, questions: Mapping[str, Question], loop: asyncio.AbstractEventLoop) -> None:
        try:
            for question in questions.values():
                question()
        finally:
            with suppress(RuntimeError):  # the node and its event loop have ended
                loop.call_soon_threadsafe(loop.call_later, self._interval_s, self._send_next)
