"""Topics watched by browsers, with one subscription per topic for all browsers."""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING

from pipros.basics import one_thread
from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import Limits, limit_text, process_limits
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.subscriber import Subscriber
from pipros_page.limits import PageLimits
from pipros_server.browser_share import browser_or_none, has_share
from pipros_tools.graph.raw_decoder import RawDecoder

if TYPE_CHECKING:
    pass
from pipros_page.topic_watch import WINDOW, Record, TopicWatch


class TopicWatches:
    """All watched topics.

    A thread subscribes and unsubscribes, because the master may be slow or unavailable. `record` receives
    the messages of all topics.
    """

    def __init__(self, node: Node, limits: Limits | None = None, record: Record | None = None) -> None:
        self._node = node
        self._record = record
        self._limits = limits or process_limits()
        self._decoder = RawDecoder()
        self._lock = threading.Lock()
        self._watches: dict[str, TopicWatch] = {}
        self._subscribers: dict[str, tuple[TopicWatch, Subscriber[AnyMsg]]] = {}
        self._is_subscribing = False
        self._is_closed = False

    def close(self) -> None:
        """Stop changing subscriptions. The node unsubscribes from all topics at once when it is shut down."""
        with self._lock:
            self._is_closed = True

    @contextlib.contextmanager
    def watch(self, topic: str, *, queue_size: int = WINDOW) -> Iterator[TopicWatch]:
        """Subscribe to a topic within the context. Contexts of the same topic share a subscription.

        Args:
            queue_size: maximum number of queued messages, which only the first context of a topic determines.

        Raises:
            LimitExceeded: this browser watches its share of `PageLimits.page_topics`; see `has_share`.
        """
        with self._lock:
            watch = self._watches.get(topic)
            if watch is None:
                limit = self._limits.of(PageLimits).page_topics
                if not has_share(browser_or_none(), [each.browser for each in self._watches.values()], limit):
                    what = "this browser watches half of the topics that others leave"
                    raise LimitExceeded(f"{what}; {limit_text('page_topics', limit)}")
                watch = self._watches[topic] = self._new_watch(topic, queue_size)
            watch.users += 1
        self.update()
        try:
            yield watch
        finally:
            with self._lock:
                watch.users -= 1
                if not watch.users:
                    del self._watches[topic]
            self.update()

    def watches(self) -> list[TopicWatch]:
        """Return all current watches."""
        with self._lock:
            return list(self._watches.values())

    def _new_watch(self, topic: str, queue_size: int) -> TopicWatch:
        listeners = () if self._record is None else (functools.partial(self._record, topic),)
        return TopicWatch(topic, self._decoder, queue_size, self._limits, listeners=listeners)

    def update(self) -> None:
        """Start a thread that updates the subscriptions to match the watches."""
        with self._lock:
            if not self._is_subscribing and self._next_change() is not None:
                self._is_subscribing = True
                one_thread.start_thread(self._make_changes, name="subscriptions")

    def _make_changes(self) -> None:
        while self._make_change():
            pass

    def _make_change(self) -> bool:
        """Update one subscription. Return False if there was nothing to change."""
        with self._lock:
            change = self._next_change()
            if change is None:
                self._is_subscribing = False
                return False
            topic, watch = change
            subscribed = self._subscribers.pop(topic, None)
        if subscribed is not None:
            subscribed[1].unregister()
        elif watch is not None:
            subscriber = self._node.subscribe(topic, AnyMsg, watch.note, queue_size=watch.queue_size)
            with self._lock:
                self._subscribers[topic] = watch, subscriber
        return True

    def _next_change(self) -> tuple[str, TopicWatch | None] | None:
        """Return a topic whose subscription does not match its watch, and the watch (None if it has ended).

        Return None if all subscriptions match.
        """
        if self._is_closed:
            return None
        for topic, (watch, _) in self._subscribers.items():
            if self._watches.get(topic) is not watch:
                return topic, self._watches.get(topic)
        return next((item for item in self._watches.items() if item[0] not in self._subscribers), None)
