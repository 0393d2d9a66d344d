"""Deliver the master's notices, in order for each node. A slow node does not delay the others.

Theory of operation: each API with a pending notice has a queue. A new notice supersedes a queued notice about
the same topic or parameter, because each notice contains the complete new state. Therefore, a queue has at
most one entry for each topic and parameter of a node, and an unresponsive node receives the current state
once it responds again.

The queues take turns, with one notice per turn and `TURNS_AT_A_TIME` turns at once, so that thousands of
notices do not keep the loop from handling calls. The turn of a node that does not respond within `SLOW_S` no
longer counts towards `TURNS_AT_A_TIME`. It continues until the node responds or times out, and delays no
other node.
"""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, Protocol

from pipros.basics.errors import PiprosError, Unreachable
from pipros.basics.limits import Limits, process_limits
from pipros.master.registry import Notice
from pipros.net.rpc_async_client import AsyncRpcClient
from pipros.wire.xmlrpc import ValueTooLarge, encode_call

NOTICES = 1000
"""Limit: calls that a master has queued for one node. Beyond it, the oldest queued call to the node is
dropped and counted; at most one call is queued for each topic and parameter.
"""

_log = logging.getLogger("rosmaster.master")

TURNS_AT_A_TIME: Final = 16
"""Maximum number of notices sent concurrently, not counting those to slow nodes."""
QUEUED_AT_A_TIME: Final = 500
"""Maximum number of notices queued in one iteration of the event loop."""
SLOW_S: Final = 0.1
"""A node that takes longer to respond counts as slow, and the next queue takes its turn."""
LARGE_VALUE: Final = 2_000
"""Values with more elements are encoded in a thread."""
KEEP_CONNECTION_S: Final = 30.0
"""How long the connection to a node is kept after the last notice to it."""


class Recipients(Protocol):
    """The registered nodes, which receive notices. Methods are called in the notifier's event loop.

    A protocol because its implementation, `RegisteredNodes`, imports this module.
    """

    async def may_deliver(self, notice: Notice) -> bool:
        """Return whether the notice is still due, and the server at its URI is the node.

        Called before each delivery. Raises PiprosError if the server does not respond.
        """
        ...

    def on_delivered(self, notice: Notice) -> None:
        """Handle a response from the node."""
        ...

    def on_failed(self, notice: Notice, error: PiprosError) -> None:
        """Handle a failed delivery."""
        ...

    def on_finished(self, notice: Notice) -> None:
        """Handle the completion of a notice, whatever the outcome. Not called for superseded notices."""
        ...


class Notifier:
    """Delivers notices in the event loop in which it is used. `notify` returns at once.

    Attributes:
        delivered: number of notices to which the nodes responded.
        superseded: number of queued notices that a newer notice replaced.
        dropped: number of notices lost because a queue was full.
    """

    def __init__(
        self,
        recipients: Recipients,
        limits: Limits | None = None,
        *,
        connect: Callable[[str], AsyncRpcClient] = AsyncRpcClient,
    ) -> None:
        """Store the settings; `notify` opens connections when needed.

        Args:
            limits: `notices` limits each node's queue, and `notice_s` limits the time to respond to a notice.
                The default is the process-wide limits.
            connect: function that returns the client for an API; raises ValueError for an invalid URI.
        """
        self._recipients = recipients
        self._connect = connect
        limits = limits or process_limits()
        self._timeout_s = limits.notice_s
        self._queue_limit = NOTICES
        self._unqueued: deque[Iterator[Notice]] = deque()
        self._queues: dict[str, _Queue] = {}
        self._in_line: deque[_Queue] = deque()
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
        """The APIs that count as slow, and the number of unfinished notices for each."""
        return {api: len(queue.waiting) + 1 for api, queue in self._queues.items() if queue.is_slow}

    @property
    def waiting_count(self) -> int:
        """The approximate number of unfinished notices.

        The notices of one `notify` call that are not queued yet count as one.
        """
        queued = sum(len(queue.waiting) for queue in self._queues.values())
        return queued + len(self._tasks) + len(self._unqueued)

    def notify(self, notices: Iterable[Notice]) -> None:
        """Queue the notices: `QUEUED_AT_A_TIME` at once, the rest in later iterations of the loop."""
        self._unqueued.append(iter(notices))
        if len(self._unqueued) == 1:
            self._queue_some()

    def _queue_some(self) -> None:
        left = QUEUED_AT_A_TIME
        while self._unqueued and left:
            notice = next(self._unqueued[0], None)
            if notice is None:
                self._unqueued.popleft()
                continue
            left -= 1
            if queue := self._queue_of(notice):
                self._put(queue, notice)
        if self._unqueued:
            asyncio.get_running_loop().call_soon(self._queue_some)
        self._start_turns()

    def _queue_of(self, notice: Notice) -> _Queue | None:
        queue = self._queues.get(notice.api)
        if queue is None:
            try:
                queue = self._queues[notice.api] = _Queue(notice.api, self._connect(notice.api))
            except ValueError as error:
                # as in genuine masters, a node with an invalid URI is registered, but calls to it fail
                self._recipients.on_failed(notice, Unreachable(notice.api, str(error)))
                self._recipients.on_finished(notice)
        return queue

    def close(self) -> None:
        """Drop all queued notices and close all connections."""
        self._is_closed = True
        self._unqueued.clear()
        for task in self._tasks:
            task.cancel()
        for queue in self._queues.values():
            queue.close()
        self._queues.clear()

    def _put(self, queue: _Queue, notice: Notice) -> None:
        subject = (notice.node, notice.method, notice.params[1])
        if queue.waiting.pop(subject, None):
            self.superseded += 1
        elif len(queue.waiting) >= self._queue_limit:
            _, dropped = queue.waiting.popitem(last=False)
            self._recipients.on_finished(dropped)
            self.dropped += 1
            if not queue.has_dropped:
                queue.has_dropped = True
                _log.warning(
                    "%s does not answer: more than %d notices are queued for it",
                    queue.api,
                    self._queue_limit,
                )
        queue.waiting[subject] = notice
        if not queue.is_in_line:
            queue.is_in_line = True
            self._in_line.append(queue)

    def _start_turns(self) -> None:
        while self._in_line and self._turns < TURNS_AT_A_TIME and not self._is_closed:
            queue = self._in_line.popleft()
            self._turns += 1
            task = asyncio.get_running_loop().create_task(self._turn(queue))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _turn(self, queue: _Queue) -> None:
        loop = asyncio.get_running_loop()
        slow = loop.call_later(SLOW_S, self._count_as_slow, queue)
        _, notice = queue.waiting.popitem(last=False)
        try:
            await self._deliver(queue, notice)
        except PiprosError as error:
            self._recipients.on_failed(notice, error)
        finally:
            self._recipients.on_finished(notice)
            slow.cancel()
            if not queue.is_slow:
                self._turns -= 1
            queue.is_slow = False
            if queue.waiting:
                self._in_line.append(queue)
            else:
                queue.is_in_line = False
                if not self._is_closed:
                    queue.close_when_idle(loop, self._forget)
            self._start_turns()

    async def _deliver(self, queue: _Queue, notice: Notice) -> None:
        if not await self._recipients.may_deliver(notice):
            return
        await queue.client.post(await self._document(notice), timeout_s=self._timeout_s)
        self.delivered += 1
        _log.debug("%s[%s] -> %s", notice.method, notice.params[1], notice.api)
        self._recipients.on_delivered(notice)

    async def _document(self, notice: Notice) -> bytes:
        """Return the encoded call. A call is encoded once for all subscribers, in a thread if it is large."""
        async with self._encoding:
            params, document = self._encoded
            if params is not notice.params:
                try:
                    document = encode_call(notice.method, notice.params, size_limit=LARGE_VALUE)
                except ValueTooLarge:
                    loop = asyncio.get_running_loop()
                    document = await loop.run_in_executor(None, encode_call, notice.method, notice.params)
                self._encoded = (notice.params, document)
            return document

    def _count_as_slow(self, queue: _Queue) -> None:
        queue.is_slow = True
        self._turns -= 1
        self._start_turns()

    def _forget(self, queue: _Queue) -> None:
        if not queue.is_in_line:
            del self._queues[queue.api]
            queue.close()


class _Queue:
    """The notices queued for one API, and the connection to it."""

    __slots__ = ("_idle_timer", "api", "client", "has_dropped", "is_in_line", "is_slow", "waiting")

    def __init__(self, api: str, client: AsyncRpcClient) -> None:
        self.api = api
        self.client = client
        self.waiting: OrderedDict[tuple[str, str, str], Notice] = OrderedDict()
        self.is_in_line = False
        self.is_slow = False
        self.has_dropped = False
        self._idle_timer: asyncio.TimerHandle | None = None

    def close_when_idle(self, loop: asyncio.AbstractEventLoop, forget: Callable[[_Queue], None]) -> None:
        if self._idle_timer:
            self._idle_timer.cancel()
        self._idle_timer = loop.call_later(KEEP_CONNECTION_S, forget, self)

    def close(self) -> None:
        if self._idle_timer:
            self._idle_timer.cancel()
        self.client.close()
