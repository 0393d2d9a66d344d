"""Count the messages between nodes, to determine when a node has handled all messages sent to it.

Both ends count all messages of a link, so the publisher's count equals the subscriber's count once the
callbacks for all of the messages have returned.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Final, NamedTuple

from pipros.net.incoming import ReceiveStatistics
from pipros.node.node import Node

_POLL_S: Final = 0.0001


class Sent(NamedTuple):
    """The number of messages that a publisher has sent or dropped on its current link to a subscriber."""

    topic: str
    publisher: str
    subscriber: str
    messages: int


def sent_by(node: Node) -> list[Sent]:
    """Send the messages that bursts have collected, and return the counts of all links to subscribers."""
    for publication in node.endpoints.publications:
        publication.flush()
    return [
        Sent(topic, node.name, subscriber, link.frames + link.dropped)
        for topic, links in node.endpoints.statistics()["publications"].items()
        for subscriber, link in links.items()
    ]


def wait_until_handled(node: Node, sent: Iterable[Sent], timeout_s: float) -> list[Sent]:
    """Wait until the node's callbacks have returned for all these messages.

    Return the entries whose messages have not all been handled in time. Entries for other subscribers, and
    for links that have ended, are ignored.
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
