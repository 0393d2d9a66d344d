"""The running system as the page sees it: observed once for all browsers, with subscriptions on demand."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator

from pipros.graph.client import GraphClient
from pipros.graph.observer import Observation, SystemObserver
from pipros.node import Node
from pipros.web.topic_watch import TopicWatches

LOOK_INTERVAL_S = 1.0
"""How often the system is observed while at least one browser shows it."""


class WatchedSystem:
    """What views and actions work with.

    Attributes:
        graph: the connection to the master.
        node: the page's own node. It is registered with its first subscription.
        topics: the topics that are being watched.
        observation: the last one.
    """

    def __init__(self, graph: GraphClient, node: Node) -> None:
        self.graph = graph
        self.node = node
        self.topics = TopicWatches(node)
        self.observation = Observation()
        self._observer = SystemObserver(graph.master)
        self._waiting: set[asyncio.Future[Observation]] = set()
        self._wanted = threading.Event()
        self._is_over = threading.Event()

    def start(self) -> None:
        """Prepares to observe when a browser requests it. Must be called in the event loop of the server."""
        loop = asyncio.get_running_loop()
        threading.Thread(target=self._observe, args=(loop,), name="observer", daemon=True).start()

    def close(self) -> None:
        """Stops observing."""
        self._is_over.set()
        self._wanted.set()

    async def observations(self) -> AsyncIterator[Observation]:
        """Yields the newest observation, at most once per interval."""
        while True:
            future: asyncio.Future[Observation] = asyncio.get_running_loop().create_future()
            self._waiting.add(future)
            self._wanted.set()
            try:
                yield await future
            finally:
                self._waiting.discard(future)

    def _observe(self, loop: asyncio.AbstractEventLoop) -> None:
        while not self._is_over.is_set():
            self._wanted.wait()
            self._wanted.clear()
            if self._is_over.is_set():
                return
            observation = self._observer.look()
            with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
                loop.call_soon_threadsafe(self._tell, observation)
            self._is_over.wait(LOOK_INTERVAL_S)

    def _tell(self, observation: Observation) -> None:
        self.observation = observation
        waiting, self._waiting = self._waiting, set()
        for future in waiting:
            if not future.done():
                future.set_result(observation)
