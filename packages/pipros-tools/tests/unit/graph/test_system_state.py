from __future__ import annotations

import pytest

from pipros_tools.graph.system_state import SystemState, by_node, is_below, of_node

STATE = [
    [["/chatter", ["/talker", "/other"]], ["/rosout", ["/talker"]]],
    [["/chatter", ["/listener"]], ["/odd", []]],
    [["/add", ["/server"]]],
]


def test_a_picture_is_read_from_the_masters_answer() -> None:
    state = SystemState.from_state(STATE)
    assert state.publishers == {"/chatter": ["/talker", "/other"], "/rosout": ["/talker"]}
    assert state.subscribers == {"/chatter": ["/listener"], "/odd": []}
    assert state.services == {"/add": ["/server"]}


def test_topics_and_nodes_are_sorted_and_named_once() -> None:
    state = SystemState.from_state(STATE)
    assert state.topics() == ["/chatter", "/odd", "/rosout"]
    assert state.nodes() == ["/listener", "/other", "/server", "/talker"]


def test_topics_of_a_node_are_found() -> None:
    assert of_node("/talker", SystemState.from_state(STATE).publishers) == ["/chatter", "/rosout"]


def test_the_topics_of_all_nodes_are_found_without_a_search_for_each_node() -> None:
    class Unsearched(list[str]):
        def __contains__(self, _: object) -> bool:
            raise AssertionError("each of many topics is searched for each of many nodes")

    publishers = {"/scan": Unsearched(["/b"]), "/chatter": Unsearched(["/a", "/b", "/b"])}
    assert by_node(publishers) == {"/a": ["/chatter"], "/b": ["/chatter", "/scan"]}


@pytest.mark.parametrize(("name", "ns", "is_in"), [
    ("/a/b", "/a", True), ("/a", "/a", True), ("/ab", "/a", False), ("/a/b", "/", True),
    ("/a/b", "/a/", True), ("/a", "/a/b", False),
])  # fmt: skip
def test_namespaces_end_at_a_slash(name: str, ns: str, is_in: bool) -> None:
    assert is_below(name, ns) is is_in
