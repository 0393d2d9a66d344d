"""One asyncio event loop in a background thread: where a node's control traffic lives."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

T = TypeVar("T")

#: A transport that is closed (by a task that was cancelled in the middle of an accept, for example)
#: closes its socket in the turn after the next.
CLOSING_TURNS = 3


class BackgroundLoop:
    """Runs an event loop in a thread of its own, for threads that want to block.

    Every method but `start` and `stop` may be called from any thread except the loop's own.
    Tasks still running at `stop` are cancelled and awaited.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._thread: threading.Thread | None = None
        self.asyncio: asyncio.AbstractEventLoop

    def start(self) -> None:
        started = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(started,), name=self._name, daemon=True)
        self._thread.start()
        started.wait()

    def run(self, coroutine: Coroutine[Any, Any, T], timeout_s: float | None = None) -> T:
        """Runs a coroutine in the loop and waits for its result."""
        return asyncio.run_coroutine_threadsafe(coroutine, self.asyncio).result(timeout_s)

    def spawn(self, coroutine: Coroutine[Any, Any, Any]) -> concurrent.futures.Future[Any]:
        """Starts a coroutine in the loop; the caller goes on."""
        return asyncio.run_coroutine_threadsafe(coroutine, self.asyncio)

    def call(self, function: Callable[..., object], *args: object) -> None:
        """Calls a function in the loop soon; ignored when the loop has ended."""
        with contextlib.suppress(RuntimeError):
            self.asyncio.call_soon_threadsafe(function, *args)

    def stop(self) -> None:
        """Cancels what still runs, ends the loop and waits for its thread. Harmless when repeated."""
        thread, self._thread = self._thread, None
        if thread is None:
            return
        self.call(self.asyncio.stop)
        if thread is not threading.current_thread():
            thread.join()

    def _run(self, started: threading.Event) -> None:
        # A selector loop on every system: links are watched by their file descriptors.
        self.asyncio = loop = asyncio.SelectorEventLoop()
        asyncio.set_event_loop(loop)
        loop.call_soon(started.set)
        try:
            loop.run_forever()
            left = asyncio.all_tasks(loop)
            for task in left:
                task.cancel()
            loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
            for _ in range(CLOSING_TURNS):
                loop.run_until_complete(asyncio.sleep(0))
        finally:
            loop.close()
