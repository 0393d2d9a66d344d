"""`publishtest`: checks whether messages arrive on topics.

Private parameter `topics`: a list of `{name, timeout: 10.0, negative: false}`.
"""

from __future__ import annotations

from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_tools.testing.nodes.expectation import Expectation, Watch, expectations, follow
from pipros_tools.testing.nodes.run_checks import run_checks

# unittest's reports omit the frames of modules that define this variable.
__unittest = True


def check(node: Node) -> None:
    """Raise AssertionError if an expected message does not arrive, or an unexpected message arrives."""
    expected = expectations(node, "~topics")
    if not expected:
        raise AssertionError("No topic is specified in rosparam.")
    received: dict[str, str] = {}

    def receive(message: AnyMsg) -> None:
        received[message.header["topic"]] = message.header["type"]

    for item in expected:
        node.subscribe(item.name, AnyMsg, receive)

    def find(item: Expectation) -> str | None:
        return received.get(item.name)

    follow(node, Watch(expected, "a message on"), find, node.clock)


def main() -> None:
    run_checks("publishtest", "PublishTest", publish=check)
