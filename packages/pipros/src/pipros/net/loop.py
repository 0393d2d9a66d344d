"""An asyncio event loop in a background thread, for example for a node's control traffic."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import errno
import selectors
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from pipros.basics import one_thread
from pipros.basics.interruptible_wait import OnceEvent
from pipros.basics.posix import require_sockets
from pipros.net.lookup import Lookups, process_lookups
from pipros.net.refusals import Refusals
from pipros.net.workers import Workers

T = TypeVar("T")

CLOSING_TURNS = 3
"""A closed transport, for example one whose task was cancelled during an accept, closes its socket two loop
iterations later.
"""

CANCEL_AGAIN_S = 0.5
"""How long a task may take to end after its cancellation, for example to close what it has opened."""

OUT_OF_DESCRIPTORS = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})


class BackgroundLoop:
    """Runs an event loop in its own thread, on behalf of other threads.

    `spawn` and `call` may be called from any thread, `run` from any thread other than the loop's. `stop`
    cancels and awaits running tasks. Host name lookups and the default executor use daemon threads, so
    neither `stop` nor interpreter exit waits for them. Without threads, the loop runs where the only thread
    waits.
    """

    def __init__(self, name: str, lookups: Lookups | None = None) -> None:
        """Resolve host names with `lookups`, which defaults to the process-wide lookups."""
        self._name = name
        self._lookups = lookups or process_lookups()
        self._thread: threading.Thread | None = None
        self.asyncio: asyncio.AbstractEventLoop

    def start(self) -> None:
        """Start the loop and return once it is running.

        Raises:
            OSError: no file descriptors are left.
            NeedsSockets: Python runs in a browser.
        """
        require_sockets()
        # Use a selector loop on every system, because links are watched by their file descriptors.
        self.asyncio = _Loop(f"{self._name}: blocking", self._lookups)
        if one_thread.drive(self.asyncio):
            return
        started = OnceEvent()
        self.asyncio.call_soon(started.set)
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()
        started.wait()

    def run(self, coroutine: Coroutine[Any, Any, T], timeout_s: float | None = None) -> T:
        """Run a coroutine in the loop and wait for its result.

        Raises:
            TimeoutError: the coroutine took longer than `timeout_s`.
            RuntimeError: the loop has stopped.
        """
        # Future.result is not used: if a signal handler raised an exception in it, a lock that the loop
        # needs could stay locked.
        done = OnceEvent()
        tasks: list[asyncio.Task[T]] = []
        has_given_up = False

        def begin() -> None:
            if has_given_up:
                return
            task = self.asyncio.create_task(coroutine)
            tasks.append(task)
            task.add_done_callback(lambda _: done.set())

        try:
            self.asyncio.call_soon_threadsafe(begin)
        except RuntimeError:
            coroutine.close()
            raise
        if not done.wait(timeout_s):
            has_given_up = True
            if not tasks:  # the coroutine has not started, because the loop is busy or has stopped
                coroutine.close()
            raise TimeoutError(f"{self._name}: no result within {timeout_s} s")
        return tasks[0].result()

    def spawn(self, coroutine: Coroutine[Any, Any, Any]) -> concurrent.futures.Future[Any]:
        """Start a coroutine in the loop, without waiting for it."""
        return asyncio.run_coroutine_threadsafe(coroutine, self.asyncio)

    def call(self, function: Callable[..., object], *args: object) -> bool:
        """Schedule a call in the loop. Return False if the loop has stopped."""
        try:
            self.asyncio.call_soon_threadsafe(function, *args)
        except RuntimeError:
            return False
        return True

    def stop(self, timeout_s: float | None = None) -> None:
        """Cancel running tasks, stop the loop and wait for its thread. May be called repeatedly."""
        thread, self._thread = self._thread, None
        if not one_thread.has_threads():
            if not self.asyncio.is_closed():
                self._close()
            return
        if thread is None:
            return
        self.call(self.asyncio.stop)
        if thread is not threading.current_thread():
            thread.join(timeout_s)

    def _run(self) -> None:
        asyncio.set_event_loop(self.asyncio)
        try:
            self.asyncio.run_forever()
        finally:
            self._close()

    def _close(self) -> None:
        """Cancel the tasks that are left, and close the loop, which does not run."""
        loop = self.asyncio
        try:
            # Up to Python 3.11, `asyncio.wait_for` drops a cancellation that arrives just when it is done. A
            # task with an endless loop then runs on, so it is cancelled again.
            while left := asyncio.all_tasks(loop):
                for task in left:
                    task.cancel()
                ended = asyncio.gather(*left, return_exceptions=True)
                loop.run_until_complete(asyncio.wait((ended,), timeout=CANCEL_AGAIN_S))
            for _ in range(CLOSING_TURNS):
                loop.run_until_complete(asyncio.sleep(0))
        finally:
            loop.close()


class _Loop(asyncio.SelectorEventLoop):
    """An event loop that uses daemon threads for blocking work.

    Python joins asyncio's own executor at exit, so one unanswered name lookup would keep the process alive
    for half a minute.
    """

    def __init__(self, name: str, lookups: Lookups) -> None:
        self._lookups = lookups
        self._workers = Workers(name)
        self._refusals = Refusals()
        selector = selectors.DefaultSelector()
        try:
            super().__init__(selector)
        except OSError:  # a partially constructed loop cannot close itself
            selector.close()
            asyncio.BaseEventLoop.close(self)
            raise

    async def getaddrinfo(self, host: Any, port: Any, **wanted: Any) -> list[Any]:
        answer = self._lookups.ask(host, **wanted)
        done = self.create_future()
        answer.when_done(lambda: _resolve(self, done, lambda: done.set_result(None)))
        await done
        return answer.addresses(port)

    def run_in_executor(self, executor: Any, function: Callable[..., T], *args: Any) -> asyncio.Future[T]:  # type: ignore[override]
        if executor is not None and one_thread.has_threads():
            return super().run_in_executor(executor, function, *args)
        return _outcome(self, self._workers.run, function, *args)

    def call_exception_handler(self, context: dict[str, Any]) -> None:
        """Report an error as asyncio does, but log only one line if a server is out of descriptors.

        The server retries in that case, so a traceback would be repeated.
        """
        error = context.get("exception")
        if isinstance(error, OSError) and error.errno in OUT_OF_DESCRIPTORS and "socket" in context:
            self._refusals.count("new connections", error.strerror or "out of descriptors")
        else:
            super().call_exception_handler(context)

    def close(self) -> None:
        self._workers.close()
        super().close()


def in_daemon_thread(function: Callable[..., T], *args: Any) -> asyncio.Future[T]:
    """Call a function in a new daemon thread. Return a future of the running event loop for its result.

    Without threads, it is called in a later turn.

    Neither the loop nor the interpreter, on exit, waits for the thread. Cancelling the future ends the
    wait, but does not stop the function.
    """

    def run(job: Callable[[], None]) -> None:
        one_thread.start_thread(job, name=getattr(function, "__name__", "call"))

    return _outcome(asyncio.get_running_loop(), run, function, *args)


def _outcome(
    loop: asyncio.AbstractEventLoop,
    run: Callable[[Callable[[], None]], None],
    function: Callable[..., T],
    *args: Any,
) -> asyncio.Future[T]:
    """Return a future for the result of a function that `run` calls in another thread."""
    future: asyncio.Future[T] = loop.create_future()

    def job() -> None:
        try:
            value = function(*args)
        except BaseException as error:
            failure = error
            _resolve(loop, future, lambda: future.set_exception(failure))
        else:
            _resolve(loop, future, lambda: future.set_result(value))

    run(job)
    return future


def _resolve(
    loop: asyncio.AbstractEventLoop, future: asyncio.Future[Any], resolve: Callable[[], None]
) -> None:
    """Resolve a future in its loop, unless the future was cancelled or the loop has stopped."""

    def unless_cancelled() -> None:
        if not future.done():
            resolve()

    with contextlib.suppress(RuntimeError):
        loop.call_soon_threadsafe(unless_cancelled)
