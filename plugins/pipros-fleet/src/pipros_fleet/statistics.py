"""A member's counters, for other members and for `/diagnostics`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from typing import Any, Final

from pipros.fleet.calls import LocalCalls
from pipros.fleet.link_statuses import LinkTraffic, link_statuses
from pipros.fleet.offers import Offers
from pipros.fleet.shown_members import ShownMembers
from pipros.fleet.sinks import Sink
from pipros.fleet.sources import SentTopic
from pipros.fleet.zenoh_session import ZenohQuestion
from pipros.libraries.diagnostics.link_status import LinkDiagnostics
from pipros.node import Node

DIAGNOSTICS_S: Final = 1.0
"""Interval between messages on `/diagnostics`."""


class Statistics:
    """Collector of a member's counters."""

    def __init__(
        self,
        member: str,
        offers: Offers,
        shown: ShownMembers,
        calls: LocalCalls,
        present: Callable[[], Iterator[str]],
    ) -> None:
        self._member = member
        self._offers = offers
        self._shown = shown
        self._calls = calls
        self._present = present
        self._diagnostics: LinkDiagnostics | None = None
        self._published_s = 0.0
        self._received_before: dict[str, LinkTraffic] = {}

    def counters(self) -> dict[str, Any]:
        """Return the counters, for `pipros fleet top`. Callable from any thread."""
        return {
            "member": self._member,
            "sent": {
                source.key: [source.messages, source.bytes, source.dropped, source.unsent]
                for source in self._sources()
            },
            "received": {
                f"{sender} {sink.entry.name}": [each.messages, each.bytes, each.lost, each.malformed]
                for sink in self._sinks()
                for sender, each in list(sink.received.items())
            },
            "calls": self._calls.calls,
            "refused": self._calls.refused,
            "members": sorted(self._present()),
        }

    def answer(self, question: ZenohQuestion) -> None:
        question.answer(json.dumps(self.counters()).encode())
        question.close()

    def advertise(self, node: Node) -> None:
        """Advertise `/diagnostics`. Blocks until the master answers."""
        self._diagnostics = LinkDiagnostics(node, "pipros fleet")

    def publish(self, *, is_connected: bool) -> None:
        """Publish the state of the links on `/diagnostics`, at most once per DIAGNOSTICS_S."""
        now_s = time.monotonic()
        if self._diagnostics is None or now_s < self._published_s + DIAGNOSTICS_S:
            return
        self._published_s = now_s
        counters = self.counters()
        received = {name: LinkTraffic() for name in counters["members"] if name != self._member}
        for name, (messages, _, lost, malformed) in counters["received"].items():
            sender = name.partition(" ")[0]
            if sender in received:
                before = received[sender]
                received[sender] = LinkTraffic(
                    before.topics + 1,
                    before.messages + messages,
                    before.lost + lost,
                    before.malformed + malformed,
                )
        if self._diagnostics.is_wanted:
            self._diagnostics.publish(
                link_statuses(
                    self._member,
                    is_connected=is_connected,
                    sent=counters["sent"].values(),
                    received=received,
                    before=self._received_before,
                )
            )
        self._received_before = received

    def _sources(self) -> Iterator[SentTopic]:
        yield from list(self._offers.shared.values())
        for shown in list(self._shown.members.values()):
            yield from list(shown.inputs.values())

    def _sinks(self) -> Iterator[Sink]:
        yield from list(self._offers.accepted.values())
        for shown in list(self._shown.members.values()):
            yield from list(shown.sinks.values())
