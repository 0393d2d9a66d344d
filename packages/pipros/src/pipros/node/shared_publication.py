"""The shared memory of a publication. This module is imported when a subscriber first accepts such memory."""

from __future__ import annotations

import socket
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from pipros.net.backlog import WireMessage
from pipros.net.outgoing import OutgoingLink
from pipros.net.outgoing_local import LocalOutgoingLink
from pipros.net.outgoing_state import LinkState
from pipros.net.shared_memory import LEAST_BYTES, TopicMemory
from pipros.node.context import NodeContext

if TYPE_CHECKING:
    from pipros.node.peers import PublisherLink

_IDLE = LinkState.IDLE


class SharedPublication:
    """The memory of one topic, and its links to the subscribers that use it.

    Attributes:
        memory: the topic's shared memory, whose state `rosnode info` shows.
    """

    def __init__(self, topic: str, context: NodeContext) -> None:
        self._context = context
        self.memory = TopicMemory(
            topic,
            context.loop,
            context.memory,
            context.log,
            context.timings.links.keep_memory_s,
        )

    def link(
        self,
        sock: socket.socket,
        *,
        queue_size: int | None,
        on_closed: Callable[[OutgoingLink], object],
    ) -> LocalOutgoingLink:
        """Return the link to a new subscriber."""
        return LocalOutgoingLink(
            sock,
            self._context.loop,
            queue_size=queue_size,
            limits=self._context.limits,
            timings=self._context.timings.links,
            memory=self.memory,
            on_closed=on_closed,
        )

    def send(self, links: Sequence[PublisherLink], message: WireMessage, size: int) -> bool:
        """Send a message to all subscribers, in shared memory where possible. Return True if it was sent.

        If the message is small or no subscriber can get it in shared memory, send nothing and return False.
        Must be called by only one thread at a time.
        """
        if size < LEAST_BYTES:
            return False
        local = _local(links)
        self.memory.offer([link.memory for link in local])
        able = [link.memory for link in local if link.state is _IDLE]
        placed = self.memory.place(able, message, size - len(message[0]))
        if placed is None:
            return False
        try:
            for peer in links:
                if isinstance(peer.link, LocalOutgoingLink):
                    peer.link.send_placed(placed, message, size)
                else:
                    peer.link.send(message, size)
        finally:
            self.memory.release(placed.slot)
        return True

    def wait_for_space(self, links: Sequence[PublisherLink], limit_s: float) -> None:
        """Wait until the subscribers have room for another message, for at most `limit_s`."""
        self.memory.wait_for_space([link.memory for link in _local(links)], limit_s)


def _local(links: Sequence[PublisherLink]) -> list[LocalOutgoingLink]:
    return [peer.link for peer in links if isinstance(peer.link, LocalOutgoingLink)]
