"""Selection of the messages to send over a link, and of those to drop."""

import logging

import pytest

from pipros_fleet.events import Events
from pipros_fleet.fleet_rules import FleetRule, Priority
from pipros_fleet.outbox import QUEUE, FleetOutbox
from pipros_fleet.warnings_once import WarningsOnce


def outbox(limit_bytes: int = 1000, bandwidth_kbit: float = 0.0, **rules: FleetRule) -> FleetOutbox[str]:
    box: FleetOutbox[str] = FleetOutbox(limit_bytes, bandwidth_kbit)
    for name, rule in rules.items():
        box.add_topic(name, rule)
    return box


def drained(box: FleetOutbox[str], now_s: float = 0.0) -> list[str]:
    found = []
    while (item := box.pop(now_s)) is not None:
        found.append(item[1])
    return found


def test_messages_keep_their_order() -> None:
    box = outbox(a=FleetRule("/a"))
    for text in "123":
        box.push("a", text, 1)
    assert not box.is_idle("a")
    assert drained(box) == ["1", "2", "3"]
    assert box.is_idle("a")
    assert box.bytes == 0


def test_only_topics_without_limits_may_make_a_publisher_wait() -> None:
    box = outbox(
        plain=FleetRule("/p"), rate=FleetRule("/r", rate_hz=2), latest=FleetRule("/l", is_latest_only=True)
    )
    assert [name for name in ("plain", "rate", "latest", "unknown") if box.is_unlimited(name)] == ["plain"]
    assert not outbox(bandwidth_kbit=1, plain=FleetRule("/p")).is_unlimited("plain")


def test_higher_priorities_are_first() -> None:
    box = outbox(
        low=FleetRule("/l", priority=Priority.LOW),
        high=FleetRule("/h", priority=Priority.HIGH),
        normal=FleetRule("/n"),
    )
    for name in ("low", "normal", "high"):
        box.push(name, name, 1)
    assert drained(box) == ["high", "normal", "low"]


def test_topics_of_one_priority_take_turns() -> None:
    box = outbox(a=FleetRule("/a"), b=FleetRule("/b"))
    for number in range(2):
        box.push("a", f"a{number}", 1)
        box.push("b", f"b{number}", 1)
    first = [box.pop(time_s) for time_s in (1.0, 2.0, 3.0, 4.0)]
    assert first == [("a", "a0"), ("b", "b0"), ("a", "a1"), ("b", "b1")]


def test_a_rate_keeps_the_newest_message() -> None:
    box = outbox(a=FleetRule("/a", rate_hz=2))
    box.push("a", "1", 1)
    assert box.pop(10.0) == ("a", "1")
    box.push("a", "2", 1)
    box.push("a", "3", 1)
    assert box.pop(10.4) is None
    assert box.wait_s(10.4) == 10.5 - 10.4
    assert (box.pop(10.5), box.dropped) == (("a", "3"), {"a": 1})
    assert not box.is_idle("a")


def test_latest_only_replaces_the_queued_message() -> None:
    box = outbox(a=FleetRule("/a", is_latest_only=True))
    for text in "123":
        box.push("a", text, 1)
    assert (drained(box), box.dropped) == (["3"], {"a": 2})


def test_a_queue_drops_its_oldest() -> None:
    box = outbox(limit_bytes=10_000, a=FleetRule("/a"))
    for number in range(QUEUE + 5):
        box.push("a", str(number), 1)
    assert (drained(box)[0], box.dropped) == ("5", {"a": 5})


def test_beyond_the_bytes_the_lowest_priority_is_dropped() -> None:
    box = outbox(
        100, low=FleetRule("/l", priority=Priority.LOW), high=FleetRule("/h", priority=Priority.HIGH)
    )
    box.push("low", "image", 60)
    box.push("high", "stop", 60)
    assert (drained(box), box.dropped) == (["stop"], {"low": 1})
    box.push("high", "too large", 101)
    assert (drained(box), box.dropped["high"]) == ([], 1)


def test_a_bandwidth_spaces_messages() -> None:
    box = outbox(10_000, 8, a=FleetRule("/a"), stop=FleetRule("/s", priority=Priority.HIGH))  # 1000 bytes/s
    for text in "12":
        box.push("a", text, 600)
    assert box.pop(100.0) == ("a", "1")
    assert box.pop(100.0) is None
    assert (box.wait_s(100.0), box.pop(100.5)) == (0.5, ("a", "2"))
    box.push("a", "3", 600)
    box.push("stop", "stop", 100)
    assert box.wait_s(100.5) == 0.0
    assert box.pop(100.5) == ("stop", "stop"), "a high priority does not wait for the bandwidth"
    assert box.pop(100.6) is None


def test_messages_of_unknown_topics_are_dropped() -> None:
    box = outbox(a=FleetRule("/a"))
    box.push("b", "1", 1)
    box.push("a", "2", 1)
    box.remove_topic("a")
    box.remove_topic("a")
    assert (drained(box), box.bytes, box.dropped) == ([], 0, {"b": 1})
    assert box.wait_s(0.0) is None
    assert not box.is_idle("a")


# The event queue of an agent, and warnings that are logged once.


def handled(events: Events) -> list[str]:
    """Handle all pending events."""
    found: list[str] = []
    while (event := events.next(0)) is not None:
        found.append(str(event()))
    return found


def test_a_newer_event_replaces_one_of_the_same_kind_and_name() -> None:
    events = Events(10)
    for kind, name, text in (("token", "a", "1"), ("token", "b", "2"), ("token", "a", "3")):
        events.post(kind, name, lambda text=text: text)  # type: ignore[misc]
    assert handled(events) == ["2", "3"]


def test_events_beyond_the_limit_are_dropped() -> None:
    events = Events(2)
    for number in range(5):
        events.post("token", str(number), lambda number=number: number)  # type: ignore[misc]
    assert handled(events) == ["0", "1"]


def test_a_closed_queue_has_no_events() -> None:
    events = Events(10)
    events.wake()
    events.close()
    assert events.next(None) is None
    assert events.is_closed


def test_each_warning_is_logged_once_and_a_member_leaves_room_for_others(
    caplog: pytest.LogCaptureFixture,
) -> None:
    warn = WarningsOnce(logging.getLogger("fleet test"), limit=4)
    for text, member in (("a", "x"), ("a", "x"), ("b", "x"), ("c", "x"), ("d", "y")):
        warn(text, member)
    assert caplog.messages == ["a", "b", "d"]
