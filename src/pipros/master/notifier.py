"""Delivers the master's notices: in order for each node, and no node waits for another.

Each API that has something to hear gets a queue. A notice replaces an older one about the same
topic or parameter that still waits, because each carries the whole new state; so a queue cannot
grow beyond what its node has subscribed to, and a node that hung hears the present state afterwards.

The queues take turns, one notice a turn, a limited number at a time: so a thousand nodes that all
have something to hear do not keep the loop from answering calls. A node that does not answer at
once loses its place among those, but not its turn, and so holds nobody up.
"""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict, deque
from collections.abc import Awaitable, Callable, Iterable, Iterator
from typing import Any, Final

from pipros.errors import PiprosError, Unreachable
from pipros.master.registry import Notice
from pipros.net.rpc_async import AsyncRpcClient
from pipros.wire.xmlrpc import TooLarge, encode_call

_log = logging.getLogger("rosmaster.master")

CALL_TIMEOUT_S: Final = 10.0
"""How long a node may take over one notice."""
QUEUE_LIMIT: Final = 1000
"""How many notices may wait for one node; beyond it the oldest is dropped and counted."""
TURNS_AT_A_TIME: Final = 16
"""How many notices are on their way at a time, those to slow nodes not counted."""
TAKEN_AT_A_TIME: Final = 500
"""How many notices are queued in one turn of the loop."""
SLOW_S: Final = 0.1
"""After this time without an answer a node counts as slow, and the next one in line may start."""
LARGE_VALUE: Final = 2_000
"""From how many elements on a value is encoded in a thread."""
KEEP_CONNECTION_S: Final = 30.0
"""How long the connection to a node is kept after its last notice."""


class Notifier:
    """Delivers notices from the loop it is used on. `notify` returns at once.

    Attributes:
        delivered: how many notices were answered by their nodes.
        superseded: how many were replaced by a newer one while they waited.
        dropped: how many were lost because a queue was full.
    """

    def __init__(
        self,
        *,
        is_current: Callable[[Notice], bool],
        may_shut_down: Callable[[Notice], Awaitable[bool]],
        reached: Callable[[Notice], None],
        failed: Callable[[Notice, PiprosError], None],
        done: Callable[[Notice], None],
        timeout_s: float | None = None,
    ) -> None:
        """
        Args:
            is_current: asked before an update is delivered; False when the node has gone or moved.
            may_shut_down: asked before a `shutdown` is delivered.
            reached: told of every notice that a node has answered.
            failed: told of every notice that could not be delivered.
            done: told, last, of every notice that will not be tried again, whatever became of it; not of one
                that a newer one took the place of.
            timeout_s: how long a node may take over one notice; by default, and when that is no time at all,
                `CALL_TIMEOUT_S`.
        """
        self._is_current = is_current
        self._may_shut_down = may_shut_down
        self._reached = reached
        self._failed = failed
        self._done = done
        self._timeout_s = timeout_s if timeout_s and timeout_s > 0 else CALL_TIMEOUT_S
        self._untaken: deque[Iterator[Notice]] = deque()
        self._queues: dict[str, _Queue] = {}
        self._line: deque[_Queue] = deque()
        self._turns = 0
        self._is_closed = False
        self._tasks: set[asyncio.Task[None]] = set()
        self._encoded: tuple[Any, bytes] = (None, b"")
        self._encoding = asyncio.Lock()
        self.delivered = 0
        self.superseded = 0
        self.dropped = 0

    @property
    def slow_apis(self) -> dict[str, int]:
        """The APIs that have not answered for a while, and how many notices wait for each."""
        return {api: len(queue.waiting) + 1 for api, queue in self._queues.items() if queue.is_slow}

    @property
    def waiting_count(self) -> int:
        """How many notices are not answered yet."""
        queued = sum(len(queue.waiting) for queue in self._queues.values())
        return queued + len(self._tasks) + len(self._untaken)

    def notify(self, notices: Iterable[Notice]) -> None:
        """Queues the notices: `TAKEN_AT_A_TIME` at once, more of them in later turns of the loop."""
        self._untaken.append(iter(notices))
        if len(self._untaken) == 1:
            self._take()

    def _take(self) -> None:
        left = TAKEN_AT_A_TIME
        while self._untaken and left:
            notice = next(self._untaken[0], None)
            if notice is None:
                self._untaken.popleft()
                continue
            left -= 1
            if queue := self._queue_of(notice):
                self._put(queue, notice)
        if self._untaken:
            asyncio.get_running_loop().call_soon(self._take)
        self._start_turns()

    def _queue_of(self, notice: Notice) -> _Queue | None:
        queue = self._queues.get(notice.api)
        if queue is None:
            try:
                queue = self._queues[notice.api] = _Queue(notice.api)
            except ValueError as error:  # genuine masters accept such APIs, and call them in vain
                self._failed(notice, Unreachable(notice.api, str(error)))
                self._done(notice)
        return queue

    def close(self) -> None:
        """Drops what waits and closes all connections. Nothing is delivered any more."""
        self._is_closed = True
        self._untaken.clear()
        for task in self._tasks:
            task.cancel()
        for queue in self._queues.values():
            queue.close()
        self._queues.clear()

    def _put(self, queue: _Queue, notice: Notice) -> None:
        subject = (notice.node, notice.method, notice.params[1])
        if queue.waiting.pop(subject, None):
            self.superseded += 1
        elif len(queue.waiting) >= QUEUE_LIMIT:
            _, dropped = queue.waiting.popitem(last=False)
            self._done(dropped)
            self.dropped += 1
            if not queue.has_dropped:
                queue.has_dropped = True
                _log.warning("%s hangs, and more than %d notices wait for it", queue.api, QUEUE_LIMIT)
        queue.waiting[subject] = notice
        if not queue.is_in_line:
            queue.is_in_line = True
            self._line.append(queue)

    def _start_turns(self) -> None:
        while self._line and self._turns < TURNS_AT_A_TIME and not self._is_closed:
            queue = self._line.popleft()
            self._turns += 1
            task = asyncio.get_running_loop().create_task(self._turn(queue))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _turn(self, queue: _Queue) -> None:
        loop = asyncio.get_running_loop()
        slow = loop.call_later(SLOW_S, self._lose_place, queue)
        _, notice = queue.waiting.popitem(last=False)
        try:
            await self._deliver(queue, notice)
        except PiprosError as error:
            self._failed(notice, error)
        finally:
            self._done(notice)
            slow.cancel()
            if not queue.is_slow:
                self._turns -= 1
            queue.is_slow = False
            if queue.waiting:
                self._line.append(queue)
            else:
                queue.is_in_line = False
                if not self._is_closed:
                    queue.rest(loop, self._forget)
            self._start_turns()

    async def _deliver(self, queue: _Queue, notice: Notice) -> None:
        if notice.method == "shutdown":
            if not await self._may_shut_down(notice):
                return
        elif not self._is_current(notice):
            return
        await queue.client.post(await self._document(notice), timeout_s=self._timeout_s)
        self.delivered += 1
        _log.debug("%s[%s] -> %s", notice.method, notice.params[1], notice.api)
        self._reached(notice)

    async def _document(self, notice: Notice) -> bytes:
        """The call, encoded once for all subscribers; a large one in a thread."""
        async with self._encoding:
            params, document = self._encoded
            if params is not notice.params:
                try:
                    document = encode_call(notice.method, notice.params, size_limit=LARGE_VALUE)
                except TooLarge:
                    loop = asyncio.get_running_loop()
                    document = await loop.run_in_executor(None, encode_call, notice.method, notice.params)
                self._encoded = (notice.params, document)
            return document

    def _lose_place(self, queue: _Queue) -> None:
        queue.is_slow = True
        self._turns -= 1
        self._start_turns()

    def _forget(self, queue: _Queue) -> None:
        if not queue.is_in_line:
            del self._queues[queue.api]
            queue.close()


class _Queue:
    """What waits for one API."""

    __slots__ = ("_rest", "api", "client", "has_dropped", "is_in_line", "is_slow", "waiting")

    def __init__(self, api: str) -> None:
        self.api = api
        self.client = AsyncRpcClient(api)
        self.waiting: OrderedDict[tuple[str, str, str], Notice] = OrderedDict()
        self.is_in_line = False
        self.is_slow = False
        self.has_dropped = False
        self._rest: asyncio.TimerHandle | None = None

    def rest(self, loop: asyncio.AbstractEventLoop, forget: Callable[[_Queue], None]) -> None:
        if self._rest:
            self._rest.cancel()
        self._rest = loop.call_later(KEEP_CONNECTION_S, forget, self)

    def close(self) -> None:
        if self._rest:
            self._rest.cancel()
        self.client.close()
