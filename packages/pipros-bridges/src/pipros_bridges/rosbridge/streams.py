"""The messages of one topic for one client: encoded, throttled and queued."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Hashable
from typing import Final

from pipros.basics.errors import PiprosError
from pipros_bridges.outbox import ClientOutbox
from pipros_bridges.rosbridge.effects import DeliveryOptions
from pipros_bridges.rosbridge.encoding import Encoder
from pipros_bridges.rosbridge.shared_publisher import CallLater
from pipros_bridges.shared_topics import SharedTopics, Taken, TopicMessage

MESSAGE_BYTES: Final = 500
"""Approximate memory for a queued message, besides its content."""
REPORTED_ERRORS: Final = 10
"""Maximum number of distinct errors that are reported for one topic."""


class TopicStream:
    """Passes a topic's messages to a client's outbox, in the threads that receive them.

    With `throttle_s`, at most one message is sent per interval. Of the messages that arrive before the
    interval is over, the newest `queue_length` are queued, and older messages are dropped. Queued messages
    count as part of the client's queue; if this queue has no room left, only the newest message is kept.
    """

    # A client may have thousands of these objects.
    __slots__ = (
        *("_call_later", "_delivery", "_due_s", "_encoder", "_errors", "_is_closed", "_is_waking", "_lock"),
        *("_newest", "_on_error", "_outbox", "_taken", "_topic", "_topics", "_user", "_waiting"),
    )

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
        self._delivery = DeliveryOptions()
        self._taken: Taken | None = None
        self._newest: TopicMessage | None = None
        # queued messages with their counted sizes; None until the first is queued, because even an empty
        # deque takes 600 bytes
        self._waiting: deque[tuple[TopicMessage, int]] | None = None
        self._due_s = 0.0
        self._is_waking = False
        self._is_closed = False
        self._errors: tuple[str, ...] = ()
        self._lock = threading.Lock()

    def take(self, kind: str | None, delivery: DeliveryOptions) -> None:
        """Start the delivery or change its options. Do nothing after `close`.

        A latched message is sent again, for the new subscription.

        Raises:
            PiprosError: the topic's name is invalid, or there are too many topics.
        """
        self._outbox.open(self._topic, delivery.queue_length)
        is_first = [True]

        def on_message(message: TopicMessage) -> None:
            self._on_message(message, is_new=bool(is_first and is_first.pop()))

        with self._lock:  # messages that arrive now are handled with the new options
            if self._is_closed:
                return
            self._taken = self._topics.take(
                self._topic, kind, on_message, self._report_error, self._user, self._taken
            )
            self._delivery = delivery

    def close(self) -> None:
        """Stop sending: discard queued messages and end the subscriptions."""
        with self._lock:
            self._is_closed = True
            while self._waiting:
                self._outbox.let_go(self._waiting.popleft()[1])
            self._waiting = None
            taken, self._taken = self._taken, None
        if taken is not None:
            taken.close()
            self._encoder.forget(taken.topic)
        self._outbox.forget(self._topic)

    def _on_message(self, message: TopicMessage, *, is_new: bool) -> None:
        with self._lock:
            # While a subscription is being replaced, both subscriptions receive each message.
            if message is self._newest and not (is_new and message.is_latched):
                return
            self._newest = message
            delivery = self._delivery
            is_due = not delivery.throttle_s or self._may_send(message, delivery)
        if is_due:
            self._send(message, delivery)

    def _may_send(self, message: TopicMessage, delivery: DeliveryOptions) -> bool:
        """Return whether a message may be sent now; if not, drop or queue it."""
        now_s = time.monotonic()
        if now_s >= self._due_s and not self._waiting:
            self._due_s = now_s + delivery.throttle_s
            return True
        if delivery.queue_length:
            self._queue(message, delivery.queue_length)
            self._wake_later(self._due_s - now_s)
        return False

    def _queue(self, message: TopicMessage, queue_length: int) -> None:
        if self._waiting is None:
            self._waiting = deque()
        while len(self._waiting) >= queue_length:
            self._outbox.let_go(self._waiting.popleft()[1])
        size = len(message.body) + MESSAGE_BYTES
        while not self._outbox.hold(size):
            if not self._waiting:
                size = 0  # the newest message is kept in any case
                break
            self._outbox.let_go(self._waiting.popleft()[1])
        self._waiting.append((message, size))

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
            (message, size), delivery = self._waiting.popleft(), self._delivery
            self._outbox.let_go(size)
            self._due_s = time.monotonic() + delivery.throttle_s
            if self._waiting:
                self._wake_later(delivery.throttle_s)
        self._send(message, delivery)

    def _send(self, message: TopicMessage, delivery: DeliveryOptions) -> None:
        try:
            frames = self._encoder.encoded(message).frames(
                delivery.encoding, self._topic, delivery.fragment_size
            )
        except PiprosError as error:
            self._report(f"[{self._topic}]: {error}")
        else:
            self._outbox.put(self._topic, *frames)

    def _report_error(self, error: PiprosError) -> None:
        self._report(str(error))

    def _report(self, text: str) -> None:
        if text not in self._errors and len(self._errors) < REPORTED_ERRORS:
            self._errors = (*self._errors, text)
            self._on_error(text)
