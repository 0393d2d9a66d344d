"""Runs event loops, links and callbacks of a worker where its only thread waits; see `one_thread.OnlyThread`.

Theory of operation. A turn handles received packets, runs each event loop until it has nothing more to do,
and then calls jobs: links that can be read, and what would be a thread elsewhere. A job may wait. Its wait
takes further turns, inside of the wait that called the job, so a callback can call a service, and serve a
call meanwhile. Jobs therefore end in the opposite order, at most `DEEPEST` inside of each other. Links skip
their turn while a callback of their topic runs. While a node ends, jobs that still wait after `END_S`
end with SystemExit, as threads end with their process.
"""

from __future__ import annotations

import asyncio
import heapq
import itertools
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, TypeVar

from pipros_tab.network import LONGEST_WAIT_S, Network

if TYPE_CHECKING:
    from pipros_tab.tab_socket import TabSocket

_Result = TypeVar("_Result")

DEEPEST: Final = 20
"""Maximum number of jobs that run inside of each other. Pyodide's stack has room for more."""

END_S: Final = 0.2
"""How long jobs may go on waiting when a node ends."""


class WorkerTurns:
    """The turns of one worker."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._loops: list[Any] = []  # event loops, of whose attributes `_run` uses some that are private
        self._jobs: deque[tuple[Callable[..., object], tuple[Any, ...]]] = deque()
        self._links: dict[TabSocket, Callable[[], bool | None]] = {}
        self._pending: set[TabSocket] = set()  # links that have more to do, although nothing has arrived
        self._repeated: list[tuple[float, int, Callable[[], float | None]]] = []  # a heap, by time
        self._numbers = itertools.count()
        self._depth = 0  # number of jobs that run inside of each other
        self._waits = 0  # likewise
        self._last: deque[tuple[Callable[..., object], tuple[Any, ...]]] = deque()
        self._ending_depth = math.inf  # jobs that are deeper than this end
        self._end_s = 0.0

    def wait(self, is_over: Callable[[], bool], timeout_s: float | None) -> bool:
        """Take turns until `is_over` returns True; return False if the timeout expires first."""
        return self._wait(is_over, timeout_s, self._take_turn)

    def sleep(self, seconds: float | SupportsIndex) -> None:
        """Take turns for some time, and at least one. Replaces `time.sleep`."""
        self.wait(lambda: False, float(seconds))

    def take_turn(self) -> None:
        """Take one turn, but not in a callback or signal handler during a wait, which takes turns itself."""
        if not self._waits:
            self.sleep(0.0)

    def wait_for_condition(self, condition: Any, timeout: float | None = None) -> bool:
        """Take turns until a condition, or its event, is notified. Replaces `threading.Condition.wait`."""
        waiter = threading.Lock()
        waiter.acquire()
        condition._waiters.append(waiter)
        held = condition._release_save()
        try:
            is_notified = self.wait(lambda: waiter.acquire(blocking=False), timeout)
            if not is_notified:
                condition._waiters.remove(waiter)
            return is_notified
        finally:
            condition._acquire_restore(held)

    def wait_for_network(self, is_over: Callable[[], bool], timeout_s: float | None) -> bool:
        """Like `wait`, but run only event loops, no jobs. For code that may hold a lock."""
        return self._wait(is_over, timeout_s, self._run_loops)

    def _wait(
        self, is_over: Callable[[], bool], timeout_s: float | None, take_turn: Callable[[], bool]
    ) -> bool:
        end_s = math.inf if timeout_s is None else time.monotonic() + timeout_s
        self._waits += 1
        try:
            while not is_over():
                self._network.receive(0.0)
                has_run = take_turn()
                left_s = end_s - time.monotonic()
                if left_s <= 0:
                    return is_over()
                if not has_run and not is_over():
                    self._network.receive(max(0.0, min(left_s, LONGEST_WAIT_S, self._idle_s())))
            return True
        finally:
            self._waits -= 1

    def later(self, job: Callable[..., object], *args: Any) -> None:
        """Call `job` in a later turn."""
        self._jobs.append((job, args))

    def at_last(self, job: Callable[..., object], *args: Any) -> None:
        """Call `job` in the outermost wait. Jobs that still wait after `END_S` are ended before."""
        self._last.append((job, args))
        self._end_s = time.monotonic() + (END_S if self._depth else 0.0)

    def while_ending(self, job: Callable[[], object]) -> None:
        """Call `job`. Jobs that are called inside of it and still wait after `END_S` are ended."""
        before, self._ending_depth = self._ending_depth, self._depth
        self._end_s = time.monotonic() + END_S
        try:
            job()
        finally:
            self._ending_depth = before

    def drive(self, loop: asyncio.AbstractEventLoop) -> None:
        """Run an event loop in all turns until it is closed."""
        self._loops.append(loop)

    def read(self, sock: Any, job: Callable[[], bool | None]) -> None:
        """Call `job` in each turn in which the socket can be read, and once in the next turn."""
        self._links[sock] = job
        self._pending.add(sock)

    def repeat(self, job: Callable[[], float | None]) -> None:
        """Call `job` in a later turn, then again after as many seconds as it returns; None ends this."""
        heapq.heappush(self._repeated, (0.0, next(self._numbers), job))

    def publishing(self, publish: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return a function that calls `publish`, and then takes a turn."""

        def publish_and_take_turn(message: Any) -> None:
            publish(message)
            self.sleep(0.0)

        return publish_and_take_turn

    def _take_turn(self) -> bool:
        """Run what is due. Return whether anything was."""
        has_run = self._run_loops()
        is_ending = self._last or self._depth > self._ending_depth
        if is_ending and time.monotonic() >= self._end_s:
            if self._last and not self._depth:
                job, args = self._last.popleft()
                self._run(job, *args)
                has_run = True
            elif self._depth:
                raise SystemExit  # ends the job that waits here
        return (self._depth < DEEPEST and self._run_jobs()) or has_run

    def _run(self, job: Callable[..., _Result], *args: Any) -> _Result | None:
        """Run a job. SystemExit ends only the job, as it ends only the thread elsewhere."""
        self._depth += 1
        try:
            return job(*args)
        except SystemExit:
            return None
        finally:
            self._depth -= 1

    def _run_jobs(self) -> bool:
        has_run = False
        for _ in range(len(self._jobs)):
            if not self._jobs:  # a job that waited has run the others
                break
            job, args = self._jobs.popleft()
            self._run(job, *args)
            has_run = True
        for sock, link in list(self._links.items()):
            if sock.fileno() < 0:
                self._links.pop(sock, None)
                self._pending.discard(sock)
            elif sock in self._pending or sock.is_readable:
                has_more = self._run(link)
                (self._pending.discard if has_more is False else self._pending.add)(sock)
                has_run = has_run or has_more is not None
        while self._repeated and self._repeated[0][0] <= time.monotonic():
            _, number, repeated = heapq.heappop(self._repeated)
            pause_s = self._run(repeated)
            if pause_s is not None:
                heapq.heappush(self._repeated, (time.monotonic() + pause_s, number, repeated))
            has_run = True
        return has_run

    def _run_loops(self) -> bool:
        """Run each event loop that has something to do, unless it called this. Return whether one had."""
        running = asyncio._get_running_loop()
        has_run = False
        for loop in list(self._loops):
            if loop.is_closed():
                self._loops.remove(loop)
            elif running is None and self._is_due(loop):
                loop.call_soon(loop.stop)
                loop.run_forever()
                has_run = True
        return has_run

    @staticmethod
    def _is_due(loop: Any) -> bool:
        return bool(loop._ready or loop._selector.ready()) or _next_timer_s(loop) <= loop.time()

    def _idle_s(self) -> float:
        """Return the time until the next timer."""
        timers = [_next_timer_s(loop) - loop.time() for loop in self._loops if not loop.is_closed()]
        if self._repeated:
            timers.append(self._repeated[0][0] - time.monotonic())
        if self._last:
            timers.append(self._end_s - time.monotonic())
        return min(timers, default=math.inf)


def _next_timer_s(loop: Any) -> float:
    return float(loop._scheduled[0]._when) if loop._scheduled else math.inf


def distinct_ns(clock: Callable[[], int]) -> Iterator[int]:
    """Yield the times of a clock that shows milliseconds, such as a browser's, at least 1 us apart.

    Otherwise, messages of a burst had the same stamp, and tf drops all but the first.
    """
    last_ns = 0
    while True:
        last_ns = max(clock(), last_ns + 1000)
        yield last_ns
