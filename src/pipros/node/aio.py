"""What the asynchronous face of a node needs beyond the blocking one. All logic is shared."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from pipros.node.client import ServiceClient


async def call(client: ServiceClient, request: Any, timeout_s: float | None) -> Any:
    """Calls a service without holding up the event loop. Cancelling it ends the client's calls."""
    task = asyncio.get_running_loop().run_in_executor(None, client.call, request, timeout_s)
    try:
        return await asyncio.shield(task)
    except asyncio.CancelledError:
        client.calls.interrupt()
        task.add_done_callback(lambda ended: ended.exception())  # nobody waits for it any more
        raise


def is_in_event_loop() -> bool:
    """True when called from a coroutine or a callback of an asyncio loop."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def run_in_loop(
    handler: Callable[[Any], Coroutine[Any, Any, Any]], loop: asyncio.AbstractEventLoop
) -> Callable[[Any], Any]:
    """A blocking service handler that has `loop` run an asynchronous one."""

    def handle(request: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(handler(request), loop).result()

    return handle
