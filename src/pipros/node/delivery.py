"""Count the messages between nodes, to know when a node has handled all that was sent to it.

Both ends of a link count its messages from the first one on, so a publisher's count of the messages that it
sent over a link equals the subscriber's count once the callbacks for all of them have returned.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Final, NamedTuple

from pipros.net.incoming import ReceiveStatistics
from pipros.node.node import Node

_POLL_S: Final = 0.0001


class Sent(NamedTuple):
    """How many messages a publisher has sent to a subscriber over their present link for a topic."""

    topic: str
    publisher: str
    subscriber: str
    messages: int


def sent_by(node: Node) -> list[Sent]:
    """Send what was collected for bursts, and return the counts of all links to subscribers."""
    for publication in node.endpoints.publications:
        publication.flush()
    return [
        Sent(topic, node.name, subscriber, link.frames + link.dropped)
        for topic, links in node.endpoints.statistics()["publications"].items()
        for subscriber, link in links.items()
    ]


def wait_until_handled(node: Node, sent: Iterable[Sent], timeout_s: float) -> list[Sent]:
    """Wait until the node's callbacks have returned for all these messages. Return what is still missing.

    Entries for other subscribers are ignored, and so are links that have ended.
    """
    missing = [each for each in sent if each.subscriber == node.name]
    deadline = time.monotonic() + timeout_s
    while True:
        links = node.endpoints.statistics()["subscriptions"]
        missing = [each for each in missing if _is_missing(each, links.get(each.topic, {}))]
        if not missing or time.monotonic() > deadline or node.is_ending:
            return missing
        time.sleep(_POLL_S)


def _is_missing(sent: Sent, links: dict[str, ReceiveStatistics]) -> bool:
    link = links.get(sent.publisher)
    return link is not None and link.frames + link.dropped < sent.messages
