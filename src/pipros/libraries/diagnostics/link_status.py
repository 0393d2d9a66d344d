"""The state of a member's links as diagnostics, for the page and rqt_robot_monitor."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node


class LinkLevel(IntEnum):
    """The levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class LinkStatus:
    """Status of one component: this member's link, or its traffic from another member."""

    name: str
    level: LinkLevel
    message: str
    values: Mapping[str, str]


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
        received: what this member has received from each member that is present.
        before: `received` at the previous call. Losses since then cause a warning.
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


class LinkDiagnostics:
    """Publishes link statuses on `/diagnostics`."""

    def __init__(self, node: Node, hardware: str) -> None:
        """Advertise the topic. Blocks until the master answers."""
        self._hardware = hardware
        self._array: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
        self._status: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")
        self._value: Any = load_message_class("diagnostic_msgs/KeyValue")
        self._publisher = node.advertise("/diagnostics", self._array, queue_size=10)

    @property
    def is_wanted(self) -> bool:
        """Whether the topic has subscribers."""
        return self._publisher.connection_count > 0

    def publish(self, statuses: Iterable[LinkStatus]) -> None:
        message = self._array()
        message.header.stamp = Time.from_sec(time.time())
        for status in statuses:
            values = [self._value(key, value) for key, value in status.values.items()]
            message.status.append(
                self._status(int(status.level), status.name, status.message, self._hardware, values)
            )
        self._publisher.publish(message)
