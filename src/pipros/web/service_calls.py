"""The service calls of browsers: bounded in number and time, and ended with the request or the browser."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from pipros.net.master_client import MasterClient
from pipros.node.service_client import OpenCalls
from pipros.web.browser_share import CALLS_OF_A_BROWSER, share_of_calls
from pipros.web.daemon_pool import DaemonPool
from pipros.web.server import RequestRefused

T = TypeVar("T")

CALLS_AT_ONCE = 64
"""Calls of all browsers; further ones wait."""

TOOL_CALL_S = 30.0
"""How long the calls may take that belong to a tab: loggers, parameters of dynamic_reconfigure."""

CALL_BY_HAND_S = 600.0


class ServiceCalls:
    """Calls services in threads."""

    def __init__(self, master: Callable[[], MasterClient]) -> None:
        self._master = master
        self._pool = DaemonPool("service call", CALLS_AT_ONCE)

    async def run(self, call: Callable[[MasterClient, OpenCalls], T]) -> T:
        """Return what `call` returns. Its open calls are interrupted when the coroutine is cancelled.

        Raises:
            RequestRefused: the browser has `CALLS_OF_A_BROWSER` calls open.
        """
        share = share_of_calls()
        if not share.try_acquire():
            raise RequestRefused(f"{CALLS_OF_A_BROWSER} calls of this browser are open; wait until one ends")
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
