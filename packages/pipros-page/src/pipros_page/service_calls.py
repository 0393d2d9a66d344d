"""Call services for browsers. Calls are limited in number and duration, and can be cancelled."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from pipros.net.master_client import MasterClient
from pipros.node.open_calls import OpenCalls
from pipros_server.browser_share import CALLS_OF_A_BROWSER, current_browser
from pipros_server.daemon_pool import DaemonPool
from pipros_server.view_server import RequestRefused

T = TypeVar("T")

CALLS_AT_ONCE = 64
"""Maximum number of concurrent calls of all browsers. Further calls wait."""

TOOL_CALL_S = 30.0
"""Timeout of the calls that tabs make themselves: to loggers and dynamic_reconfigure servers."""

CALL_BY_HAND_S = 600.0


class ServiceCalls:
    """Calls services in threads, on behalf of browsers."""

    def __init__(self, master: Callable[[], MasterClient]) -> None:
        self._master = master
        self._pool = DaemonPool("service call", CALLS_AT_ONCE)

    async def run(self, call: Callable[[MasterClient, OpenCalls], T]) -> T:
        """Run `call` in a thread, and return its result. Cancelling the coroutine interrupts the call.

        Raises:
            RequestRefused: the browser already has `CALLS_OF_A_BROWSER` pending calls.
        """
        share = current_browser().calls
        if not share.try_acquire():
            raise RequestRefused(
                f"{CALLS_OF_A_BROWSER} calls from this browser are pending; wait until one ends"
            )
        calls = OpenCalls()
        try:
            done = self._pool.start(call, self._master(), calls)
        except BaseException:
            share.release()
            raise
        done.add_done_callback(lambda _: share.release())
        try:
            return await asyncio.wrap_future(done)
        except asyncio.CancelledError:
            calls.interrupt()
            raise
