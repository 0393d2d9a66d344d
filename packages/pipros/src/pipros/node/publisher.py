"""The handle for a topic that a node publishes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Generic

from pipros.node.codec import AnyMessage
from pipros.node.publication import Publication


class Publisher(Generic[AnyMessage]):
    """A handle for a topic that the node publishes. Returned by `Node.advertise`."""

    def __init__(self, publication: Publication, release: Callable[[Publication], None]) -> None:
        self.publication = publication
        self._release: Callable[[Publication], None] | None = release

    @property
    def topic(self) -> str:
        return self.publication.topic

    @property
    def connection_count(self) -> int:
        return len(self.publication.links) + len(self.publication.links_in_process)

    def publish(self, message: AnyMessage) -> None:
        """Send a message to every subscriber; do nothing once the node has shut down.

        Blocks for at most `Limits.stall_s`, for all subscribers together. See `Publication.publish` for
        details and errors.
        """
        self.publication.publish(message)

    def statistics(self) -> Mapping[str, int]:
        """Return the topic's traffic since the first `advertise`, for all subscribers together.

        The keys are `frames`, the number of messages sent; `bytes`, the number of bytes sent; `dropped`, the
        number of messages not sent because a subscriber was too slow or disconnected; and `links_ended`, the
        number of closed links, each of which may have lost messages.
        """
        return self.publication.statistics()

    @property
    def is_registered(self) -> bool:
        """Whether `unregister` has not been called."""
        return self._release is not None

    def unregister(self) -> None:
        """Release the handle; releasing the last handle unregisters the topic. May be called repeatedly."""
        release, self._release = self._release, None
        if release is not None:
            release(self.publication)
