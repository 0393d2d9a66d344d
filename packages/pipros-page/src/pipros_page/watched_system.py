"""The running system, observed once for all browsers, with subscriptions on demand."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
import time
from collections.abc import AsyncIterator, Callable, Hashable
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any, TypeVar

from pipros.basics import one_thread
from pipros.node import Node
from pipros_page.bags.rewind import RecentMessages
from pipros_page.service_calls import ServiceCalls
from pipros_page.shared import Shared
from pipros_page.stale import TopicActivity
from pipros_page.topic_watches import TopicWatches
from pipros_server.act_gate import ActGate
from pipros_server.daemon_pool import DaemonPool
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.node_clients import NodeClients
from pipros_tools.graph.observer import ANSWER_DEADLINE_S, GraphObservation, SystemObserver
from pipros_tools.graph.recent_changes import RecentChanges

logger = logging.getLogger("pipros_page")
T = TypeVar("T")

POLL_INTERVAL_S = 1.0
"""Interval of observations while at least one browser displays them."""
MASTER_DEADLINE_S = 30.0
"""Timeout of calls to the master."""
_LOOK_S = 0.1
"""Interval at which the observer looks for browsers where Python has no threads."""
QUESTIONS_AT_ONCE = 8
"""Maximum number of concurrent calls from views to the master and to nodes."""
COMPUTATIONS_AT_ONCE = 4
"""Maximum number of concurrent decodings and drawings. More threads would not be faster."""


class WatchedSystem:
    """Resources shared by all views and actions.

    Attributes:
        graph: client of the master and the nodes.
        node: the page's own node, which is registered with its first subscription.
        gate: allows or refuses the browsers' acts.
        topics: watched topics.
        recent: the recent messages of all watched topics; None if they are not recorded.
        calls: service calls from browsers.
        questions: threads for calls to the master and to the nodes' APIs.
        computations: threads that decode and draw.
        node_clients: connections to the nodes' APIs.
        observation: the latest observation.
        changes: nodes and topics that were recently added or removed.
        activity: determines which topics are stale.
    """

    def __init__(
        self,
        graph: GraphClient,
        node: Node,
        gate: ActGate | None = None,
        *,
        interval_s: float = POLL_INTERVAL_S,
        recent: RecentMessages | None = None,
    ) -> None:
        """Store the resources. The system is observed at most once per `interval_s`.

        Without a gate, browsers may do everything that the page permits.
        """
        self.gate = gate or ActGate(node)
        self._interval_s = interval_s
        self.graph = graph
        self.node = node
        self.recent = recent
        self.topics = TopicWatches(node, record=None if recent is None else recent.add)
        self.calls = ServiceCalls(lambda: graph.master)
        self.questions = DaemonPool("question", QUESTIONS_AT_ONCE)
        self.computations = DaemonPool("computation", COMPUTATIONS_AT_ONCE)
        self.observation = GraphObservation()
        self.changes = RecentChanges()
        self.node_clients = NodeClients(ANSWER_DEADLINE_S)
        self.activity = TopicActivity()
        self._shared: dict[Any, Shared[Any]] = {}
        self._observer = SystemObserver(graph.master, clients=self.node_clients)
        self._observed_s = float("-inf")
        self._waiting: set[asyncio.Future[GraphObservation]] = set()
        self._wanted = threading.Event()
        self._logged: set[type[Exception]] = set()
        self._is_over = threading.Event()

    def start(self) -> None:
        """Start the observer thread, which observes the system only on demand.

        Must be called in the server's event loop.
        """
        loop = asyncio.get_running_loop()
        one_thread.start_work(
            lambda: self._observe(loop), lambda: self._observe_in_turn(loop), name="observer"
        )

    def close(self) -> None:
        """Stop observing and subscribing."""
        self.topics.close()
        self._is_over.set()
        self._wanted.set()
        self.node_clients.keep_only(())

    @property
    def is_live(self) -> bool:
        """Whether messages come from the running system rather than from a bag."""
        return True

    def now_s(self) -> float:
        """Return the current time (s), for comparison with the arrival times of messages."""
        return time.time()

    def shared(self, make: Callable[..., AbstractContextManager[T]], *arguments: Hashable) -> Shared[T]:
        """Return the value that `make(system, *arguments)` creates. Calls with equal arguments share it."""
        key = make, arguments
        return self._shared.setdefault(key, Shared(lambda: make(self, *arguments)))

    async def observations(self) -> AsyncIterator[GraphObservation]:
        """Yield the newest observation, at most once per `interval_s`, at once if it is no older."""
        if time.monotonic() - self._observed_s < self._interval_s:
            yield self.observation
        while True:
            future: asyncio.Future[GraphObservation] = asyncio.get_running_loop().create_future()
            self._waiting.add(future)
            self._wanted.set()
            try:
                yield await future
            finally:
                self._waiting.discard(future)

    def _observe(self, loop: asyncio.AbstractEventLoop) -> None:
        while not self._is_over.is_set():
            self._wanted.wait()
            if self._is_over.is_set():
                return
            self._observe_once(loop)
            self._is_over.wait(self._interval_s)

    def _observe_in_turn(self, loop: asyncio.AbstractEventLoop) -> float | None:
        """Observe the system if that is wanted. Return when to do so again; see `one_thread.start_work`."""
        if self._is_over.is_set():
            return None
        if not self._wanted.is_set():
            return _LOOK_S
        self._observe_once(loop)
        return self._interval_s

    def _observe_once(self, loop: asyncio.AbstractEventLoop) -> None:
        self._wanted.clear()
        try:
            observation = self._observer.poll()
        except Exception as error:  # unexpected; log each type of error once
            text = f"cannot observe the system: {type(error).__name__}: {error}"
            if type(error) not in self._logged:
                self._logged.add(type(error))
                logger.error("%s", text, exc_info=error)
            observation = replace(self.observation, error=text)
        with contextlib.suppress(RuntimeError):  # the loop has stopped in the meantime
            loop.call_soon_threadsafe(self._publish, observation)

    def _publish(self, observation: GraphObservation) -> None:
        self.observation = observation
        self._observed_s = time.monotonic()
        now_s = time.time()
        self.changes.add(observation, now_s)
        self.activity.add(observation, now_s)
        waiting, self._waiting = self._waiting, set()
        for future in waiting:
            if not future.done():
                future.set_result(observation)
