"""Threads for blocking calls and long computations, which must not run in the page's event loop.

`asyncio.to_thread` is not used: all views would share its threads (six on a machine with two cores), and the
shutdown of the event loop would wait for each of them.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import ParamSpec, TypeVar

from pipros.basics.turns import Turns
from pipros.net.workers import Workers
from pipros_server.browser_share import Browser, browser_or_none, has_share

T = TypeVar("T")
P = ParamSpec("P")


class DaemonPool:
    """Runs functions for coroutines, in threads that do not keep the process alive."""

    def __init__(self, name: str, limit: int) -> None:
        """Create a pool that runs up to `limit` functions at a time.

        Excess functions are queued: those of each browser in order, and the browsers in turn. A browser may
        use up to half of the threads that others leave; what starts outside of browsers may use all threads.
        """
        self._workers = Workers(name, limit)
        self._limit = limit
        self._running: list[Browser | None] = []
        self._turns = Turns[Browser | None, Callable[[], None]]()
        self._lock = threading.Lock()

    async def run(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run a function in a thread, and return its result or raise its exception.

        If the caller is cancelled, a queued function is not run, and the result of a running function is
        discarded.
        """
        return await asyncio.wrap_future(self.start(function, *args, **kwargs))

    def start(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Schedule a function. Does not block. Thread-safe.

        Raises:
            RuntimeError: the system cannot start another thread.
        """
        future: Future[T] = Future()

        def work() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                result = function(*args, **kwargs)
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)

        with self._lock:
            self._turns.put(browser_or_none(), work)
        try:
            self._workers.run(self._take_turn)
        except BaseException:
            future.cancel()
            raise
        return future

    def _take_turn(self) -> None:
        """Run functions until none is left that may run now."""
        while True:
            with self._lock:
                try:
                    browser, work = self._turns.pop(self._may_run)
                except IndexError:
                    return
                self._running.append(browser)
            work()
            with self._lock:
                self._running.remove(browser)

    def _may_run(self, browser: Browser | None) -> bool:
        return has_share(browser, self._running, self._limit)
