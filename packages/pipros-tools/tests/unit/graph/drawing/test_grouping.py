"""Boxes for several topics, and collapsed namespaces."""

from __future__ import annotations

import pytest

from pipros_tools.graph.drawing.grouping import MAX_BOXES, Grouping, grouped, marked
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex

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
