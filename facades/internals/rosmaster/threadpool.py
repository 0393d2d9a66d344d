"""`rosmaster.threadpool`: threads that run tasks, those of one marker one after the other.

The master of pipros has an event loop instead; this is for those who take the pool for their own purposes.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "logging time:sleep traceback")


class Task(NamedTuple):
    """What a pool runs: `function(*args)`, and `callback` with what it returns."""

    marker: Hashable
    function: Callable[..., Any]
    args: Sequence[Any]
    callback: Callable[[Any], object] | None


class MarkedThreadPool:
    """Runs tasks in some threads, in order; of one marker only one at a time."""

    def __init__(self, numThreads: int) -> None:  # its name in rosmaster
        self._changed = threading.Condition()
        self._tasks: list[Task] = []
        self._busy: set[Hashable] = set()
        self._threads: list[ThreadPoolThread] = []
        self._is_joining = False
        self.set_thread_count(numThreads)

    def set_thread_count(self, newNumThreads: int) -> bool:
        """Starts threads, or lets some go after their task; False while `join_all` runs."""
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
        """Has `task(*args)` called. False, and nothing is called, during `join_all` or if it cannot be.

        Args:
            marker: what has to be done one after the other has the same one.
            taskCallback: called with what the task returns.
        """
        if self._is_joining or not callable(task):
            return False
        with self._changed:
            self._tasks.append(Task(marker, task, args or (), taskCallback))
            self._changed.notify()
        return True

    def get_next_task(self, is_over: Callable[[], bool] = lambda: True) -> Task | None:
        """Takes the first task whose marker is free, and marks it as busy; None when there is none.

        Waits for one until `is_over()`. `remove_marker` is to be called when it is done.
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
        """The task of the marker is done: the next one may run."""
        with self._changed:
            self._busy.discard(marker)
            self._changed.notify_all()

    def wake(self) -> None:
        """Has the threads look whether they are to end."""
        with self._changed:
            self._changed.notify_all()

    def join_all(self, wait_for_tasks: bool = True, wait_for_threads: bool = True) -> None:
        """Ends the threads: at once, or when all tasks are done. Takes no tasks meanwhile."""
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

    threadSleepTime = 0.1  # noqa: N815  # for those who read it: nothing sleeps

    def __init__(self, pool: MarkedThreadPool) -> None:
        super().__init__(daemon=True)
        self._pool = pool
        self._is_going = False

    def run(self) -> None:
        """Runs tasks until `go_away`. What a task raises is reported as for any thread, and ends this one."""
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
        """Ends the thread after its task."""
        self._is_going = True
        self._pool.wake()
