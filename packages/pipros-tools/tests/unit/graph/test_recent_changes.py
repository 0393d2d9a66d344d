"""Nodes and topics that were added or removed."""

from __future__ import annotations

from dataclasses import replace

from pipros_tools.graph.observer import GraphObservation
from pipros_tools.graph.recent_changes import EVENTS_S, LONGEST_GAP_S, MAX_REMOVED, SHOWN_S, RecentChanges
from pipros_tools.graph.system_state import SystemState, TopicConnection

LEVEL = TopicConnection("/talker", "/level", "/listener")
ALL = GraphObservation(
    SystemState({"/level": ["/talker"]}, {"/level": ["/listener"]}, {}), connections={LEVEL: None}
)
WITHOUT_TALKER = GraphObservation(SystemState({}, {"/level": ["/listener"]}, {}))
NOTHING = GraphObservation()


def test_a_removed_node_keeps_its_connections_for_two_minutes() -> None:
    changes = RecentChanges()
    changes.add(ALL, 100.0)
    changes.add(WITHOUT_TALKER, 101.0)
    assert changes.removed() == {("node", "/talker"): 101.0}
    found = changes.with_removed(WITHOUT_TALKER)
    assert (found.state, found.connections) == (ALL.state, {LEVEL: None})
    for second in range(int(SHOWN_S)):
        changes.add(WITHOUT_TALKER, 102.0 + second)
    assert changes.removed() == {}
    assert changes.with_removed(WITHOUT_TALKER) is WITHOUT_TALKER


def test_connections_that_ended_shortly_before_the_removal_are_kept() -> None:
    changes = RecentChanges()
    for second, observation in enumerate((ALL, replace(ALL, connections={}), WITHOUT_TALKER)):
        changes.add(observation, second)
    assert changes.with_removed(WITHOUT_TALKER).connections == {LEVEL: None}


def test_everything_can_be_removed_at_once_or_one_after_the_other() -> None:
    for steps in ([ALL, NOTHING], [ALL, WITHOUT_TALKER, NOTHING]):
        changes = RecentChanges()
        for second, observation in enumerate(steps):
            changes.add(observation, second)
        assert changes.with_removed(NOTHING).state == ALL.state
        assert set(changes.removed()) == {("node", "/talker"), ("node", "/listener"), ("topic", "/level")}


def test_a_node_that_returns_is_no_longer_removed() -> None:
    changes = RecentChanges()
    for second, observation in enumerate((ALL, WITHOUT_TALKER, ALL)):
        changes.add(observation, second)
    assert changes.with_removed(ALL) is ALL
    assert [(event.is_added, event.part) for event in changes.events(2.0)] == [
        (True, ("node", "/talker")),
        (False, ("node", "/talker")),
    ]
    assert changes.events(2.0 + EVENTS_S) == []


def test_an_error_or_a_pause_removes_nothing() -> None:
    changes = RecentChanges()
    changes.add(ALL, 0.0)
    changes.add(GraphObservation(error="no master"), 1.0)
    changes.add(NOTHING, LONGEST_GAP_S + 0.1)
    assert (changes.removed(), changes.events(20.0)) == ({}, [])


def test_the_end_of_a_very_large_system_is_forgotten() -> None:
    changes = RecentChanges()
    topics = {f"/topic{number}": ["/node"] for number in range(MAX_REMOVED)}
    changes.add(GraphObservation(SystemState(topics, {}, {})), 0.0)
    changes.add(NOTHING, 1.0)
    assert changes.removed() == {}
