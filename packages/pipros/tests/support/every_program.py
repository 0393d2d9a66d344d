"""Every program that pipros installs, started with a master that never responds, and ended by a signal.

`python -m tests.support.every_program` ends each at ten moments of its start with SIGINT and SIGTERM, and
prints the times. `script/long signals` runs it.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import re
import shlex
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.support import project
from tests.support.environments import REPOSITORY, SHIPPED, files_below
from tests.support.waiting import wait_until

ROOT = REPOSITORY
PROGRAMS = Path(sys.executable).parent

WAITS_MS = math.inf
MOMENTS_MS = (10, 20, 35, 55, 80, 115, 170, 250, 400, WAITS_MS)
"""The moments of a start: the processor time (ms) that the main thread has used, so that the load of the
machine has no influence. The last one is when the program waits, which is also the latest moment."""

NUMBERS = (signal.SIGINT, signal.SIGTERM)
LIMIT_S = 15.0
"""A program that waits for its master, or for anything else, does not end within this time on any machine."""

# In these steps of its start, Python itself reports a Ctrl-C, drops it and goes on.
_DROPPED = re.compile(r"Failed checking if argv\[0\]|ignored in: <function _get_module_lock\.<locals>\.cb")
_AT_ENTRY = re.compile(r"in guarded\n\s*@wraps\(main\)\n[\s^~]*KeyboardInterrupt\s*$")
"""The traceback of a Ctrl-C at the entry of the function that handles it, before its `try`. From 3.11 on,
Python runs signal handlers there, and reports this as it reports Ctrl-C during the imports."""

_WRAPPED = re.compile(
    r"KeyboardInterrupt\n\nThe above exception was the direct cause.*calling __set_name__", re.S
)
"""Until 3.11, Python reports a Ctrl-C during the creation of a class as the cause of a RuntimeError."""

_INTERRUPTED = re.compile(
    r"KeyboardInterrupt[: ]*(?:\n(?:Error calling __set_name__ on .*|decoding with '.*' codec failed))?\s*\Z"
)
"""The end of the traceback of a Ctrl-C. From 3.12 on, Python adds a note in a decoder or a new class."""

_WAITS_FOR_S = 0.4
_WAITING_SHARE = 0.1
"""A program waits if its main thread used less than this share of a processor for this time."""

COMMANDS = """
catkin_create_pkg --help
catkin_find --help
catkin_init_workspace --help
catkin_make --help
catkin_make_isolated --help
catkin_test_results .
catkin_topological_order .
check_urdf robot.urdf
pipros clients localhost:1
pipros doctor
pipros env
pipros fleet list
pipros foxglove --port 0
pipros graph
pipros ros2 --domain 77
pipros serve --port 0
pipros stubs std_msgs
pipros version
pipros-complete rostopic
rosaction list
rosbag play slow.bag
rosbag record -a
rosclean check
rosconsole list
roscore -p {port}
rosdep keys --from-paths .
rosgraph
roslaunch --wait node.launch
roslaunch node.launch
roslaunch-check node.launch
roslaunch-complete rostest
roslaunch-deps rostest
roslaunch-logs
rosmaster --core -p {port}
rosmsg list
rosmsg-proto message std_msgs/String
rosnode info /x
rosnode list
rosnode ping -a
rospack list
rosparam list
rosrun rostopic rostopic list
rosservice call /x
rosservice list
rossrv list
rosstack list
rostest node.launch
rostopic bw /x
rostopic echo /x
rostopic hz /x
rostopic list
rostopic pub /x std_msgs/Empty
rosunit test.py
rosversion rospy
roswtf
rqt
rqt_bag
rqt_console
rqt_graph
rqt_image_view
rqt_logger_level
rqt_plot
rqt_publisher
rqt_reconfigure
rqt_robot_monitor
rqt_service_caller
rqt_tf_tree
rqt_top
rqt_topic
rviz
urdf_to_graphiz robot.urdf
urdf_to_graphviz robot.urdf
""".strip().splitlines()

NODES = """
actionlib axclient.py /x
actionlib axserver.py /x actionlib/TestAction
actionlib_tools axclient.py /x
actionlib_tools axserver.py /x actionlib/TestAction
actionlib_tutorials averaging_client
actionlib_tutorials averaging_server
actionlib_tutorials fibonacci_client
actionlib_tutorials fibonacci_client.py
actionlib_tutorials fibonacci_server
actionlib_tutorials fibonacci_server.py
actionlib_tutorials gen_numbers.py
amcl amcl
controller_manager controller_manager list
controller_manager spawner base
depthimage_to_laserscan depthimage_to_laserscan
diagnostic_aggregator add_analyzers
diagnostic_aggregator aggregator_node
costmap_2d costmap_2d_node
diagnostic_common_diagnostics cpu_monitor.py
diagnostic_common_diagnostics hd_monitor.py
diagnostic_common_diagnostics ntp_monitor.py localhost
diagnostic_common_diagnostics ram_monitor.py
diagnostic_common_diagnostics sensors_monitor.py
diagnostic_common_diagnostics tf_monitor.py
diagnostic_updater example
dynamic_reconfigure dynparam list
dynamic_reconfigure reconfigure_gui
fake_localization fake_localization
explore_lite explore
gmapping slam_gmapping
hector_mapping hector_mapping
foxglove_bridge foxglove_bridge _port:=0
image_transport republish raw
image_proc image_proc
image_view disparity_view
image_view image_view
imu_complementary_filter complementary_filter_node
imu_filter_madgwick imu_filter_node
interactive_marker_twist_server marker_server
joint_state_publisher joint_state_publisher
joint_state_publisher_gui joint_state_publisher_gui
joy joy_node
laser_assembler laser_scan_assembler
laser_scan_matcher laser_scan_matcher_node
laser_filters scan_to_cloud_filter_chain
laser_filters scan_to_scan_filter_chain
map_server map_saver
map_server map_server map.yaml
move_base move_base
navfn navfn_node
nodelet nodelet manager
pipros_sim sim
pcl_ros pcd_to_pointcloud
pcl_ros pointcloud_to_pcd
pointcloud_to_laserscan pointcloud_to_laserscan_node
robot_localization ekf_localization_node
robot_localization navsat_transform_node
robot_localization ukf_localization_node
robot_pose_ekf robot_pose_ekf
robot_state_publisher robot_state_publisher
robot_state_publisher state_publisher
rosapi rosapi_node
rosbridge_server rosbridge_tcp _port:=0
rosbridge_server rosbridge_udp _port:=0
rosbridge_server rosbridge_websocket _port:=0
roscpp_tutorials add_two_ints_client 1 2
roscpp_tutorials add_two_ints_server
roscpp_tutorials anonymous_listener
roscpp_tutorials listener
roscpp_tutorials talker
roscpp_tutorials timers
rosdiagnostic rosdiagnostic
rosout rosout
rospy_tutorials add_two_ints_client
rospy_tutorials add_two_ints_server
rospy_tutorials listener.py
rospy_tutorials param_talker.py
rospy_tutorials talker.py
rospy_tutorials advanced_publish.py
rospy_tutorials listener_connection_header.py
rospy_tutorials listener_header.py
rospy_tutorials listener_subscribe_notify.py
rospy_tutorials listener_with_userdata.py
rospy_tutorials on_shutdown.py
rospy_tutorials talker_connection_header.py
rospy_tutorials talker_header.py
rostest advertisetest
rostest hztest
rostest paramtest
rostest publishtest
rostest subscribetest
rplidar_ros rplidarNode
rqt_robot_steering rqt_robot_steering
stage_ros stageros simple.world
stereo_image_proc stereo_image_proc
teleop_twist_joy teleop_node
teleop_twist_keyboard teleop_twist_keyboard.py
tf static_transform_publisher 0 0 0 0 0 0 a b 100
tf tf_change_notifier
tf tf_echo a b
tf tf_monitor
tf tf_remap
tf view_frames
tf2_ros buffer_server
tf2_ros static_transform_publisher 0 0 0 0 0 0 a b
tf2_tools echo.py a b
tf2_tools view_frames.py
tf2_web_republisher tf2_web_republisher
topic_tools demux a b
topic_tools drop a 1 2
topic_tools mux a b
topic_tools mux_add mux a
topic_tools mux_delete mux a
topic_tools mux_list mux
topic_tools mux_select mux a
topic_tools relay a
topic_tools relay_field a /b std_msgs/String 'data: x'
topic_tools switch_mux a b
topic_tools throttle messages a 1
topic_tools transform a /b std_msgs/String m
turtle_actionlib shape_client
turtle_actionlib shape_server
turtle_teleop turtle_teleop_joy
turtle_teleop turtle_teleop_key
turtle_tf dynamic_tf_broadcaster.py
turtle_tf fixed_tf_broadcaster.py
turtle_tf turtle_tf_broadcaster
turtle_tf turtle_tf_listener
turtle_tf turtle_tf_listener_debug
turtle_tf turtle_tf_message_broadcaster.py
turtle_tf turtle_tf_message_filter
turtle_tf2 dynamic_tf2_broadcaster.py
turtle_tf2 fixed_tf2_broadcaster.py
turtle_tf2 static_turtle_tf2_broadcaster turtle 0 0 0 0 0 0
turtle_tf2 turtle_tf2_broadcaster
turtle_tf2 turtle_tf2_listener
turtle_tf2 turtle_tf2_message_broadcaster.py
turtle_tf2 turtle_tf2_message_filter
turtlebot3_fake turtlebot3_fake_node
turtlesim draw_square
turtlesim mimic
turtlesim turtle_teleop_key
turtlesim turtlesim_node
twist_mux twist_mux
urg_node urg_node
usb_cam usb_cam_node
""".strip().splitlines()

EVERY = (*COMMANDS, *(f"rosrun {node}" for node in NODES))


@dataclass(frozen=True, slots=True)
class End:
    """How a program ended.

    Attributes:
        command: its command line.
        moment_ms: the moment of its start.
        number: the signal.
        seconds: from the signal to the end; None if it ended before, infinite if it had to be killed.
        output: what it printed.
    """

    command: str
    moment_ms: float
    number: signal.Signals
    seconds: float | None
    output: str

    def __str__(self) -> str:
        ended = "had ended" if self.seconds is None else f"{self.seconds:.2f} s"
        moment = "when it waits" if self.moment_ms == WAITS_MS else f"at {self.moment_ms} ms"
        return f"{self.command}, {self.number.name} {moment}: {ended}"

    @property
    def complaint(self) -> str:
        """What is wrong with this end; empty if nothing is."""
        if _DROPPED.search(self.output):
            return ""
        if self.seconds is not None and self.seconds >= LIMIT_S:
            return f"{self} without an end\n{self.output}"
        # Python itself reports a Ctrl-C that interrupts the imports, or a rospy program before `init_node`.
        trace = self.output.rpartition("Traceback (most recent")[2] if "Traceback" in self.output else ""
        is_of_thread = "Exception in thread" in self.output
        is_of_command = "in guarded" in self.output and not _AT_ENTRY.search(trace)
        is_ctrl_c = bool(_INTERRUPTED.search(trace) or _WRAPPED.search(self.output))
        if trace and (is_of_thread or is_of_command or not is_ctrl_c):
            return f"{self} with a traceback\n{self.output}"
        return ""


def end_program(
    command: str,
    moment_ms: float,
    number: signal.Signals,
    folder: Path,
    *,
    has_master: bool = True,
    port: int = 1,
) -> End:
    """Start a program in `folder`, send it a signal at a moment of its start, and wait for its end.

    Its master accepts connections and never responds, or, without `has_master`, refuses them.
    """
    _make_files(folder)
    with socket.create_server(("127.0.0.1", 0)) as master, tempfile.TemporaryFile() as printed:
        uri = f"http://127.0.0.1:{master.getsockname()[1] if has_master else 1}"
        environment = {
            **{
                name: value
                for name, value in os.environ.items()
                if not name.startswith("ROS_") and name != "DISPLAY"
            },
            "PATH": f"{PROGRAMS}{os.pathsep}{os.environ['PATH']}",
            "HOME": str(folder),
            "ROS_HOME": str(folder / ".ros"),
            "ROS_MASTER_URI": uri,
            "ROS_IP": "127.0.0.1",
        }
        name, *arguments = shlex.split(command.replace("{port}", str(port)))
        process = subprocess.Popen(
            [PROGRAMS / name, *arguments],
            env=environment,
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=printed,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            seconds = _signalled(process, moment_ms, number)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            if process.stdin is not None:
                process.stdin.close()
        printed.seek(0)
        return End(command, moment_ms, number, seconds, printed.read().decode(errors="replace"))


def _signalled(process: subprocess.Popen[bytes], moment_ms: float, number: signal.Signals) -> float | None:
    began = time.monotonic()
    spent = deque([(began, 0.0)])

    def is_there() -> bool:
        now, spent_ms = time.monotonic(), _spent_ms(process.pid)
        spent.append((now, spent_ms))
        while len(spent) > 2 and spent[1][0] < now - _WAITS_FOR_S:
            spent.popleft()
        (since, before_ms), waits = spent[0], now - began > _WAITS_FOR_S
        is_waiting = waits and spent_ms - before_ms < _WAITING_SHARE * 1000 * (now - since)
        return spent_ms >= moment_ms or is_waiting or process.poll() is not None

    wait_until(is_there)
    if process.poll() is not None:
        return None
    began = time.monotonic()
    os.killpg(process.pid, number)
    try:
        process.wait(LIMIT_S)
    except subprocess.TimeoutExpired:
        return float("inf")
    return time.monotonic() - began


def _spent_ms(pid: int) -> float:
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text().split()[0]) / 1e6
    except (OSError, IndexError):  # it has ended
        return float("inf")


def _make_files(folder: Path) -> None:
    (folder / "robot.urdf").write_text('<robot name="r"><link name="base"/></robot>')
    (folder / "node.launch").write_text('<launch><node pkg="rostopic" type="rostopic" name="n"/></launch>')
    (folder / "map.yaml").write_text("image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n")
    (folder / "map.pgm").write_bytes(b"P5 1 1 255\n\0")
    (folder / "test.py").write_text("import time\ntime.sleep(1000)\n")


def console_commands() -> Iterator[str]:
    """Yield the names of the programs of the distribution."""
    yield from project.PROGRAMS


def shipped_nodes() -> Iterator[tuple[str, str]]:
    """Yield package and name of the executable files in the packages of pipros."""
    for folder, path in ((share, path) for share in SHIPPED for path in files_below(share)):
        if path.is_file() and os.access(path, os.X_OK):
            yield path.relative_to(folder).parts[0], path.name


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="the command lines that contain this text")
    parser.add_argument("--moments", type=int, default=len(MOMENTS_MS))
    parser.add_argument("--at-once", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--without-nodes", action="store_true", help="leave out what rosrun starts")
    options = parser.parse_args(argv)
    # A shell lets its jobs in the background ignore Ctrl-C, and programs inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    chance = random.Random(options.seed)  # noqa: S311
    trials = [
        (command, moment, number)
        for command in (COMMANDS if options.without_nodes else EVERY)
        if options.only in command
        for moment in (*sorted(chance.sample(MOMENTS_MS[:-1], options.moments - 1)), WAITS_MS)
        for number in NUMBERS
    ]

    def run(trial: tuple[str, float, signal.Signals]) -> End:
        with tempfile.TemporaryDirectory() as folder:
            return end_program(*trial, Path(folder), port=20_000 + os.getpid() % 9_000)

    with ThreadPoolExecutor(options.at_once) as pool:
        ends = list(pool.map(run, trials))
    complaints = [end for end in ends if end.complaint]
    times = sorted(end.seconds for end in ends if end.seconds is not None)
    for end in complaints:
        print(end.complaint)
    print(
        f"{len({end.command for end in ends})} programs, {len(ends)} runs, {len(times)} ended by the signal"
    )
    if times:
        share = 100 * sum(seconds <= 0.5 for seconds in times) / len(times)
        worst = ", ".join(map(str, sorted(ends, key=lambda end: -(end.seconds or 0))[:5]))
        print(f"median {statistics.median(times):.2f} s, within 0.5 s {share:.1f} %, slowest: {worst}")
    print(f"{len(complaints)} of them wrong")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
