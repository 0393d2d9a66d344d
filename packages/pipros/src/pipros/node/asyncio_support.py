"""Support for the asynchronous methods of a node, which share all logic with the blocking methods."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pipros.net.loop import in_daemon_thread

if TYPE_CHECKING:
    from pipros.node.service_client import ServiceClient

AnyMessage = TypeVar("AnyMessage")


class MessageStream(Generic[AnyMessage]):
    """The messages of a subscription as an asynchronous iterator, which ends with the subscription.

    If `queue_size` is n, the n newest messages that have not been consumed are kept, and `dropped` counts the
    others. If `queue_size` is None or 0, all messages are kept.
    """

    def __init__(self, queue_size: int | None) -> None:
        self.dropped = 0
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[AnyMessage] = deque()
        self._queue_size = queue_size
        self._arrived = asyncio.Event()
        self._is_closed = False

    def __call__(self, message: AnyMessage) -> None:
        """Add a message. Called from a link's thread."""
        self._call(self._put, message)

    def close(self) -> None:
        """End the iteration after the queued messages have been consumed. May be called from any thread."""
        self._call(self._end)

    def __aiter__(self) -> AsyncIterator[AnyMessage]:
        return self

    async def __anext__(self) -> AnyMessage:
        while not self._waiting:
            if self._is_closed:
                raise StopAsyncIteration
            self._arrived.clear()
            await self._arrived.wait()
        return self._waiting.popleft()

    def _put(self, message: AnyMessage) -> None:
        self._waiting.append(message)
        while self._queue_size and len(self._waiting) > self._queue_size:
            self._waiting.popleft()
            self.dropped += 1
        self._arrived.set()

    def _end(self) -> None:
        self._is_closed = True
        self._arrived.set()

    def _call(self, function: Callable[..., None], *args: Any) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function, *args)


async def call(client: ServiceClient, request: Any, timeout_s: float | None) -> Any:
    """Call a service without blocking the event loop.

    Cancelling this call interrupts all of the client's calls.
    """
    task = in_daemon_thread(client.call, request, timeout_s)
    try:
        return await asyncio.shield(task)
    except asyncio.CancelledError:
        client.calls.interrupt()
        task.add_done_callback(
            lambda ended: ended.exception()
        )  # retrieve the exception, because no caller awaits it now
        raise


def is_in_event_loop() -> bool:
    """Return True if called from a coroutine or a callback of an asyncio loop."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def run_in_loop(
    handler: Callable[[Any], Coroutine[Any, Any, Any]], loop: asyncio.AbstractEventLoop
) -> Callable[[Any], Any]:
    """Return a blocking service handler that runs an asynchronous handler in `loop`."""

    def handle(request: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(handler(request), loop).result()

    return handle
