"""The handle for one callback of a topic that a node receives."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping
from typing import Generic

from pipros.node.asyncio_support import MessageStream
from pipros.node.codec import AnyMessage
from pipros.node.subscription import SubscriberCallback, Subscription


class Subscriber(Generic[AnyMessage]):
    """A handle for one callback of a topic. Returned by `Node.subscribe`."""

    def __init__(
        self,
        subscription: Subscription,
        entry: SubscriberCallback | None,
        release: Callable[[Subscription, SubscriberCallback | None], None],
    ) -> None:
        self.subscription = subscription
        self._entry = entry
        self._release: Callable[[Subscription, SubscriberCallback | None], None] | None = release

    @property
    def topic(self) -> str:
        return self.subscription.topic

    @property
    def connection_count(self) -> int:
        return len(self.subscription.links)

    def statistics(self) -> Mapping[str, int]:
        """Return the topic's traffic since the first `subscribe`, for all publishers together.

        The keys are `frames`, the number of messages delivered; `bytes`, the number of bytes received;
        `dropped`, the number of messages dropped because callbacks were too slow or a link ended; and
        `links_ended`, the number of closed links, each of which may have lost messages.
        """
        return self.subscription.statistics()

    @property
    def is_registered(self) -> bool:
        """Whether `unregister` has not been called."""
        return self._release is not None

    def unregister(self) -> None:
        """Remove the callback; removing the last callback unregisters the topic. May be called repeatedly."""
        release, self._release = self._release, None
        if release is not None:
            release(self.subscription, self._entry)
            if self._entry is not None and isinstance(self._entry.callback, MessageStream):
                self._entry.callback.close()

    def __aiter__(self) -> AsyncIterator[AnyMessage]:
        """Return an iterator over the messages.

        Raises:
            TypeError: the subscriber has a callback, or was created outside an asyncio loop.
        """
        if self._entry is None or not isinstance(self._entry.callback, MessageStream):
            raise TypeError(f"[{self.topic}] was subscribed to with a callback, or outside an event loop")
        return self._entry.callback
