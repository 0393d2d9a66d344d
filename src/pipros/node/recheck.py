"""Asks the master itself, because a caller may not be the master."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress

Question = Callable[[], object]


class Recheck:
    """Asks the master to confirm what an untrusted caller claims.

    The first question goes out at once. Those that come while it is under way, and for `interval_s` after
    its answer, go out together then, each once. So a peer that calls a thousand times costs the master one
    call, and what a master says from an unexpected address takes effect, though later. A thread of its own
    asks, so that the event loop never waits.
    """

    def __init__(self, interval_s: float) -> None:
        self._interval_s = interval_s
        self._waiting: dict[str, Question] = {}
        self._is_busy = False

    def ask(self, about: str, question: Question) -> None:
        """Has `question` called soon, in another thread. Called in the event loop.

        Args:
            about: what it is about; one that waits already is not asked twice.
        """
        self._waiting[about] = question
        if not self._is_busy:
            self._go_on()

    def _go_on(self) -> None:
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
            with suppress(RuntimeError):  # the node has ended, and its loop with it
                loop.call_soon_threadsafe(loop.call_later, self._interval_s, self._go_on)
