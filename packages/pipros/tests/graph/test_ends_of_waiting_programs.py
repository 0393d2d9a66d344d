"""Programs ended during a wait by Ctrl-C, SIGTERM or rosnode kill, also in the background of a script."""

import os
import shlex
import signal
import sys
from contextlib import closing

import pytest

from pipros.net.master_client import MasterClient
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.slaves import SilentSlave
from tests.support.waiting import wait_until

# Programs ended during a wait by Ctrl-C, SIGTERM or `rosnode kill`.


WAITING_FOR_TRANSFORMS = {
    "rosrun tf tf_change_notifier": 0, "rosrun tf tf_echo earth moon": 0, "rosrun tf tf_monitor": 0,
    "rosrun tf tf_monitor earth moon": 0,
    "python3 -c 'import tf.nodes.view_frames as it; it.LISTEN_S = 1000; raise SystemExit(it.main())'": 130,
    "rosrun tf2_tools echo.py earth moon": 0,
}  # fmt: skip
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


@pytest.mark.parametrize(
    "words", ["topic_tools mux_select nowhere /topic", "dynamic_reconfigure dynparam get a"]
)
def test_ctrl_c_ends_a_program_that_waits_for_a_service(ros: RosSystem, words: str) -> None:
    ros.serve_master()
    program = ros.pipros.start("rosrun", *words.split())
    program.wait_for("Waiting for service")
    program.press_ctrl_c()

    program.check(130)


ENDED_BEFORE_THERE_IS_A_NODE = {
    "diagnostic_aggregator add_analyzers": 0, "diagnostic_aggregator aggregator_node": 0,
    "diagnostic_common_diagnostics cpu_monitor.py": 0, "diagnostic_common_diagnostics hd_monitor.py": 0,
    "diagnostic_common_diagnostics ntp_monitor.py localhost": 0,
    "diagnostic_common_diagnostics ram_monitor.py": 0, "diagnostic_common_diagnostics sensors_monitor.py": 0,
    "diagnostic_common_diagnostics tf_monitor.py": 0, "dynamic_reconfigure dynparam list": 130,
    "image_transport republish raw": 0, "joint_state_publisher joint_state_publisher": 0,
    "map_server map_saver": 1, "map_server map_server map.yaml": 0,
    "robot_state_publisher robot_state_publisher": 0, "rosdiagnostic rosdiagnostic": 130,
    "tf static_transform_publisher 0 0 0 0 0 0 a b 100": 0, "tf tf_change_notifier": 0, "tf tf_echo a b": 0,
    "tf tf_monitor": 0, "tf tf_remap": 0, "tf view_frames": 130, "tf2_ros buffer_server": 0,
    "tf2_ros static_transform_publisher 0 0 0 0 0 0 a b": 0, "tf2_tools echo.py a b": 0,
    "topic_tools demux a b": 0, "topic_tools drop a 1 2": 0, "topic_tools mux a b": 0,
    "topic_tools mux_add mux a": 130, "topic_tools mux_list mux": 130, "topic_tools relay a": 0,
    "topic_tools relay_field a /b std_msgs/String 'data: x'": 0, "topic_tools switch_mux a b": 130,
    "topic_tools throttle messages a 1": 0, "topic_tools transform a /b std_msgs/String m": 0,
}  # fmt: skip
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


# Commands that a script starts with `&` end on SIGINT, although the shell made them ignore it.


SCRIPT = """
import os, time
open(os.environ["HOME"] + "/ready", "w").close()
time.sleep(60)
"""

NODE = """
import rospy
rospy.init_node("sleeper")
print("up", flush=True)
rospy.spin()
"""


def start_in_background(ros: RosSystem, command: str) -> tuple[Process, int]:
    """Return the shell of a script, and the process of its background job."""
    shell = ros.pipros.start("sh", "-c", f"{command} & echo job $!; wait $!; echo code $?")
    return shell, int(shell.wait_for(r"^job (\d+)$")[1])


@pytest.mark.parametrize(("command", "is_up"), [
    ("rostopic echo /said", None), ("rostopic echo /nothing", "does not appear to be published yet"),
    ("rostopic hz /said", "subscribed to"), ("rostopic bw /said", "subscribed to"),
    ("rostopic delay /said", "subscribed to"),
    ("rostopic pub -v -r 10 /other std_msgs/String x", "publishing"),
    ("rostopic pub /other std_msgs/String x", "publishing and latching"), (f"{sys.executable} node.py", "up"),
])  # fmt: skip
def test_a_node_in_the_background_ends_on_sigint(ros: RosSystem, command: str, is_up: str | None) -> None:
    (ros.home / "node.py").write_text(NODE)
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "/said", "std_msgs/String", "x")
    ros.wait_for_publisher("/said")
    shell, job = start_in_background(ros, command)
    if is_up:
        shell.wait_for(is_up)
    else:
        ros.wait_for_subscriber("/said")
    os.kill(job, signal.SIGINT)
    shell.wait_for(r"^code \d+$")


@pytest.mark.parametrize("command", ["rostest slow_test slow.test", "rosunit src/slow_test/slow.py"])
def test_a_test_run_in_the_background_of_a_script_ends_on_sigint(ros: RosSystem, command: str) -> None:
    package = ros.home / "src" / "slow_test"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>slow_test</name></package>")
    (package / "slow.py").write_text(f"#!{sys.executable}\n{SCRIPT}")
    (package / "slow.py").chmod(0o755)
    (package / "slow.test").write_text(
        '<launch><test test-name="slow" pkg="slow_test" type="slow.py"/></launch>'
    )
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    shell, job = start_in_background(ros, command)
    wait_until(lambda: (ros.home / "ready").exists(), what="the test to run")
    os.kill(job, signal.SIGINT)
    shell.wait_for(r"^code \d+$")


def test_other_commands_keep_ignoring_it_as_noetics_do(ros: RosSystem) -> None:
    ros.pipros.start_master()
    shell, job = start_in_background(ros, "rosnode ping -c 3 /rosout")
    shell.wait_for("xmlrpc reply")
    os.kill(job, signal.SIGINT)
    shell.wait_for("ping average")
    shell.wait_for("^code 0$")
