"""A member's counters, for other members and for `/diagnostics`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros.node import Node
from pipros_fleet.calls import LocalCalls
from pipros_fleet.offers import Offers
from pipros_fleet.shown_members import ShownMembers
from pipros_fleet.sinks import Sink
from pipros_fleet.sources import SentTopic
from pipros_fleet.zenoh_session import ZenohQuestion
from pipros_libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus

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


@dataclass(frozen=True, slots=True)
class LinkTraffic:
    """Counters of one member's traffic from another, summed over all topics."""

    topics: int = 0
    messages: int = 0
    lost: int = 0
    malformed: int = 0


def link_statuses(
    member: str,
    *,
    is_connected: bool,
    sent: Iterable[tuple[int, int, int, int]],
    received: Mapping[str, LinkTraffic],
    before: Mapping[str, LinkTraffic],
) -> list[LinkStatus]:
    """Return a status for a member's link, and one for each other member.

    Args:
        sent: the number of messages sent, bytes sent, messages dropped and messages not sent, for each topic.
        received: counters of the messages received from each member that is present.
        before: `received` at the previous call. Lost and malformed messages since then cause a warning.
    """
    totals = [sum(column) for column in zip(*sent, strict=True)] or [0, 0, 0, 0]
    found = [
        LinkStatus(
            f"/Fleet/{member}",
            LinkLevel.OK if is_connected else LinkLevel.ERROR,
            "connected" if is_connected else "no router is connected",
            dict(zip(("sent", "bytes sent", "dropped", "unsent"), map(str, totals), strict=True)),
        )
    ]
    for other, now in sorted(received.items()):
        first = before.get(other, LinkTraffic())
        lost, malformed = now.lost - first.lost, now.malformed - first.malformed
        problems = [
            f"{count} {what}" for count, what in ((lost, "lost"), (malformed, "malformed")) if count > 0
        ]
        values = {
            "topics received": now.topics,
            "messages": now.messages,
            "lost": now.lost,
            "malformed": now.malformed,
        }
        found.append(
            LinkStatus(
                f"/Fleet/{member}/{other}",
                LinkLevel.WARN if problems else LinkLevel.OK,
                f"{' and '.join(problems)} recently" if problems else "present",
                {name: str(value) for name, value in values.items()},
            )
        )
    return found
