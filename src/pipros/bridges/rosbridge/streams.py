"""The messages of one topic for one client: encoded, throttled and queued."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Hashable
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.bridges.outbox import ClientOutbox
from pipros.bridges.rosbridge.effects import Delivery
from pipros.bridges.rosbridge.encoding import Encoder
from pipros.bridges.rosbridge.publishing import CallLater
from pipros.bridges.shared_topics import SharedTopics, Taken, TopicMessage

REPORTED_ERRORS: Final = 10
"""Maximum number of distinct errors that are reported for one topic."""


class TopicStream:
    """Passes a topic's messages to a client's outbox, in the threads that receive them.

    With `throttle_s`, at most one message is sent per interval. Of the messages that arrive before the
    interval is over, the newest `queue_length` are queued and the others are dropped.
    """

    def __init__(
        self,
        topic: str,
        topics: SharedTopics,
        encoder: Encoder,
        outbox: ClientOutbox,
        on_error: Callable[[str], object],
        call_later: CallLater,
        user: Hashable = None,
    ) -> None:
        self._topic = topic
        self._topics = topics
        self._encoder = encoder
        self._outbox = outbox
        self._on_error = on_error
        self._call_later = call_later
        self._user = user
        self._delivery = Delivery()
        self._taken: list[Taken] = []
        self._newest: TopicMessage | None = None
        self._waiting: deque[TopicMessage] = deque()
        self._due_s = 0.0
        self._is_waking = False
        self._is_closed = False
        self._errors: set[str] = set()
        self._lock = threading.Lock()

    def take(self, kind: str | None, delivery: Delivery) -> None:
        """Start the delivery or change its options.

        A latched message is sent again, for the new subscription.

        Raises:
            PiprosError: the topic's name is invalid, or there are too many topics.
        """
        self._outbox.open(self._topic, delivery.queue_length)
        is_first: list[bool] = [True]

        def on_message(message: TopicMessage) -> None:
            is_new, is_first[0] = is_first[0], False
            self._on_message(message, is_new=is_new)

        with self._lock:  # messages that arrive now are handled with the new options
            taken = self._topics.take(
                self._topic, kind, on_message, lambda error: self._report(str(error)), self._user
            )
            self._delivery = delivery
            self._taken.append(taken)
            # Messages come from the oldest subscription until the newest one is effective.
            replaced = self._replaced() or self._taken[1:-1]
            self._taken = [each for each in self._taken if each not in replaced]
        for each in replaced:
            each.close()

    def close(self) -> None:
        """Stop sending: discard queued messages and end the subscriptions."""
        with self._lock:
            self._is_closed = True
            self._waiting.clear()
            taken, self._taken = self._taken, []
        for each in taken:
            each.close()
            self._encoder.forget(each.topic)
        self._outbox.forget(self._topic)

    def _on_message(self, message: TopicMessage, *, is_new: bool) -> None:
        with self._lock:
            # While a subscription is being replaced, the old and the new one both receive each message.
            if message is self._newest and not (is_new and message.is_latched):
                return
            self._newest = message
            replaced = self._replaced()
            delivery = self._delivery
            is_due = not delivery.throttle_s or self._may_send(message, delivery)
        for each in replaced:
            each.close()
        if is_due:
            self._send(message, delivery)

    def _replaced(self) -> list[Taken]:
        """Remove and return the subscriptions that newer subscriptions have replaced."""
        if len(self._taken) < 2 or self._taken[-1].subscriber is None:
            return []
        replaced, self._taken = self._taken[:-1], self._taken[-1:]
        return replaced

    def _may_send(self, message: TopicMessage, delivery: Delivery) -> bool:
        """Return whether a message may be sent now; if not, drop or queue it."""
        now_s = time.monotonic()
        if now_s >= self._due_s and not self._waiting:
            self._due_s = now_s + delivery.throttle_s
            return True
        if delivery.queue_length:
            while len(self._waiting) >= delivery.queue_length:
                self._waiting.popleft()
            self._waiting.append(message)
            self._wake_later(self._due_s - now_s)
        return False

    def _wake_later(self, delay_s: float) -> None:
        if not self._is_waking:
            self._is_waking = True
            self._call_later(max(delay_s, 0.0), self._wake)

    def _wake(self) -> None:
        """Send the next queued message."""
        with self._lock:
            self._is_waking = False
            if self._is_closed or not self._waiting:
                return
            message, delivery = self._waiting.popleft(), self._delivery
            self._due_s = time.monotonic() + delivery.throttle_s
            if self._waiting:
                self._wake_later(delivery.throttle_s)
        self._send(message, delivery)

    def _send(self, message: TopicMessage, delivery: Delivery) -> None:
        try:
            frames = self._encoder.encoded(message).frames(
                delivery.encoding, self._topic, delivery.fragment_size
            )
        except PiprosError as error:
            self._report(f"[{self._topic}]: {error}")
        else:
            self._outbox.put(self._topic, *frames)

    def _report(self, text: str) -> None:
        if text not in self._errors and len(self._errors) < REPORTED_ERRORS:
            self._errors.add(text)
            self._on_error(text)
