"""Threads for the service calls of a bridge's clients, with a limit for each client."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from typing import Final, ParamSpec, TypeVar

from pipros.basics.budget import Budget
from pipros.basics.turns import Turns
from pipros.net.workers import Workers

logger = logging.getLogger("pipros_bridges")

T = TypeVar("T")
P = ParamSpec("P")

PART_OF_A_CLIENT: Final = 1 / 4
"""Largest share of the concurrent calls that one client may have."""


class CallTurns:
    """Runs calls that may block for minutes. Thread-safe; no method blocks.

    Each client may always run one call. Beyond these, the calls of all clients share `at_once` threads. A
    client gets at most a quarter of these threads, and at most half of the threads that the other clients
    leave free; its further calls wait.
    """

    def __init__(self, name: str, at_once: int) -> None:
        self._slots = Budget(at_once)
        self._calls_of_a_client = 1 + int(at_once * PART_OF_A_CLIENT)
        self._workers = Workers(name)

    def user(self) -> ClientCalls:
        """Return an object that runs the calls of a new client."""
        return ClientCalls(self._workers, Budget(self._calls_of_a_client, self._slots, part=0.5, own=1))

    def close(self) -> None:
        """End the idle threads."""
        self._workers.close()


class QuestionTurns:
    """Runs short calls of all clients in turn, in a few threads. Thread-safe; no method blocks.

    A thread per client would not be faster: the threads would wait for each other, and delay the rest of the
    program.
    """

    def __init__(self, name: str, threads: int) -> None:
        self._threads = self._idle = threads
        self._calls: Turns[Hashable, Callable[[], object]] = Turns()
        self._workers = Workers(name)
        self._lock = threading.Lock()

    def run(self, user: Hashable, call: Callable[[], object]) -> None:
        """Start a call in a thread, or queue it.

        Raises:
            RuntimeError: no thread is running, and the system cannot start one.
        """
        with self._lock:
            self._calls.put(user, call)
            if not self._idle:
                return
            self._idle -= 1
        try:
            self._workers.run(self._work)
        except RuntimeError:
            with self._lock:
                self._idle += 1
                if self._idle < self._threads:  # another thread will make the call
                    return
                self._calls.forget(user)
            raise

    def forget(self, user: Hashable) -> None:
        """Drop the waiting calls of a client that has left."""
        with self._lock:
            self._calls.forget(user)

    def close(self) -> None:
        """End the idle threads."""
        self._workers.close()

    def _work(self) -> None:
        while True:
            with self._lock:
                if not len(self._calls):
                    self._idle += 1
                    return
                _, call = self._calls.pop()
            try:
                call()
            except Exception:
                logger.exception("unexpected error in a client's request")


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

        If the caller is cancelled, a waiting call is not started, and the result of a running call is
        dropped.
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
        """Drop the waiting calls. Running calls are not interrupted, but no longer count against limits."""
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
        """Return the next call for the current slot. If there is none, give the slot back and return None."""
        with self._lock:
            if self._waiting:
                return self._waiting.popleft()
            self._slots.give_back(1)
            return None
