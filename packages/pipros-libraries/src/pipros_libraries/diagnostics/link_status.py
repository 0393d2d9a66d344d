"""The state of links to other systems as diagnostics, for the web page and rqt_robot_monitor."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node


class LinkLevel(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus, without STALE."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class LinkStatus:
    """Status of a link, or of one peer's traffic over a link."""

    name: str
    level: LinkLevel
    message: str
    values: Mapping[str, str]


class LinkDiagnostics:
    """Publishes link statuses on `/diagnostics`."""

    def __init__(self, node: Node, hardware: str) -> None:
        """Advertise the topic. Blocks until the master answers."""
        self._node, self.hardware = node, hardware
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
        message.header.stamp = Time(*divmod(self._node.clock.now_ns(), NS_PER_S))
        for status in statuses:
            values = [self._value(key, value) for key, value in status.values.items()]
            message.status.append(
                self._status(int(status.level), status.name, status.message, self.hardware, values)
            )
        self._publisher.publish(message)
