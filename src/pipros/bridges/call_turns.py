"""Threads for the service calls of a bridge's clients, with a share for each client."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, ParamSpec, TypeVar

from pipros.basics.budget import Budget
from pipros.net.workers import Workers

T = TypeVar("T")
P = ParamSpec("P")

PART_OF_A_CLIENT: Final = 1 / 4
"""Largest part of the calls at once that one client gets."""


class CallTurns:
    """Runs calls that may block for minutes. Thread-safe; no method blocks.

    Each client may always run one call. Beyond these, the calls of all clients share `at_once` threads. A
    client gets a quarter of them, and at most half of what the other clients leave; its further calls wait.
    """

    def __init__(self, name: str, at_once: int) -> None:
        self._slots = Budget(at_once)
        self._calls_of_a_client = 1 + int(at_once * PART_OF_A_CLIENT)
        self._workers = Workers(name)

    def user(self) -> ClientCalls:
        """Return the calls of a new client."""
        return ClientCalls(self._workers, Budget(self._calls_of_a_client, self._slots, part=0.5, own=1))

    def close(self) -> None:
        """End the idle threads."""
        self._workers.close()


class ClientCalls:
    """The calls of one client, which start in order."""

    def __init__(self, workers: Workers, slots: Budget) -> None:
        self._workers = workers
        self._slots = slots
        self._waiting: deque[Callable[[], object]] = deque()
        self._lock = threading.Lock()

    def run(self, call: Callable[[], object]) -> None:
        """Start a call in a thread, or queue it.

        Raises:
            RuntimeError: the system cannot start another thread.
        """
        with self._lock:
            if self._waiting or not self._slots.take(1):
                self._waiting.append(call)
                return
        self._start(call)

    async def wait_for(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run a call in a thread, and return its result or raise its exception.

        If the caller is cancelled, a waiting call is not started, and the result of a running one is dropped.
        """
        future: Future[T] = Future()

        def work() -> None:
            if future.set_running_or_notify_cancel():
                try:
                    result = call(*args, **kwargs)
                except BaseException as error:
                    future.set_exception(error)
                else:
                    future.set_result(result)

        self.run(work)
        return await asyncio.wrap_future(future)

    def close(self) -> None:
        """Drop the calls that wait. Running calls are not interrupted, but no longer count."""
        with self._lock:
            self._waiting.clear()
            self._slots.close()

    def _start(self, call: Callable[[], object]) -> None:
        try:
            self._workers.run(self._run, call)
        except RuntimeError:
            self._slots.give_back(1)
            raise

    def _run(self, call: Callable[[], object]) -> None:
        try:
            call()
        finally:
            following = self._next()
            if following is not None:
                self._start(following)

    def _next(self) -> Callable[[], object] | None:
        """Return the next call for the current slot, or return the slot."""
        with self._lock:
            if self._waiting:
                return self._waiting.popleft()
            self._slots.give_back(1)
            return None
