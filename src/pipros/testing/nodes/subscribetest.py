"""`subscribetest`: topics are subscribed to, or are not.

Private parameter `topics`: a list of `{name, timeout: 10.0, negative: false}`.
"""

from __future__ import annotations

from pipros.node import Node
from pipros.testing.nodes.program import Expectation, check_all, expectations, run_check


def check(node: Node) -> None:
    """Raises AssertionError when a topic has no subscriber, or has one and must not."""

    def find(one: Expectation) -> str | None:
        _, subscribed, _ = node.master.get_system_state()
        types = {topic: type_name for topic, type_name in node.master.get_topic_types()}
        return next((types.get(topic, "") for topic, _ in subscribed if topic == one.name), None)

    check_all(node, expectations(node, "~topics"), find, what="a subscriber of")


def main() -> None:
    run_check("subscribetest", check)
