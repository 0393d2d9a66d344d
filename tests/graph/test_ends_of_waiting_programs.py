"""Programs that are ended while they wait: by Ctrl-C, by SIGTERM, by `rosnode kill`."""

from __future__ import annotations

import signal

import pytest

from tests.support.ros import RosSystem

WAITING_FOR_TRANSFORMS = {
    "rosrun tf tf_change_notifier": 0,
    "rosrun tf tf_echo earth moon": 0,
    "rosrun tf tf_monitor": 0,
    "rosrun tf tf_monitor earth moon": 0,
    "rosrun tf view_frames": 130,
    "rosrun tf2_tools echo.py earth moon": 0,
}
"""Exit codes by commands."""


@pytest.mark.parametrize("way", ["SIGINT", "SIGTERM", "rosnode kill"])
@pytest.mark.parametrize("command", WAITING_FOR_TRANSFORMS)
def test_a_node_that_waits_for_transforms_ends(ros: RosSystem, command: str, way: str) -> None:
    ros.serve_master()
    program = ros.pipros.start(*command.split())
    ros.wait_for_subscriber("/tf")
    (node,) = ros.subscribers("/tf")
    if way == "rosnode kill":
        ros.pipros.run("rosnode", "kill", node)
    else:
        program.send_signal(signal.Signals[way])

    assert program.wait() == WAITING_FOR_TRANSFORMS[command], program.output
    assert "Traceback" not in program.output
    assert ros.publishers("/rosout") == []
    assert not (ros.home / "frames.gv").exists()


def test_ctrl_c_ends_a_program_that_waits_for_a_service(ros: RosSystem) -> None:
    ros.serve_master()
    program = ros.pipros.start("rosrun", "topic_tools", "mux_select", "nowhere", "/topic")
    program.wait_for("Waiting for service")
    program.press_ctrl_c()

    assert program.wait() == 130
    assert "Traceback" not in program.output
