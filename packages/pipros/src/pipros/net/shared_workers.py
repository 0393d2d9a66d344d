"""Threads for jobs of several users, such as the peers of a server, each of which has a share."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Hashable
from contextlib import suppress
from math import inf
from typing import Any

from pipros.basics.budget import SharedBudget
from pipros.basics.turns import Turns
from pipros.net.workers import Workers


class SharedWorkers:
    """Runs jobs in a limited number of threads, so that no user can delay or displace the others.

    The users take turns. Each may use at most half of the threads, and half of the room for waiting and
    running jobs, that the others leave. A job that blocks occupies only a thread of its user's share. If
    each user has one thread, a user's jobs run in order.
    """

    def __init__(self, name: str, threads: int, room: float, *, each: float = inf) -> None:
        """Create the threads on demand, at most `each` for one user.

        `room` limits the total cost of all waiting and running jobs.
        """
        self._workers = Workers(name, threads)
        self._threads = threads
        self._each = each
        self._room = SharedBudget(room)
        self._running: Counter[Hashable] = Counter()
        self._turns: Turns[Hashable, tuple[float, Callable[..., object], tuple[Any, ...]]] = Turns()
        self._lock = threading.Lock()

    def run(self, user: Hashable, job: Callable[..., object], *args: Any, cost: float = 1) -> bool:
        """Run a job of a user as soon as it is the user's turn; does not block.

        Return False, and run nothing, if the user has too many jobs.
        """
        with self._lock:
            if not self._room.take(user, cost):
                return False
            self._turns.put(user, (cost, job, args))
        # If the system cannot start another thread, a running one takes the job, or that of a later call.
        with suppress(RuntimeError):
            self._workers.run(self._work)
        return True

    def close(self) -> None:
        """End the idle threads. The others end when no job is queued."""
        self._workers.close()

    def _may_run(self, user: Hashable) -> bool:
        own = self._running[user]
        return own < self._each and 2 * own < self._threads - (self._running.total() - own)

    def _work(self) -> None:
        """Run jobs until none is left that may run now."""
        while True:
            with self._lock:
                try:
                    user, (cost, job, args) = self._turns.pop(self._may_run)
                except IndexError:
                    return
                self._running[user] += 1
            try:
                job(*args)
            except BaseException:
                self._end(user, cost)
                self._workers.run(self._work)
                raise  # `Workers` reports it
            self._end(user, cost)

    def _end(self, user: Hashable, cost: float) -> None:
        with self._lock:
            self._running[user] -= 1
            if not self._running[user]:
                del self._running[user]
            self._room.give_back(user, cost)
