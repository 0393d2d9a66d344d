"""The contents of a drawing of a running system: modes, filters, hidden elements."""

from dataclasses import replace

import pytest

from pipros_tools.graph.drawing.grouping import MAX_BOXES, Grouping, grouped, marked
from pipros_tools.graph.drawing.name_filter import NameFilter
from pipros_tools.graph.drawing.node_graph import (
    MAX_GUESSED,
    Arrow,
    GraphOptions,
    Key,
    NodeGraph,
    Vertex,
    node_graph,
)
from pipros_tools.graph.system_state import SystemState, TopicConnection

STATE = SystemState(
    publishers={
        "/battery_topic": ["/talker"], "/rosout": ["/talker", "/listener"], "/tf": ["/robot/base"],
        "/robot/scan": ["/robot/laser"], "/robot/laser/parameter_updates": ["/robot/laser"],
    },
    subscribers={
        "/battery_topic": ["/listener"],
        "/rosout": ["/rosout"],
        "/tf": ["/listener"],
        "/robot/cmd": ["/robot/base"],
    },
    services={"/robot/reset": ["/robot/base"]},
)  # fmt: skip
CONNECTIONS = [
    TopicConnection("/talker", "/battery_topic", "/listener"),
    TopicConnection("/robot/base", "/tf", "/listener"),
    TopicConnection("/talker", "/rosout", "/rosout"),
]
TALKER, LISTENER = Key("node", "/talker_node"), Key("node", "/listener_node")
TOPIC = Key("topic", "/battery_topic")
SHOW_ALL = GraphOptions("all", hide_dead_sinks=False, hide_leaf_topics=False, hide_debug=False)


def names(graph: NodeGraph, kind: str) -> set[str]:
    return {vertex.name for vertex in graph.vertices.values() if vertex.kind == kind}


def arrows(graph: NodeGraph) -> set[tuple[str, str]]:
    return {(arrow.start.name, arrow.end.name) for arrow in graph.arrows}


def test_the_case_study_is_a_chain() -> None:
    state = SystemState({"/battery_topic": ["/talker_node"]}, {"/battery_topic": ["/listener_node"]}, {})
    graph = node_graph(state, [TopicConnection("/talker_node", "/battery_topic", "/listener_node")])
    assert list(graph.vertices) == [LISTENER, TALKER, TOPIC]
    assert [(arrow.start, arrow.end) for arrow in graph.arrows] == [(TALKER, TOPIC), (TOPIC, LISTENER)]


def test_active_topics_have_a_connection() -> None:
    assert names(node_graph(STATE, CONNECTIONS), "topic") == {"/battery_topic", "/tf"}


def test_nodes_are_connected_by_topics() -> None:
    graph = node_graph(STATE, CONNECTIONS, options=GraphOptions("nodes"))
    assert names(graph, "topic") == set()
    assert arrows(graph) == {("/talker", "/listener"), ("/robot/base", "/listener")}
    assert {arrow.topic for arrow in graph.arrows} == {"/battery_topic", "/tf"}


def test_the_graph_has_all_registrations() -> None:
    graph = node_graph(STATE, [], options=SHOW_ALL)
    assert names(graph, "topic") == set(STATE.topics())
    assert names(graph, "node") == set(STATE.nodes())
    expected = {(node, topic) for topic, nodes in STATE.publishers.items() for node in nodes}
    expected |= {(topic, node) for topic, nodes in STATE.subscribers.items() for node in nodes}
    assert arrows(graph) == expected


@pytest.mark.parametrize(("hidden", "gone"), [
    ({"hide_dead_sinks": True}, {"/robot/scan", "/robot/laser/parameter_updates"}),
    ({"hide_leaf_topics": True}, {"/robot/scan", "/robot/laser/parameter_updates", "/robot/cmd"}),
    ({"hide_debug": True}, {"/rosout"}), ({"hide_tf": True}, {"/tf"}),
    ({"hide_parameters": True}, {"/robot/laser/parameter_updates"}),
])  # fmt: skip
def test_topics_are_hidden(hidden: dict[str, bool], gone: set[str]) -> None:
    shown = names(node_graph(STATE, [], options=replace(SHOW_ALL, **hidden)), "topic")
    assert set(STATE.topics()) - shown == gone


def test_an_unreachable_node_keeps_what_it_registered() -> None:
    graph = node_graph(STATE, [], ["/talker", "/listener"])
    assert names(graph, "topic") == {"/battery_topic"}
    assert not graph.vertices[Key("node", "/talker")].is_reachable
    assert graph.vertices[Key("node", "/robot/base")].is_reachable


def test_connections_between_many_unreachable_nodes_are_limited() -> None:
    first, last = ([f"/{kind}{number}" for number in range(500)] for kind in "ps")
    state = SystemState({"/t": first}, {"/t": last}, {})
    graph = node_graph(state, (), [*first, *last], GraphOptions(mode="nodes"))
    assert len(graph.arrows) == MAX_GUESSED


def test_unreachable_nodes_can_be_hidden() -> None:
    graph = node_graph(STATE, CONNECTIONS, ["/talker"], GraphOptions(hide_unreachable=True))
    assert "/talker" not in names(graph, "node")


def test_nodes_of_tools_are_hidden_with_debug() -> None:
    state = SystemState({"/a": ["/rqt_graph_9153_1795195219662", "/rqt_like_node"]}, {}, {})
    assert names(node_graph(state, []), "node") == {"/rqt_like_node"}


def test_namespaces_of_several_nodes_are_groups() -> None:
    graph = node_graph(STATE, [], options=SHOW_ALL)
    assert {vertex.name for vertex in graph.vertices.values() if vertex.group == "/robot"} == {
        "/robot/base", "/robot/laser", "/robot/scan", "/robot/cmd", "/robot/laser/parameter_updates",
    }  # fmt: skip


@pytest.mark.parametrize(("patterns", "kept"), [
    ("", "/a /a/b /ab /c"), ("/", "/a /a/b /ab /c"), ("/a", "/a /a/b"), ("a", "/a /a/b"), ("-a, c", "/c"),
    ("/a*", "/a /a/b /ab"), ("/a.*", "/a /a/b /ab"), ("*b", "/a/b /ab"), ("-/a", "/ab /c"),
    ("-, /c", "/c"), ("-", "/a /a/b /ab /c"), ("/a*, -*/b", "/a /ab"), ("/a*b*b", ""),
    ("/c,/ab", "/ab /c"),
])  # fmt: skip
def test_patterns(patterns: str, kept: str) -> None:
    keeps = NameFilter(patterns)
    assert [name for name in ("/a", "/a/b", "/ab", "/c") if keeps(name)] == kept.split()


def test_patterns_with_many_stars_match_in_linear_time() -> None:
    assert not NameFilter("*a" * 400 + "b")("/" + "a" * 5000)


# Boxes for several topics, and collapsed namespaces.


SERVER = Key("node", "/server")
ACTION = [f"/pick/{part}" for part in ("goal", "cancel", "status", "feedback", "result")]


def graph_of(*topics: str) -> NodeGraph:
    """Return a graph of `/server`, which publishes the topics."""
    keys = [SERVER, *(Key("topic", topic) for topic in topics)]
    arrows = (Arrow(SERVER, Key("topic", topic), topic) for topic in topics)
    return NodeGraph({key: Vertex(key) for key in keys}, tuple(arrows))


@pytest.mark.parametrize(("topics", "grouping", "group"), [
    (ACTION, Grouping(actions=True), "/pick (action)"),
    (["/eye", "/eye/compressed"], Grouping(images=True), "/eye (image)"),
    (["/tf", "/tf_static"], Grouping(tf=True), "tf"),
])  # fmt: skip
def test_topics_become_one_box_with_one_arrow(topics: list[str], grouping: Grouping, group: str) -> None:
    graph = graph_of(*topics, "/level")
    assert grouped(graph, [*topics, "/level"], Grouping()) is graph
    found = grouped(graph, [*topics, "/level"], grouping)
    key = Key("group", group)
    assert {*found.vertices} == {SERVER, key, Key("topic", "/level")}
    assert found.vertices[key].members == tuple(topics)
    assert [(arrow.start, arrow.end) for arrow in found.arrows] == [
        (SERVER, Key("topic", "/level")),
        (SERVER, key),
    ]


def test_a_goal_without_the_other_topics_of_an_action_is_a_topic() -> None:
    graph = graph_of("/pick/goal", "/pick/cancel")
    assert grouped(graph, ["/pick/goal", "/pick/cancel"], Grouping(actions=True)) is graph


def test_namespaces_of_a_large_graph_are_collapsed_until_opened() -> None:
    graph = graph_of(*(f"/robot{number % 2}/arm/j{number}" for number in range(MAX_BOXES)))
    found = grouped(graph, (), Grouping())
    assert {*found.vertices} == {SERVER, Key("namespace", "/robot0"), Key("namespace", "/robot1")}
    assert len(found.arrows) == 2
    found = grouped(graph, (), Grouping(opened="/robot0"))
    assert Key("namespace", "/robot0/arm") in found.vertices
    found = grouped(graph, (), Grouping(opened="/robot0,/robot0/arm"))
    assert Key("topic", "/robot0/arm/j0") in found.vertices
    assert Key("namespace", "/robot1") in found.vertices


def test_a_group_is_gone_when_all_its_members_are() -> None:
    graph = graph_of("/tf", "/tf_static")
    for removed, is_gone in ((["/tf"], False), (["/tf", "/tf_static"], True)):
        found = grouped(marked(graph, {("topic", name) for name in removed}), (), Grouping(tf=True))
        assert found.vertices[Key("group", "tf")].is_gone is is_gone
