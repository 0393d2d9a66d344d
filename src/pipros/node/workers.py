"""Threads that run what may block, and are kept for the next."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

#: Idle threads that are kept; starting one costs more than many a service call.
KEPT_IDLE = 4

Job = tuple[Callable[..., object], tuple[Any, ...]]


class Workers:
    """Runs each job at once, in an idle thread or in a new one: a job that blocks delays no other.

    The threads are daemons, since a job may never end.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._idle = 0
        self._is_closed = False
        self._lock = threading.Lock()

    def run(self, job: Callable[..., object], *args: Any) -> None:
        with self._lock:
            if self._idle:
                self._idle -= 1
                self._jobs.put((job, args))
                return
        threading.Thread(target=self._work, args=((job, args),), name=self._name, daemon=True).start()

    def close(self) -> None:
        """Ends the idle threads; those at work end with their jobs."""
        with self._lock:
            self._is_closed = True
            for _ in range(self._idle):
                self._jobs.put(None)
            self._idle = 0

    def _work(self, first: Job) -> None:
        job: Job | None = first
        while job is not None:
            function, args = job
            function(*args)
            del function, args, job
            with self._lock:
                if self._is_closed or self._idle >= KEPT_IDLE:
                    return
                self._idle += 1
            job = self._jobs.get()
