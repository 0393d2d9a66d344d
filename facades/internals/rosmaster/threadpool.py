"""`rosmaster.threadpool`: a thread pool that runs tasks with the same marker sequentially.

pipros's master uses an event loop instead; this module is for code that uses the pool directly.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "logging time:sleep traceback")


class Task(NamedTuple):
    """A task of a pool: calls `function(*args)`, and `callback` with its result."""

    marker: Hashable
    function: Callable[..., Any]
    args: Sequence[Any]
    callback: Callable[[Any], object] | None


class MarkedThreadPool:
    """Thread pool that runs tasks in order; at most one task per marker runs at a time."""

    def __init__(self, numThreads: int) -> None:  # its name in rosmaster
        self._changed = threading.Condition()
        self._tasks: list[Task] = []
        self._busy: set[Hashable] = set()
        self._threads: list[ThreadPoolThread] = []
        self._is_joining = False
        self.set_thread_count(numThreads)

    def set_thread_count(self, newNumThreads: int) -> bool:
        """Start threads, or end some after their current task; return False while `join_all` runs."""
        if self._is_joining:
            return False
        self._resize(newNumThreads)
        return True

    def _resize(self, count: int) -> None:
        while len(self._threads) < count:
            self._threads.append(ThreadPoolThread(self))
            self._threads[-1].start()
        while len(self._threads) > count:
            self._threads.pop().go_away()

    def get_thread_count(self) -> int:
        return len(self._threads)

    def queue_task(
        self,
        marker: Hashable,
        task: Callable[..., Any],
        args: Sequence[Any] | None = None,
        taskCallback: Callable[[Any], object] | None = None,
    ) -> bool:
        """Queue `task(*args)`; return False, and discard it, during `join_all` or if it is not callable.

        Args:
            marker: tasks with the same marker run sequentially.
            taskCallback: called with the task's result.
        """
        if self._is_joining or not callable(task):
            return False
        with self._changed:
            self._tasks.append(Task(marker, task, args or (), taskCallback))
            self._changed.notify()
        return True

    def get_next_task(self, is_over: Callable[[], bool] = lambda: True) -> Task | None:
        """Return the first task whose marker is free, and mark it as busy; None if there is none.

        Blocks until there is one or `is_over()` is true. Call `remove_marker` when the task is done.
        """
        with self._changed:
            while True:
                for task in self._tasks:
                    if task.marker not in self._busy:
                        self._tasks.remove(task)
                        self._busy.add(task.marker)
                        return task
                if is_over():
                    return None
                self._changed.wait()

    def remove_marker(self, marker: Hashable) -> None:
        """Release a marker after its task, so that the next one can run."""
        with self._changed:
            self._busy.discard(marker)
            self._changed.notify_all()

    def wake(self) -> None:
        """Wake the threads, so that they check whether to end."""
        with self._changed:
            self._changed.notify_all()

    def join_all(self, wait_for_tasks: bool = True, wait_for_threads: bool = True) -> None:
        """End the threads, immediately or after all queued tasks. No tasks are accepted meanwhile."""
        self._is_joining = True
        with self._changed:
            while wait_for_tasks and (self._tasks or self._busy) and self._threads:
                self._changed.wait()
        threads = list(self._threads)
        self._resize(0)
        if wait_for_threads:
            for thread in threads:
                thread.join()
        self._is_joining = False


class ThreadPoolThread(threading.Thread):
    """One thread of a pool."""

    threadSleepTime = 0.1  # noqa: N815  # for compatibility: nothing sleeps

    def __init__(self, pool: MarkedThreadPool) -> None:
        super().__init__(daemon=True)
        self._pool = pool
        self._is_going = False

    def run(self) -> None:
        """Run tasks until `go_away`. An exception in a task ends the thread, reported by `threading`."""
        while not self._is_going:
            task = self._pool.get_next_task(lambda: self._is_going)
            if task is None:
                return
            try:
                result = task.function(*task.args)
                if task.callback is not None:
                    task.callback(result)
            finally:
                self._pool.remove_marker(task.marker)

    def go_away(self) -> None:
        """End the thread after its current task."""
        self._is_going = True
        self._pool.wake()
