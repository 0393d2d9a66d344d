"""The topics of a bag as a system that the page can watch, instead of the running one."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Collection, Iterator

from pipros_page.topic_watch import WINDOW, TopicWatch
from pipros_page.topic_watches import TopicWatches
from pipros_page.watched_system import POLL_INTERVAL_S, WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.observer import GraphObservation


class BagSystem(WatchedSystem):
    """Stand-in for the running system that provides a bag's topics at the playback's moment."""

    def __init__(self, live: WatchedSystem, topics: TopicWatches, now_s: Callable[[], float]) -> None:
        super().__init__(live.graph, live.node)
        self.topics = topics
        self.questions, self.computations = live.questions, live.computations
        self._now_s = now_s

    @property
    def is_live(self) -> bool:
        return False

    def now_s(self) -> float:
        return self._now_s()

    async def observations(self) -> AsyncIterator[GraphObservation]:
        """Periodically yield the topics of the bag, with the nodes that published them."""
        while True:
            yield self.observation
            await asyncio.sleep(POLL_INTERVAL_S)


class BagTopics(TopicWatches):
    """Watched topics whose messages are provided by a playback.

    `on_change` is called after a topic has been added or removed. `recorded` contains the topics that can be
    watched; None for all.
    """

    def __init__(
        self,
        live: WatchedSystem,
        on_change: Callable[[], None],
        now_s: Callable[[], float],
        recorded: Collection[str] | None = None,
    ) -> None:
        super().__init__(live.node)
        self._on_change = on_change
        self._now_s = now_s
        self._recorded = recorded

    @contextlib.contextmanager
    def watch(self, topic: str, *, queue_size: int = WINDOW) -> Iterator[TopicWatch]:
        """Watch a topic in the bag.

        Raises:
            RequestRefused: `recorded` does not contain the topic.
        """
        if self._recorded is not None and topic not in self._recorded:
            raise not_recorded(topic)
        with super().watch(topic, queue_size=queue_size) as watch:
            yield watch

    def update(self) -> None:
        self._on_change()

    def _new_watch(self, topic: str, queue_size: int) -> TopicWatch:
        return TopicWatch(topic, self._decoder, queue_size, self._limits, self._now_s)


def not_recorded(what: str) -> RequestRefused:
    """Return the error for a topic or a field that a `Recording` does not contain."""
    return RequestRefused(f"{what} was not recorded: no view showed it in the recorded time")
