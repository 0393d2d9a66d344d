"""Link a subscriber to all publishers that the master lists for a topic, and keep these links open."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable

from pipros.basics.errors import PiprosError, Refused, Unreachable
from pipros.basics.printable import printable
from pipros.node.context import NodeContext
from pipros.node.publisher_dialer import LOG_TOPICS, PUBLISHERS_PER_TOPIC
from pipros.node.throttled_warnings import ThrottledWarnings

RETRY_FIRST_S = 0.1
RETRY_REFUSED_LONGEST_S = 60.0
"""Initial delay between attempts to connect, and the maximum delay after refusals. `NodeTimings` contains the
other delays.
"""

LOST_GRACE_S = 3.0
"""How long failures to reconnect are not logged after a link has ended: the publisher's process may have
ended, and the master notifies subscribers only afterwards.
"""

LinkEnd = asyncio.Future[str]
"""Future that is resolved when a link ends: with the error that broke it, or with an empty string."""

Connect = Callable[[str], Awaitable[LinkEnd]]
"""Connects to the publisher at a URI. Returns a `LinkEnd`."""


class PublisherConnector:
    """Connects to each publisher of a topic, and reconnects whenever a link ends. For the event loop only.

    A link to a publisher that is no longer listed is kept until the publisher closes it, because nodes take
    some time to register again with a master that has restarted.

    Attributes:
        attempts: number of attempts to reach a publisher.
    """

    def __init__(self, topic: str, context: NodeContext, connect: Connect) -> None:
        self.attempts = 0
        self._topic = topic
        self._context = context
        self._timings = context.timings
        self._connect = connect
        self._listed: set[str] = set()
        self._linked: set[str] = set()
        self._refused: set[str] = set()  # publishers that refused a connection, to be tried again
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._warnings = ThrottledWarnings(
            context.log, context.loop, f"cannot receive [{topic}] from %d more publishers; the last is %s"
        )
        self._is_stopped = False

    def update(self, uris: Iterable[str]) -> None:
        """Apply the master's list of publishers."""
        if self._is_stopped:
            return
        listed = list(dict.fromkeys(uri for uri in uris if isinstance(uri, str)))
        limit = PUBLISHERS_PER_TOPIC
        if len(listed) > limit:
            if self._warnings.should_log(f"beyond the limit of {limit}"):
                self._context.log.warning(
                    "[%s] has %d publishers; the limit is %d",
                    self._topic,
                    len(listed),
                    limit,
                )
            listed.sort(key=lambda uri: uri not in self._linked)
            del listed[limit:]
        self._listed = set(listed)
        for uri in self._tasks.keys() - self._listed - self._linked:
            self._tasks.pop(uri).cancel()
        for uri in listed:
            # the publisher may have registered again with another type
            if uri in self._refused and uri in self._tasks:
                self._tasks.pop(uri).cancel()
            if uri not in self._tasks:
                task = self._tasks[uri] = asyncio.ensure_future(self._keep_linked(uri))
                task.add_done_callback(self._collect)

    def stop(self) -> None:
        """Stop connecting to publishers."""
        self._is_stopped = True
        self._listed = set()
        for task in self._tasks.values():
            task.cancel()

    async def _keep_linked(self, uri: str) -> None:
        """Keep a link to a publisher for as long as the master lists the publisher."""
        delay_s, explained, is_first = RETRY_FIRST_S, "", True
        refused_s, quiet_until = self._timings.retry_refused_first_s, 0.0
        now = asyncio.get_running_loop().time
        try:
            while uri in self._listed:
                try:
                    ended = await self._context.attempts.make(lambda: self._attempt(uri), is_first=is_first)
                except (PiprosError, ValueError) as error:
                    # ValueError: the publisher registered an invalid URI
                    is_first = False
                    is_lost = isinstance(error, Unreachable) and now() < quiet_until
                    # Every node publishes its log, and some end before they can unregister.
                    is_lost |= self._topic in LOG_TOPICS and isinstance(
                        error.__cause__, ConnectionRefusedError
                    )
                    if not is_lost and str(error) != explained:  # each problem is logged once
                        explained = str(error)
                        await self._explain(uri, error)
                    if isinstance(error, Refused):
                        refused_s = await self._wait_refused(uri, refused_s)
                        continue
                else:
                    self._context.reported.discard(uri)
                    if await self._wait_for_end(uri, ended):
                        delay_s, explained, is_first = RETRY_FIRST_S, "", True
                    quiet_until = now() + LOST_GRACE_S
                await asyncio.sleep(delay_s)
                delay_s = min(2 * delay_s, self._timings.retry_longest_s)
        finally:
            self._context.reported.discard(uri)
            if self._tasks.get(uri) is asyncio.current_task():
                del self._tasks[uri]

    async def _wait_for_end(self, uri: str, ended: LinkEnd) -> bool:
        """Wait until a link ends; return True if it lasted longer than `retry_longest_s`."""
        loop = asyncio.get_running_loop()
        self._linked.add(uri)
        began = loop.time()
        try:
            broken = await ended
        finally:
            self._linked.discard(uri)
        if broken and not self._is_stopped and self._warnings.should_log(f"{printable(uri)}: {broken}"):
            self._context.log.error(broken)
        return loop.time() - began > self._timings.retry_longest_s

    async def _wait_refused(self, uri: str, delay_s: float) -> float:
        """Wait after a refusal, at most until the next `update`. Return the delay to use next."""
        self._refused.add(uri)
        try:
            await asyncio.sleep(delay_s)
        finally:
            self._refused.discard(uri)
        return min(2 * delay_s, RETRY_REFUSED_LONGEST_S)

    async def _attempt(self, uri: str) -> LinkEnd:
        self.attempts += 1
        return await self._connect(uri)

    async def _explain(self, uri: str, error: Exception) -> None:
        """Warn that nothing can be received from a publisher, with the reason and a remedy (ros_comm#222).

        A node that cannot be reached is reported for the first of its topics only.
        """
        if isinstance(error, Unreachable):
            if uri in self._context.reported:
                return
            self._context.reported.add(uri)
        if not self._warnings.should_log(f"{printable(uri)}: {printable(error)}"):
            return
        explain = ""
        if isinstance(error, Unreachable):
            from pipros.net import unreachable  # imported here because most publishers can be reached

            explain = await unreachable.explain(error.peer)
        if uri in self._listed:  # skip a publisher that has since unregistered
            self._context.log.warning(
                "cannot receive [%s] from the publisher at %s: %s%s",
                self._topic,
                printable(uri),
                printable(error, 1000),
                explain,
            )

    def _collect(self, task: asyncio.Task[None]) -> None:
        """Log an unexpected exception, which ends only this link."""
        if not task.cancelled() and (error := task.exception()) is not None:
            self._context.log.error("unexpected error for a publisher of [%s]", self._topic, exc_info=error)
