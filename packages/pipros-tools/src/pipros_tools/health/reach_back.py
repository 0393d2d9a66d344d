"""Test whether subscribers can connect to this machine, by briefly advertising their topics."""

from __future__ import annotations

import time
from collections.abc import Iterable
from threading import Condition

from pipros.basics.env import Environment
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.publication import Publication

Pairs = frozenset[tuple[str, str]]

_POLL_INTERVAL_S = 0.1


class _Arrivals:
    """A `PeerListener` that collects the subscribers that have connected."""

    def __init__(self) -> None:
        self.seen: set[tuple[str, str]] = set()
        self.changed = Condition()
        self._publications: list[Publication] = []

    def watch(self, publication: Publication) -> None:
        self._publications.append(publication)
        publication.listeners.append(self)

    def probe(self) -> None:
        """Add the subscribers that are currently connected."""
        found = {
            (publication.topic, link.caller_id)
            for publication in list(self._publications)
            for link in publication.links
        }
        with self.changed:
            self.seen |= found
            self.changed.notify_all()

    def peer_subscribe(self, *_: object) -> None:
        self.probe()

    def peer_unsubscribe(self, *_: object) -> None:
        self.probe()


def reach_back(pairs: Iterable[tuple[str, str]], environment: Environment, *, wait_s: float = 3.0) -> Pairs:
    """Return the (topic, subscriber) pairs whose subscriber connects to this process within `wait_s`.

    During the test, each topic has an additional publisher that accepts any type and sends nothing.
    """
    wanted = frozenset(pairs)
    arrivals = _Arrivals()
    with Node("pipros_doctor", anonymous=True, environment=environment) as node:
        for topic in sorted({topic for topic, _ in wanted}):
            node.advertise(topic, AnyMsg)
            publication = node.endpoints.publication(topic)
            if publication is not None:
                arrivals.watch(publication)
        until = time.monotonic() + wait_s
        while not wanted <= arrivals.seen and (left := until - time.monotonic()) > 0:
            with arrivals.changed:
                arrivals.changed.wait(min(left, _POLL_INTERVAL_S))
            arrivals.probe()
    return frozenset(arrivals.seen & wanted)
