"""Waits for topics, and subscriptions of tools, with a master and a node from tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import pytest

from pipros.node import Node
from pipros_tools.graph.listening import Listening, wait_for_topic
from pipros_tools.graph.message_path import describe_path
from tests.support.table_master import TableMaster


class Waiting:
    """`wait_for_topic` on a master that learns new types at each pause."""

    def __init__(self, *types: list[list[str]]) -> None:
        self._types = list(types)
        self.warnings: list[str] = []
        self.pauses = 0
        self._master = TableMaster({("getTopicTypes",): self._types.pop(0)})

    def of(self, name: str) -> tuple[str, str]:
        part = wait_for_topic(self._master, name, warn=self.warnings.append, pause=self._next)
        return part.topic, describe_path(part.path)

    def _next(self, _seconds: float) -> None:
        self.pauses += 1
        self._master.answers["getTopicTypes",] = self._types.pop(0)


STRING = ["/chatter", "std_msgs/String"]


def test_a_known_topic_returns_at_once() -> None:
    waiting = Waiting([STRING])

    assert waiting.of("/chatter/data") == ("/chatter", "/data")
    assert (waiting.warnings, waiting.pauses) == ([], 0)


def test_a_topic_is_waited_for_with_one_warning() -> None:
    waiting = Waiting([], [], [STRING])

    assert waiting.of("/chatter") == ("/chatter", "")
    assert waiting.warnings == ["WARNING: topic [/chatter] does not appear to be published yet"]
    assert waiting.pauses == 2


def test_a_path_with_an_unknown_field_may_be_a_topic() -> None:
    waiting = Waiting([STRING], [STRING, ["/chatter/extra", "std_msgs/Int32"]])

    assert waiting.of("/chatter/extra") == ("/chatter/extra", "")


def test_a_topic_of_an_unknown_type_may_have_any_field() -> None:
    assert Waiting([["/odd", "nowhere/Thing"]]).of("/odd/a/b") == ("/odd", "/a/b")


def test_a_malformed_index_warns_and_selects_the_whole_message() -> None:
    waiting = Waiting([STRING])

    assert (waiting.of("/chatter/data[x]"), len(waiting.warnings)) == (("/chatter", ""), 1)


class FakeNode:
    """Keeps the callback, so that a test can call it."""

    def __init__(self) -> None:
        self.callbacks: dict[str, Callable[[Any], object]] = {}
        self.shutdown: Callable[[], object]

    def on_shutdown(self, call: Callable[[], object]) -> None:
        self.shutdown = call

    def subscribe(
        self, topic: str, _class: Any, callback: Callable[[Any], object], *, tcp_nodelay: bool
    ) -> None:
        _ = tcp_nodelay
        self.callbacks[topic] = callback


@pytest.fixture
def node() -> FakeNode:
    return FakeNode()


def listening_on(node: FakeNode) -> Listening:
    return Listening(cast("Node", node))


def test_messages_reach_the_callback_until_the_end(node: FakeNode) -> None:
    received: list[Any] = []
    listening = listening_on(node)
    listening.subscribe("/a", received.append)

    node.callbacks["/a"]("one")
    assert not listening.wait(0)
    listening.finish()
    node.callbacks["/a"]("two")

    assert received == ["one"]
    assert listening.wait(0)


def test_an_error_of_a_callback_is_raised_by_the_wait(node: FakeNode) -> None:
    def fail(_message: Any) -> None:
        raise ValueError("broken")

    listening = listening_on(node)
    listening.subscribe("/a", fail)
    node.callbacks["/a"]("one")

    with pytest.raises(ValueError, match="broken"):
        listening.wait()


def test_the_end_of_the_node_ends_the_wait(node: FakeNode) -> None:
    listening = listening_on(node)
    node.shutdown()

    assert listening.wait()
