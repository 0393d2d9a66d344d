"""Threads for what must not run in the event loop of the page: calls that block, and long computations.

The threads of `asyncio.to_thread` would serve all views together, six of them on a machine with two cores,
and the end of the event loop waits for each.
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
        """`limit` functions run at a time; further ones wait, in the order of their start."""
        self._workers = Workers(name, limit)

    async def run(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Return what the function returns, or raise what it raises.

        If the caller is cancelled, a function that still waits is not run; the result of another is dropped.
        """
        return await asyncio.wrap_future(self.start(function, *args, **kwargs))

    def start(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Start a function, from any thread.

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
