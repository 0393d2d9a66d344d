"""The connections of a graph, from tables of responses."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.basics.errors import Unreachable
from pipros_tools.graph.live import GraphLink, LiveGraph, links_of, vertex_of_topic
from tests.support.table_master import Answers, TableMaster

API = {"/talker": "http://h:1/", "/listener": "http://h:2/"}
ANSWERS: Answers = {
    ("getSystemState",): [
        [["/chatter", ["/talker"]]],
        [["/chatter", ["/listener"]]],
        [["/add", ["/talker"]]],
    ],
    **{("lookupNode", node): api for node, api in API.items()},
}
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
