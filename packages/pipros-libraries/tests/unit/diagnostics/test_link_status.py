"""Statuses of links on `/diagnostics`."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from pipros.msg.time import Time
from pipros_libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus


class Topic:
    """A node with one topic, and the messages on it."""

    def __init__(self) -> None:
        self.name = ""
        self.connection_count = 0
        self.messages: list[Any] = []
        self.clock = SimpleNamespace(now_ns=lambda: 5_000_000_007)

    def advertise(self, name: str, _kind: Any, queue_size: int) -> Topic:
        self.name = name
        return self

    def publish(self, message: Any) -> None:
        self.messages.append(message)


def test_statuses_are_published_as_diagnostics() -> None:
    topic: Any = Topic()
    diagnostics = LinkDiagnostics(topic, "this machine")
    assert (topic.name, diagnostics.is_wanted) == ("/diagnostics", False)
    topic.connection_count = 1
    assert diagnostics.is_wanted

    up = LinkStatus("/other", LinkLevel.OK, "connected", {})
    diagnostics.publish([LinkStatus("/link", LinkLevel.WARN, "slow", {"sent": "5"}), up])
    (array,) = topic.messages
    assert array.header.stamp == Time(5, 7), "the time of the node, which may be simulated"
    first, second = array.status
    assert (first.name, first.level, first.message) == ("/link", LinkLevel.WARN, "slow")
    assert first.hardware_id == "this machine"
    assert [(each.key, each.value) for each in first.values] == [("sent", "5")]
    assert second.name == "/other"
    assert array.header.stamp.to_sec() > 0
