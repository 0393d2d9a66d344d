"""Every program that pipros installs, started with a master that never responds, and ended by a signal.

`python -m tests.support.every_program` ends each at ten moments of its start with SIGINT and SIGTERM, and
prints the times. `script/long signals` runs it.
"""

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
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.support import project
from tests.support.environments import SHIPPED, files_below
from tests.support.waiting import wait_until

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

_ARGUMENTS = """
catkin_create_pkg --help; catkin_find --help; catkin_init_workspace --help; catkin_make --help
catkin_make_isolated --help; catkin_test_results .; catkin_topological_order .; check_urdf robot.urdf
pipros clients localhost:1; pipros doctor; pipros env; pipros fleet list; pipros foxglove --port 0
pipros graph; pipros ros2 --domain 77; pipros serve --port 0; pipros stubs std_msgs; pipros version
pipros-complete rostopic; rosaction list; rosbag play slow.bag; rosbag record -a; rosclean check
rosconsole list; roscore -p {port}; rosdep keys --from-paths .; roslaunch --wait node.launch
roslaunch node.launch; roslaunch-check node.launch; roslaunch-complete rostest; roslaunch-deps rostest
rosmaster --core -p {port}; rosmsg list; rosmsg-proto message std_msgs/String; rosnode info /x; rosnode list
rosnode ping -a; rospack list; rosparam list; rosrun rostopic rostopic list; rosservice call /x
rosservice list; rossrv list; rosstack list; rostest node.launch; rostopic bw /x; rostopic echo /x
rostopic hz /x; rostopic list; rostopic pub /x std_msgs/Empty; rosunit test.py; rosversion rospy
urdf_to_graphiz robot.urdf; urdf_to_graphviz robot.urdf
"""
_NODE_ARGUMENTS = """
actionlib axclient.py /x; actionlib axserver.py /x actionlib/TestAction; actionlib_tools axclient.py /x
actionlib_tools axserver.py /x actionlib/TestAction; controller_manager controller_manager list
controller_manager spawner base; diagnostic_common_diagnostics ntp_monitor.py localhost
dynamic_reconfigure dynparam list; foxglove_bridge foxglove_bridge _port:=0; image_transport republish raw
map_server map_server map.yaml; nodelet nodelet manager; rosbridge_server rosbridge_tcp _port:=0
rosbridge_server rosbridge_udp _port:=0; rosbridge_server rosbridge_websocket _port:=0
roscpp_tutorials add_two_ints_client 1 2; stage_ros stageros simple.world; tf tf_echo a b
tf static_transform_publisher 0 0 0 0 0 0 a b 100; tf2_ros static_transform_publisher 0 0 0 0 0 0 a b
tf2_tools echo.py a b; topic_tools demux a b; topic_tools drop a 1 2; topic_tools mux a b
topic_tools mux_add mux a; topic_tools mux_delete mux a; topic_tools mux_list mux
topic_tools mux_select mux a; topic_tools relay a; topic_tools relay_field a /b std_msgs/String 'data: x'
topic_tools switch_mux a b; topic_tools throttle messages a 1; topic_tools transform a /b std_msgs/String m
turtle_tf2 static_turtle_tf2_broadcaster turtle 0 0 0 0 0 0
"""
_LEFT_OUT = {*project.PROGRAMS, "play", "record", "ros2_gateway", "rqt_gui"}
"""Nodes that are commands, too."""
_LEFT_OUT |= {"convert", "export_csv.py", "sparse_csv.py", "list_transports", "xacro", "check_test_ran.py"}
_LEFT_OUT |= {"test_results_dir.py", "clean_junit_xml.py", "summarize_results.py"}
"""And those that read files only."""


def _with_others(lines: str, names: Iterable[str]) -> list[str]:
    """Return command lines, and the names that none of them begins with."""
    given = re.split("[;\n] *", lines.strip())
    lacking = {name for name in names if not any(f"{each} ".startswith(f"{name} ") for each in given)}
    return sorted({*given, *lacking})


COMMANDS = _with_others(_ARGUMENTS, project.PROGRAMS)
"""Every program of the distribution, with arguments."""
NODES = _with_others(
    _NODE_ARGUMENTS,
    (
        f"{path.relative_to(share).parts[0]} {path.name}"
        for share in SHIPPED
        for path in files_below(share)
        if os.access(path, os.X_OK) and path.name not in _LEFT_OUT
    ),
)
"""Every executable file in the packages of pipros, with arguments."""
EVERY = (*COMMANDS, *(f"rosrun {node}" for node in NODES))


@dataclass(frozen=True, slots=True)
class End:
    """How a program ended.

    Attributes:
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


def end_program(command: str, moment_ms: float, number: signal.Signals, folder: Path, port: int) -> End:
    """Start a program in `folder`, send it a signal at a moment of its start, and wait for its end.

    Its master accepts connections and never responds.
    """
    for file, text in _FILES.items():
        (folder / file).write_text(text)
    with socket.create_server(("127.0.0.1", 0)) as master, tempfile.TemporaryFile() as printed:
        own = {name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "DISPLAY"))}
        own |= {"PATH": f"{PROGRAMS}{os.pathsep}{own['PATH']}", "HOME": str(folder), "ROS_IP": "127.0.0.1"}
        own |= {"ROS_HOME": f"{folder}/.ros", "ROS_MASTER_URI": f"http://127.0.0.1:{master.getsockname()[1]}"}
        name, *arguments = shlex.split(command.replace("{port}", str(port)))
        with subprocess.Popen(
            [PROGRAMS / name, *arguments], env=own, cwd=folder, stdin=subprocess.PIPE, stdout=printed,
            stderr=subprocess.STDOUT, start_new_session=True,
        ) as process:  # fmt: skip
            try:
                seconds = _signalled(process, moment_ms, number)
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
        printed.seek(0)
        return End(command, moment_ms, number, seconds, printed.read().decode(errors="replace"))


_FILES = {
    "robot.urdf": '<robot name="r"><link name="base"/></robot>',
    "node.launch": '<launch><node pkg="rostopic" type="rostopic" name="n"/></launch>',
    "map.yaml": "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n",
    "map.pgm": "P5 1 1 255\n\0",
    "test.py": "import time\ntime.sleep(1000)\n",
}


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
        return math.inf
    return time.monotonic() - began


def _spent_ms(pid: int) -> float:
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text().split()[0]) / 1e6
    except (OSError, IndexError):  # it has ended
        return math.inf


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="the command lines that contain this text")
    parser.add_argument("--moments", type=int, default=len(MOMENTS_MS))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    # A shell lets its jobs in the background ignore Ctrl-C, and programs inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    chance = random.Random(options.seed)  # noqa: S311
    trials = [
        (command, moment, number)
        for command in EVERY
        if options.only in command
        for moment in (*sorted(chance.sample(MOMENTS_MS[:-1], options.moments - 1)), WAITS_MS)
        for number in NUMBERS
    ]

    def run(trial: tuple[str, float, signal.Signals]) -> End:
        with tempfile.TemporaryDirectory() as folder:
            return end_program(*trial, Path(folder), port=20_000 + os.getpid() % 9_000)

    with ThreadPoolExecutor(2) as pool:
        ends = list(pool.map(run, trials))
    complaints = [end for end in ends if end.complaint]
    times = sorted(end.seconds for end in ends if end.seconds is not None)
    for end in complaints:
        print(end.complaint)
    programs = len({end.command for end in ends})
    print(f"{len(ends)} runs of {programs} programs, {len(times)} ended by the signal")
    if times:
        share = 100 * sum(seconds <= 0.5 for seconds in times) / len(times)
        worst = ", ".join(map(str, sorted(ends, key=lambda end: -(end.seconds or 0))[:5]))
        print(f"median {statistics.median(times):.2f} s, within 0.5 s {share:.1f} %, slowest: {worst}")
    print(f"{len(complaints)} of them wrong")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
