"""The connections of a graph, from tables of responses."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.basics.errors import Unreachable
from pipros.graph.live import BadNode, LiveGraph, node_topic, topic_node
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

    assert graph.nn_nodes == {"/talker", "/listener"}
    assert (graph.nt_nodes, graph.srvs) == ({topic_node("/chatter")}, {"/add"})
    assert [(str(edge), edge.label) for edge in graph.nn_edges] == [("/talker->/listener", "/chatter")]
    assert {str(edge) for edge in graph.nt_edges} == {"/talker-> /chatter", " /chatter->/listener"}
    assert graph.bad_nodes == {}


def test_nodes_are_not_polled_again_before_responses_are_stale() -> None:
    clock = Clock()
    graph = graph_of(dict(ROWS), now_s=clock)
    assert graph.update()

    clock.now_s += graph.node_stale
    assert not graph.update()
    assert graph.last_node_refresh["/talker"] == 1000.0
    clock.now_s += 1
    graph.update()

    assert graph.last_node_refresh["/talker"] == clock.now_s


@pytest.mark.parametrize(
    "answer",
    [
        "nonsense",
        [0, "no", []],
        [1, "", 5],
        [1, "", [[1, "/listener", "o"]]],
        [1, "", [[1, "/listener", "o", "TCPROS", 5]]],
        [1, "", [[1, ["/listener"], "o", "TCPROS", "/chatter"]]],
    ],
)
def test_a_node_with_a_malformed_response_is_bad_and_the_others_are_still_called(answer: Any) -> None:
    graph = graph_of({**ROWS, API["/listener"]: answer})

    assert graph.update()

    assert {name: bad.type for name, bad in graph.bad_nodes.items()} == {"/listener": BadNode.WONKY}
    assert [str(edge) for edge in graph.nn_edges] == ["/talker->/listener"]


def test_a_node_that_cannot_be_reached_is_dead_until_it_answers() -> None:
    rows = {API["/talker"]: ROWS[API["/talker"]]}
    graph = graph_of(rows)
    graph.update()
    assert {name: bad.type for name, bad in graph.bad_nodes.items()} == {"/listener": BadNode.DEAD}

    rows[API["/listener"]] = [1, "", []]
    graph.bad_update()

    assert graph.bad_nodes == {}


def test_only_names_in_the_namespaces_are_kept() -> None:
    assert graph_of(ROWS, node_ns="/t").update()
    elsewhere = graph_of(ROWS, topic_ns="/other")
    elsewhere.update()

    assert (elsewhere.nt_nodes, list(elsewhere.nn_edges)) == (set(), [])


def test_without_a_master_nothing_changes() -> None:
    graph = LiveGraph(TableMaster({}))

    assert not graph.update()


def test_a_topic_name_survives_conversion_to_a_node_name() -> None:
    assert node_topic(topic_node("/chatter")) == "/chatter"
