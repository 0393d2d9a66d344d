"""Tools on a terminal: alignment, colours, and tables that are redrawn in place. Output to pipes is plain."""

from __future__ import annotations

import re

import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class
from tests.support.nodes import MakeNode
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.support.waiting import wait_until

String = load_message_class("std_msgs/String")


@pytest.fixture
def terminal(ros: RosSystem, master: Master) -> Terminal:
    ros.pipros.environment.update(ROS_MASTER_URI=master.uri, TERM="xterm")
    ros.pipros.environment.pop("NO_COLOR", None)
    return ros.pipros.open_terminal()


def test_lists_are_aligned_and_coloured_but_not_in_a_pipe(
    ros: RosSystem, terminal: Terminal, make_node: MakeNode
) -> None:
    make_node("talker").advertise("/a_long_name", String)

    _, coloured = terminal.run("rostopic list -v")
    _, plain = terminal.run("NO_COLOR=1 rostopic list -v")
    piped = ros.pipros.run("rostopic", "list", "-v")

    assert re.search(
        r" \* /a_long_name +\x1b\[36m\[std_msgs/String\] *\x1b\[0m \x1b\[2m1 publisher\x1b", coloured
    )
    assert re.search(r" \* /a_long_name +\[std_msgs/String\] +1 publisher\n", plain)
    assert " * /a_long_name [std_msgs/String] 1 publisher" in piped.stdout
    assert "\x1b" not in piped.output


@pytest.mark.parametrize(
    ("command", "heading"), [("hz", "topic +rate +min_delta"), ("bw", "topic +average +mean")]
)
def test_figures_of_several_topics_are_shown_in_place(
    terminal: Terminal, make_node: MakeNode, command: str, heading: str
) -> None:
    node = make_node("talker")
    publishers = [node.advertise(topic, String, queue_size=10) for topic in ("/a", "/b")]
    replaced = re.compile(rf"\x1b\[\d+A\x1b\[J *{heading}")

    def publish_until_replaced() -> bool:
        for publisher in publishers:
            publisher.publish(String("hello"))
        return replaced.search(terminal.output) is not None

    terminal.type(f"rostopic {command} /a /b")
    wait_until(publish_until_replaced, timeout_s=60)
    terminal.press_ctrl_c()
    assert terminal.wait_for_prompt() == 0
