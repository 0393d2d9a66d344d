"""What a gateway counts of a topic, service or action."""

from __future__ import annotations

import pytest

from pipros_ros2.counts import Counts


def test_each_reason_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    counts = Counts()

    for reason in ("too long", "too long", "not UTF-8"):
        counts.fail(reason)

    assert (counts.dropped, counts.reason) == (3, "not UTF-8")
    assert caplog.messages == ["too long", "not UTF-8"]


def test_drops_of_queues_add_up_when_queues_are_replaced(caplog: pytest.LogCaptureFixture) -> None:
    counts = Counts()

    for queue, total in (("a", 0), ("a", 3), ("b", 2), ("a", 3), ("a", 1), ("a", 4), ("b", 2)):
        counts.overflow(queue, total, "too slow")

    assert (counts.overflowed, counts.dropped, counts.reason) == (9, 9, "too slow")
    assert caplog.messages == ["too slow"]
