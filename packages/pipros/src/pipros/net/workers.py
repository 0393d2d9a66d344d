"""Threads for jobs that may block; idle threads are kept for later jobs."""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from pipros.basics import one_thread
from pipros.basics.posix import require_sockets

KEPT_IDLE = 4
"""Number of idle threads that are kept, because starting a thread takes longer than many service calls."""

_AT_SHUTDOWN = "interpreter shutdown"

Job = tuple[Callable[..., object], tuple[Any, ...]]


def interpreter_ends(error: RuntimeError) -> bool:
    """Return whether an error means that a thread cannot start because the interpreter is shutting down."""
    return _AT_SHUTDOWN in str(error)


class Workers:
    """Runs each job immediately, in an idle or a new thread, so that a job that blocks does not delay others.

    If the number of threads is limited, excess jobs are queued in order. The threads are daemons: the
    interpreter does not wait for them, because a job may never end.
    """

    def __init__(self, name: str, limit: int | None = None, *, kept_idle: int = KEPT_IDLE) -> None:
        self._name = name
        self._limit = limit
        self._kept_idle = kept_idle if one_thread.has_threads() else 0
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._waiting: deque[Job] = deque()
        self._threads = 0
        self._idle = 0
        self._is_closed = False
        self._lock = threading.Lock()

    def run(self, job: Callable[..., object], *args: Any) -> None:
        """Start `job` in a thread, or queue it if the limit is reached, and return at once.

        Raises:
            RuntimeError: the system cannot start another thread.
            NeedsSockets: Python runs in a browser.
        """
        require_sockets()
        with self._lock:
            if self._idle:
                self._idle -= 1
                self._jobs.put((job, args))
                return
            if self._limit is not None and self._threads >= self._limit:
                self._waiting.append((job, args))
                return
            self._threads += 1
        try:
            # A thread keeps its arguments alive until it ends, so `_work` removes the job from this list.
            first: list[Job] = [(job, args)]
            one_thread.start_thread(self._work, first, name=self._name)
        except RuntimeError:
            with self._lock:
                self._threads -= 1
            raise

    def close(self) -> None:
        """End the idle threads. The others end when no job is queued."""
        with self._lock:
            self._is_closed = True
            for _ in range(self._idle):
                self._jobs.put(None)
            self._idle = 0

    def _work(self, first: list[Job]) -> None:
        job: Job | None = first.pop()
        while job is not None:
            function, args = job
            try:
                function(*args)
            except BaseException:
                # report the exception as if the thread had ended, but continue with this thread
                report = threading.ExceptHookArgs((*sys.exc_info(), threading.current_thread()))
                threading.excepthook(report)
            del function, args, job
            with self._lock:
                if self._waiting:
                    job = self._waiting.popleft()
                    continue
                if self._is_closed or self._idle >= self._kept_idle:
                    self._threads -= 1
                    return
                self._idle += 1
            job = self._jobs.get()
        with self._lock:
            self._threads -= 1
