"""The connections of a graph, from tables of responses."""

from dataclasses import replace
from typing import Any

import pytest

from pipros.basics.errors import Unreachable
from pipros_tools.graph.live import GraphLink, LiveGraph, links_of, vertex_of_topic
from pipros_tools.graph.observer import GraphObservation
from pipros_tools.graph.recent_changes import EVENTS_S, LONGEST_GAP_S, MAX_REMOVED, SHOWN_S, RecentChanges
from pipros_tools.graph.system_state import SystemState, TopicConnection
from tests.support.table_master import Answers, TableMaster

API = {"/talker": "http://h:1/", "/listener": "http://h:2/"}
ANSWERS: Answers = {
    ("getSystemState", ): [[["/chatter", ["/talker"]]], [["/chatter", ["/listener"]]],
        [["/add", ["/talker"]]]],
    **{("lookupNode", node): api for node, api in API.items()}
}  # fmt: skip
ROWS: dict[str, Any] = {
    API["/talker"]: [1, "", [[1, "/listener", "o", "TCPROS", "/chatter", True]]],
    API["/listener"]: [1, "", [[1, API["/talker"], "i", "TCPROS", "/chatter", True]]],
}


class Clock:
    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def graph_of(rows: dict[str, Any], **more: Any) -> LiveGraph:
    def ask(api: str) -> Any:
        if api not in rows:
            raise Unreachable(api, "Connection refused")
        return rows[api]

    return LiveGraph(TableMaster(ANSWERS), ask=ask, **more)


def test_connections_are_found_from_both_ends() -> None:
    graph = graph_of(ROWS)

    assert graph.update()

    assert graph.nodes == {"/talker", "/listener"}
    assert (graph.topics, graph.services) == ({vertex_of_topic("/chatter")}, {"/add"})
    assert graph.links == {GraphLink("/talker", "/listener", "/chatter")}
    assert graph.topic_links == {GraphLink("/talker", " /chatter"), GraphLink(" /chatter", "/listener")}
    assert (graph.topic_links, graph.silent) == (graph.registered_links, {})


def test_nodes_are_not_polled_again_before_responses_are_stale() -> None:
    clock = Clock()
    graph = graph_of(dict(ROWS), now_s=clock)
    assert graph.update()

    clock.now_s += graph.max_age_of_report_s
    assert not graph.update()
    assert graph.asked_at["/talker"] == 1000.0
    clock.now_s += 1
    graph.update()

    assert graph.asked_at["/talker"] == clock.now_s


@pytest.mark.parametrize("answer", [
    "nonsense", [0, "no", []], [1, "", 5], [1, "", [[1, "/listener", "o"]]],
    [1, "", [[1, "/listener", "o", "TCPROS", 5]]],
    [1, "", [[1, ["/listener"], "o", "TCPROS", "/chatter"]]],
])  # fmt: skip
def test_a_node_with_a_malformed_response_is_silent_and_the_others_are_still_called(answer: Any) -> None:
    graph = graph_of({**ROWS, API["/listener"]: answer})

    assert graph.update()

    assert {name: report.is_reachable for name, report in graph.silent.items()} == {"/listener": True}
    assert graph.links == {GraphLink("/talker", "/listener", "/chatter")}


def test_a_node_that_cannot_be_reached_is_dead_until_it_answers() -> None:
    rows = {API["/talker"]: ROWS[API["/talker"]]}
    graph = graph_of(rows)
    graph.update()
    assert {name: report.is_reachable for name, report in graph.silent.items()} == {"/listener": False}

    rows[API["/listener"]] = [1, "", []]
    graph.query_silent_nodes()

    assert graph.silent == {}


def test_only_names_in_the_namespaces_are_kept() -> None:
    assert graph_of(ROWS, node_namespace="/t").update()
    elsewhere = graph_of(ROWS, topic_namespace="/other")
    elsewhere.update()

    assert (elsewhere.topics, elsewhere.links) == (set(), set())


def test_without_a_master_nothing_changes() -> None:
    graph = LiveGraph(TableMaster({}))

    assert not graph.update()


def test_a_node_that_unregistered_takes_its_links_along() -> None:
    master, clock = TableMaster(ANSWERS), Clock()
    graph = LiveGraph(master, ask=lambda api: ROWS[api], now_s=clock)
    assert graph.update()

    clock.now_s += 6
    master.answers["getSystemState",] = [[], [["/chatter", ["/listener"]]], []]
    assert graph.update()

    assert graph.nodes == {"/listener"}
    assert graph.registered_links == {GraphLink(" /chatter", "/listener")}


def test_links_follow_the_direction_of_a_connection() -> None:
    assert links_of("/a", "/b", "o", "/t") == {GraphLink("/a", "/b", "/t")}
    assert links_of("/a", "/b", "i") == {GraphLink("/b", "/a")}
    assert links_of("/a", "/b", "b") == {GraphLink("/a", "/b"), GraphLink("/b", "/a")}


# Nodes and topics that were added or removed.


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
