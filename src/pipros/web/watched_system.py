"""The running system as the page sees it: observed once for all browsers, with subscriptions on demand."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
from collections.abc import AsyncIterator
from dataclasses import replace

from pipros.graph.client import GraphClient
from pipros.graph.observer import Observation, SystemObserver
from pipros.node import Node
from pipros.web.daemon_pool import DaemonPool
from pipros.web.service_calls import ServiceCalls
from pipros.web.topic_watch import TopicWatches

logger = logging.getLogger("pipros.web")

LOOK_INTERVAL_S = 1.0
"""How often the system is observed while at least one browser shows it."""
MASTER_DEADLINE_S = 30.0
"""How long a call of the master may take."""
QUESTIONS_AT_ONCE = 8
"""Calls of the master, and of nodes, that views make at a time."""
COMPUTATIONS_AT_ONCE = 4
"""Messages and drawings under way; more threads would not make them sooner."""


class WatchedSystem:
    """What views and actions work with.

    Attributes:
        graph: the connection to the master.
        node: the page's own node. It is registered with its first subscription.
        topics: the topics that are being watched.
        calls: the service calls of browsers.
        questions: threads for calls of the master and of the APIs of nodes.
        computations: threads that decode and draw.
        observation: the last one.
    """

    def __init__(self, graph: GraphClient, node: Node) -> None:
        self.graph = graph
        self.node = node
        self.topics = TopicWatches(node)
        self.calls = ServiceCalls(lambda: graph.master)
        self.questions = DaemonPool("question", QUESTIONS_AT_ONCE)
        self.computations = DaemonPool("computation", COMPUTATIONS_AT_ONCE)
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
        """Stops observing and subscribing."""
        self.topics.close()
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
        logged: set[type[Exception]] = set()
        while not self._is_over.is_set():
            self._wanted.wait()
            self._wanted.clear()
            if self._is_over.is_set():
                return
            try:
                observation = self._observer.look()
            except Exception as error:  # a mistake, of which one line per kind is enough
                text = f"cannot observe the system: {type(error).__name__}: {error}"
                if type(error) not in logged:
                    logged.add(type(error))
                    logger.error("%s", text, exc_info=error)
                observation = replace(self.observation, error=text)
            with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
                loop.call_soon_threadsafe(self._tell, observation)
            self._is_over.wait(LOOK_INTERVAL_S)

    def _tell(self, observation: Observation) -> None:
        self.observation = observation
        waiting, self._waiting = self._waiting, set()
        for future in waiting:
            if not future.done():
                future.set_result(observation)
