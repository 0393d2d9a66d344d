"""Diagnostic statuses of a member's link, and of the messages received from other members."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pipros.libraries.diagnostics.link_status import LinkLevel, LinkStatus


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
