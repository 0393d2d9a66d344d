"""Sequence numbers in the headers of published messages."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from pipros.msg import load_message_class
from pipros.net.busy_poll import PublishCount
from pipros.net.outgoing_state import LinkState
from pipros.node.publication import Publication

PointStamped: Any = load_message_class("geometry_msgs/PointStamped")


def test_sequence_numbers_wrap_around() -> None:
    sent: list[int] = []
    context: Any = SimpleNamespace(
        limits=SimpleNamespace(stall_s=2.0), loop=None, published=PublishCount(), received=PublishCount()
    )
    publication = Publication("p", PointStamped, context)
    peer: Any = SimpleNamespace(link=SimpleNamespace(send=lambda frame, size: None, state=LinkState.IDLE))
    publication.links = (peer,)
    publication.encoder.sequence = 2**32 - 3
    for _ in range(4):
        message = PointStamped()
        publication.publish(message)
        sent.append(message.header.seq)
    assert sent == [2**32 - 2, 2**32 - 1, 0, 1]
