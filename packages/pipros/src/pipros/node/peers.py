"""The peers of a topic, and the listeners that are called when subscribers connect or disconnect."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol

from pipros.net.workers import Workers

if TYPE_CHECKING:
    from pipros.net.incoming import IncomingLink
    from pipros.net.outgoing import OutgoingLink
    from pipros.node.context import NodeContext
    from pipros.node.in_process import InProcessLink
    from pipros.node.latch import LastMessage


class PublisherLink(NamedTuple):
    """One subscriber of a publication: its name, its number, and the link to it."""

    caller_id: str
    number: int
    link: OutgoingLink


class SubscriberLink(NamedTuple):
    """One publisher that a subscription receives from."""

    uri: str
    caller_id: str
    number: int
    link: IncomingLink | InProcessLink
    last: LastMessage | None  # set only for latching publishers


class PeerListener(Protocol):
    """Listener for subscribers that connect or disconnect; see `rospy.SubscribeListener`."""

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None: ...

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None: ...


class PeerListeners(list[PeerListener]):
    """A topic's listeners. They are called in a separate thread, because they may block.

    The calls are sequential, in the order in which subscribers connected and disconnected.
    """

    def __init__(self, topic: str, context: NodeContext) -> None:
        super().__init__()
        self._topic = topic
        self._context = context
        self._thread = Workers(f"subscribe listeners of {topic}", limit=1, kept_idle=0)

    def connected(self, publish: Callable[..., None], publish_to_peer: Callable[..., None]) -> None:
        """Notify the listeners of a new subscriber."""
        self._notify(lambda listener: listener.peer_subscribe(self._topic, publish, publish_to_peer))

    def disconnected(self, left: int) -> None:
        """Notify the listeners that a subscriber has left, and how many are left."""
        self._notify(lambda listener: listener.peer_unsubscribe(self._topic, left))

    def _notify(self, notify: Callable[[PeerListener], None]) -> None:
        if self:
            self._thread.run(self._call, notify)

    def _call(self, notify: Callable[[PeerListener], None]) -> None:
        for listener in list(self):
            try:
                notify(listener)
            except Exception:
                self._context.log.exception("a subscribe listener of [%s] failed", self._topic)
