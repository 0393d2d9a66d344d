"""Threads for blocking calls and long computations, which must not run in the page's event loop.

`asyncio.to_thread` is not used: all views would share its threads (six on a machine with two cores), and the
shutdown of the event loop would wait for each of them.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from typing import ParamSpec, TypeVar

from pipros.net.workers import Workers

T = TypeVar("T")
P = ParamSpec("P")


class DaemonPool:
    """Runs functions for coroutines, in threads that do not keep the process alive."""

    def __init__(self, name: str, limit: int) -> None:
        """Create a pool that runs up to `limit` functions at a time.

        Excess functions are queued in order.
        """
        self._workers = Workers(name, limit)

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

        self._workers.run(work)
        return future
