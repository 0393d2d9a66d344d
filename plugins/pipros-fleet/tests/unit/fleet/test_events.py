"""The event queue of an agent, and warnings that are logged once."""

from __future__ import annotations

import logging

import pytest

from pipros_fleet.events import Events
from pipros_fleet.warnings_once import WarningsOnce


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


def test_each_warning_is_logged_once_and_their_number_is_limited(caplog: pytest.LogCaptureFixture) -> None:
    warn = WarningsOnce(logging.getLogger("fleet test"), limit=2)
    for text in ("a", "a", "b", "c"):
        warn(text)
    assert caplog.messages == ["a", "b"]
