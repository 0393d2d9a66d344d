"""`subscribetest`: checks whether topics have subscribers.

Private parameter `topics`: a list of `{name, timeout: 10.0, negative: false, type}`.
"""

from __future__ import annotations

from pipros.node import Node
from pipros_tools.testing.nodes.expectation import Expectation, Watch, expectations, follow
from pipros_tools.testing.nodes.run_checks import run_checks

# unittest's reports omit the frames of modules that define this variable.
__unittest = True


def check(node: Node) -> None:
    """Raise AssertionError if a topic has no subscriber or, with `negative`, has a subscriber."""

    def find(item: Expectation) -> str | None:
        _, subscribed, _ = node.master.get_system_state()
        if all(topic != item.name for topic, _ in subscribed):
            return None
        return next((kind for topic, kind in node.master.get_topic_types() if topic == item.name), "")

    expected = expectations(node, "~topics")
    if not expected:
        raise AssertionError("No topic is specified in rosparam.")
    follow(node, Watch(expected, "a subscriber of"), find)


def main() -> None:
    run_checks("subscribetest", "SubscribeTest", subscribe=check)
