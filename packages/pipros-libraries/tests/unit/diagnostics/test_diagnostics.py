"""The counts and reports of diagnostic tasks."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

import diagnostic_updater as du
from pipros.msg.time import Time
from pipros_libraries.diagnostics.frequency import EventWindow, judged
from pipros_libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus
from pipros_libraries.diagnostics.stamps import StampDelays
from pipros_libraries.diagnostics.summaries import merged


def test_a_window_covers_the_last_reports() -> None:
    window = EventWindow(reports=2, now=100.0)
    window.count += 4

    assert window.report(102.0) == (4, 2.0, 2.0)
    window.count += 1
    assert window.report(103.0) == (5, 3.0, pytest.approx(5 / 3))
    assert window.report(105.0) == (1, 3.0, pytest.approx(1 / 3))
    assert window.report(105.0) == (0, 2.0, 0.0)


def test_a_window_without_length_has_no_frequency() -> None:
    window = EventWindow(reports=1, now=5.0)
    assert window.report(5.0) == (0, 0.0, 0.0)
    window.count += 1
    assert window.report(5.0)[2] == math.inf


@pytest.mark.parametrize(
    ("events", "hz", "level"), [(0, 0.0, 2), (3, 4.0, 1), (3, 11.0, 1), (3, 5.0, 0), (3, 10.0, 0)]
)
def test_a_frequency_is_judged_by_its_bounds(events: int, hz: float, level: int) -> None:
    assert judged(events, hz, 5.0, 10.0)[0] == level


def test_timestamps_are_rated_by_the_worst_one() -> None:
    delays = StampDelays()
    assert delays.judged(-1, 5) == (1, "No data since last update.")
    delays.add(100.0, 101.0)
    assert delays.judged(-1, 5) == (0, "Timestamps are reasonable.")
    delays.add(90.0, 101.0)
    delays.add(0, 101.0)

    assert delays.judged(-1, 5) == (2, "Zero timestamp seen.")
    assert (delays.late_count, delays.early_count, delays.zero_count) == (1, 0, 1)


def test_equal_levels_are_joined_and_worse_ones_replace_the_summary() -> None:
    assert merged(0, "fine", 0, "well") == (0, "fine; well")
    assert (merged(0, "fine", 2, "broken"), merged(2, "broken", 0, "fine")) == ((2, "broken"), (2, "broken"))
    assert merged(1, "warm", 2, "hot") == (2, "warm; hot")


def test_several_tasks_report_as_one() -> None:
    both = du.CompositeDiagnosticTask("both")
    both.addTask(du.Heartbeat())

    def warn(stat: du.DiagnosticStatusWrapper) -> du.DiagnosticStatusWrapper:
        stat.summary(du.WARN, "warm")
        stat.add("degrees", 51.5)
        return stat

    both.addTask(du.FunctionDiagnosticTask("temperature", warn))
    status = both.run(du.DiagnosticStatusWrapper())

    assert (status.level, status.message) == (du.WARN, "warm")
    assert [(value.key, value.value) for value in status.values] == [("degrees", "51.5")]


def test_tasks_are_removed_by_name() -> None:
    tasks = du.DiagnosticTaskVector()
    tasks.add(du.Heartbeat())
    tasks.add("other", lambda stat: stat)

    assert tasks.removeByName("Heartbeat")
    assert not tasks.removeByName("Heartbeat")
    assert [task.name for task in tasks.tasks] == ["other"]


# Statuses of links on `/diagnostics`.


class Topic:
    """A node with one topic, and the messages on it."""

    def __init__(self) -> None:
        self.name = ""
        self.connection_count = 0
        self.messages: list[Any] = []
        self.clock = SimpleNamespace(now_ns=lambda: 5_000_000_007)

    def advertise(self, name: str, _kind: Any, queue_size: int) -> Any:
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
