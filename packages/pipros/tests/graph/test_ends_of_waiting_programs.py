"""Programs ended during a wait by Ctrl-C, SIGTERM or `rosnode kill`."""

from __future__ import annotations

import shlex
import signal
from contextlib import closing

import pytest

from pipros.net.master_client import MasterClient
from tests.support.ros import RosSystem
from tests.support.slaves import SilentSlave
from tests.support.waiting import wait_until

WAITING_FOR_TRANSFORMS = {
    "rosrun tf tf_change_notifier": 0,
    "rosrun tf tf_echo earth moon": 0,
    "rosrun tf tf_monitor": 0,
    "rosrun tf tf_monitor earth moon": 0,
    "python3 -c 'import tf.nodes.view_frames as it; it.LISTEN_S = 1000; raise SystemExit(it.main())'": 130,
    "rosrun tf2_tools echo.py earth moon": 0,
}
"""Exit codes by commands."""


@pytest.mark.parametrize("way", ["SIGINT", "SIGTERM", "rosnode kill"])
@pytest.mark.parametrize("command", WAITING_FOR_TRANSFORMS)
def test_a_node_that_waits_for_transforms_ends(ros: RosSystem, command: str, way: str) -> None:
    ros.serve_master()
    program = ros.pipros.start(*shlex.split(command))
    ros.wait_for_subscriber("/tf")
    (node,) = ros.subscribers("/tf")
    if way == "rosnode kill":
        ros.pipros.run("rosnode", "kill", node)
    else:
        program.send_signal(signal.Signals[way])

    assert program.wait() == WAITING_FOR_TRANSFORMS[command], program.output
    assert "Traceback" not in program.output
    # A program gives up if the master, in this process, does not answer soon. Then the master removes it.
    wait_until(lambda: ros.publishers("/rosout") == [])
    with closing(MasterClient(ros.master_uri, "/a_test")) as master:
        calls = master.call("pipros.getStatistics")["calls_by_method"]
    assert any(name.startswith("unregister") for name in calls)
    assert not (ros.home / "frames.gv").exists()


def test_ctrl_c_ends_a_program_that_waits_for_a_service(ros: RosSystem) -> None:
    ros.serve_master()
    program = ros.pipros.start("rosrun", "topic_tools", "mux_select", "nowhere", "/topic")
    program.wait_for("Waiting for service")
    program.press_ctrl_c()

    assert program.wait() == 130
    assert "Traceback" not in program.output


ENDED_BEFORE_THERE_IS_A_NODE = {
    "diagnostic_aggregator add_analyzers": 0,
    "diagnostic_aggregator aggregator_node": 0,
    "diagnostic_common_diagnostics cpu_monitor.py": 0,
    "diagnostic_common_diagnostics hd_monitor.py": 0,
    "diagnostic_common_diagnostics ntp_monitor.py localhost": 0,
    "diagnostic_common_diagnostics ram_monitor.py": 0,
    "diagnostic_common_diagnostics sensors_monitor.py": 0,
    "diagnostic_common_diagnostics tf_monitor.py": 0,
    "dynamic_reconfigure dynparam list": 130,
    "image_transport republish raw": 0,
    "joint_state_publisher joint_state_publisher": 0,
    "map_server map_saver": 1,
    "map_server map_server map.yaml": 0,
    "robot_state_publisher robot_state_publisher": 0,
    "rosdiagnostic rosdiagnostic": 130,
    "tf static_transform_publisher 0 0 0 0 0 0 a b 100": 0,
    "tf tf_change_notifier": 0,
    "tf tf_echo a b": 0,
    "tf tf_monitor": 0,
    "tf tf_remap": 0,
    "tf view_frames": 130,
    "tf2_ros buffer_server": 0,
    "tf2_ros static_transform_publisher 0 0 0 0 0 0 a b": 0,
    "tf2_tools echo.py a b": 0,
    "topic_tools demux a b": 0,
    "topic_tools drop a 1 2": 0,
    "topic_tools mux a b": 0,
    "topic_tools mux_add mux a": 130,
    "topic_tools mux_list mux": 130,
    "topic_tools relay a": 0,
    "topic_tools relay_field a /b std_msgs/String 'data: x'": 0,
    "topic_tools switch_mux a b": 130,
    "topic_tools throttle messages a 1": 0,
    "topic_tools transform a /b std_msgs/String m": 0,
}
"""Exit codes by programs."""


@pytest.mark.parametrize("program", ENDED_BEFORE_THERE_IS_A_NODE)
def test_ctrl_c_ends_a_program_whose_master_is_silent(ros: RosSystem, program: str) -> None:
    master = SilentSlave()
    running = ros.pipros.start("rosrun", *shlex.split(program), ROS_MASTER_URI=master.api)
    wait_until(lambda: master.connections, 30, lambda: running.output)
    running.press_ctrl_c()

    assert running.wait() == ENDED_BEFORE_THERE_IS_A_NODE[program], running.output
    assert "Traceback" not in running.output
    master.stop()
