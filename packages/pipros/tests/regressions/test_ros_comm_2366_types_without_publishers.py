"""ros_comm#2366: `rosnode info` printed `[unknown type]` for a topic that has no publisher."""

from __future__ import annotations

from typing import Any

from pipros.msg import load_message_class
from pipros_tools.graph.node_info import describe_registrations
from tests.support.nodes import MakeNode

String: Any = load_message_class("std_msgs/String")


def test_the_type_of_a_topic_with_only_subscribers_is_described(make_node: MakeNode) -> None:
    node = make_node("listener")
    node.subscribe("/heard", String, print)
    node.master.register_subscriber("/untyped", "*", node.uri)
    described = describe_registrations(node.master, "/listener")
    assert " * /heard [std_msgs/String]\n" in described
    assert " * /untyped [unknown type]\n" in described
