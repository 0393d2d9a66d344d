"""`rosgraph`: nodes and connections, until the master ends."""

from __future__ import annotations

from pipros_tools.cli.rosgraph import describe
from pipros_tools.graph.system_state import SystemState
from tests.support.ros import RosSystem


def test_it_shows_the_graph_and_its_changes(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    rosgraph = ros.pipros.start("rosgraph")
    rosgraph.wait_for(r"  /rosout :")
    since = rosgraph.mark()
    talker = ros.pipros.start(
        "rostopic", "pub", "-r", "1", "/chatter", "std_msgs/String", "x", "__name:=talker"
    )
    listener = ros.pipros.start("rostopic", "echo", "/chatter")
    rosgraph.wait_for(r"      /talker", since=since)
    rosgraph.wait_for(r"      /rostopic_", since=since)
    for process in (talker, listener):
        process.press_ctrl_c()
        process.wait()
    core.press_ctrl_c()
    core.wait()
    assert rosgraph.wait() == 0
    assert rosgraph.stderr == ["ERROR: Unable to communicate with master!"]


def test_ctrl_c_ends_it(ros: RosSystem) -> None:
    ros.pipros.start_master()
    rosgraph = ros.pipros.start("rosgraph")
    rosgraph.wait_for("Services:")
    rosgraph.press_ctrl_c()
    assert rosgraph.wait() == 0


def test_inbound_and_outbound_nodes_follow_from_the_topics() -> None:
    state = SystemState.from_state(
        [[["/t", ["/a"]], ["/u", ["/b"]]], [["/t", ["/b", "/c"]], ["/none", ["/c"]]], [["/s", ["/a"]]]]
    )
    assert describe(state).splitlines() == [
        "Nodes:",
        "  /a :",
        "    Inbound:",
        "    Outbound:",
        "      /b",
        "      /c",
        "  /b :",
        "    Inbound:",
        "      /a",
        "    Outbound:",
        "  /c :",
        "    Inbound:",
        "      /a",
        "    Outbound:",
        "Services:",
        "  /s",
    ]
