"""The node's shutdown hooks, the threads that the shutdown waits for, and the waits that it ends."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from pipros.basics.interruptible_wait import OnceEvent

Hook = Callable[..., object]

THREAD_END_S = 5.0
"""Maximum time that the shutdown waits for each registered thread."""


class ShutdownHooks:
    """Hooks, in the order in which they are called. Exceptions from a hook, even SystemExit, are logged.

    Attributes:
        client: called without arguments, while publishing still works.
        preshutdown: called with the reason after the client hooks.
        shutdown: called once with the reason, after the node has unregistered.
        threads: threads to wait for at the end, for a few seconds at most.
    """

    def __init__(self, log: logging.Logger) -> None:
        self.client: list[Hook] = []
        self.preshutdown: list[Hook] = []
        self.shutdown: list[Hook] = []
        self.threads: list[threading.Thread] = []
        self._waits: set[OnceEvent] = set()
        self._log = log
        self._lock = threading.Lock()

    def join(self, thread: threading.Thread) -> None:
        """Make the shutdown wait for a thread that is still running."""
        self.threads = [*filter(threading.Thread.is_alive, self.threads), thread]

    @contextlib.contextmanager
    def ended_by_shutdown(self, wait: OnceEvent) -> Iterator[None]:
        """Return a context manager that sets the event `wait` if the node shuts down inside the block."""
        self._waits.add(wait)
        try:
            yield
        finally:
            self._waits.discard(wait)

    def call_first(self, reason: str) -> None:
        """Call the `client` and `preshutdown` hooks, then set the events of all waits."""
        self._call(self.client)
        self._call(self.preshutdown, reason)
        for wait in list(self._waits):
            wait.set()

    def call_last(self, reason: str) -> None:
        """Call the `shutdown` hooks, and wait for the threads."""
        with self._lock:
            hooks = list(self.shutdown)
            self.shutdown.clear()
        self._call(hooks, reason)
        self._call([partial(thread.join, THREAD_END_S) for thread in self.threads if thread.is_alive()])

    def _call(self, hooks: Sequence[Hook], *args: object) -> None:
        for hook in hooks:  # not of a copy: hooks can add hooks
            try:
                hook(*args)
            except BaseException:
                self._log.exception("a shutdown hook failed")
