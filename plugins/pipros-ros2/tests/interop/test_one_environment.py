"""pipros and genuine ROS 2 from PyPI in one environment: both work, and a script can use both."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros_ros2.port.draft import draft_of
from pipros_rosbag2.interfaces.installed import installed_definitions
from tests.support import documents
from tests.support.dds_peers import enable_multicast
from tests.support.environments import file_of_tests, make_tool_folder
from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Process, Processes
from tests.support.programs import make_programs
from tests.support.ros2_wheels import DISTROS, environment
from tests.support.shared_ros2 import shared_environment

pytestmark = needs_network
HALF = file_of_tests("interop/programs/half_node.py")
FIRST = "#!/usr/bin/env python3\n"
ROS1_SCRIPT = """
import os, rospy
from std_msgs.msg import String
from sensor_msgs import point_cloud2
print(f"{String('positional')} {os.environ.get('PIPROS_MESSAGES')} {point_cloud2.PointCloud2.__name__}")
"""
ROS2_SCRIPT = """
import os, rclpy
from std_msgs.msg import String
print(f"{String(data='by keyword')} {os.environ.get('PIPROS_MESSAGES')}")
"""
OTHER = """
import os
print("inherited", os.environ.get("_ROS_WHEELS_BOOTSTRAP_COMPLETE"), os.environ.get("LD_LIBRARY_PATH"))
"""
LISTENER = """
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("listener")
node.create_subscription(String, "/words", lambda message: print("heard", message.data, flush=True), 10)
rclpy.spin(node)
"""
COUNTER = """
import rclpy
from std_msgs.msg import Int32
rclpy.init()
node = rclpy.create_node("unnamed")
rate = node.declare_parameter("rate", 1.0).value
names = node.declare_parameter("names", [""]).value
gain = node.declare_parameter("gains.p", 0.0).value
print(node.get_fully_qualified_name(), rate, names, gain, flush=True)
publisher = node.create_publisher(Int32, "out", 10)
node.create_timer(1 / rate, lambda: publisher.publish(Int32(data=7)))
rclpy.spin(node)
"""
BOTH_SYSTEMS = """
<launch>
  <arg name="ros2_python"/>
  <include file="$(find pipros)/ros2_gateway.launch"/>
  <node ns="robot" pkg="programs" type="counter.py" name="counter" output="screen">
    <remap from="out" to="/numbers"/>
    <param name="rate" value="20.0"/>
    <rosparam>{names: [a, b], gains: {p: 1.5}}</rosparam>
  </node>
</launch>
"""
NUMBERS = 400
TALKER = f"""
import rospy
from std_msgs.msg import Int32
rospy.init_node("talker")
publisher = rospy.Publisher("/in", Int32, queue_size=1000)
seen = []
done = rospy.Publisher("/done", Int32, queue_size=1, latch=True)
def take(message):
    if message.data >= 0:
        seen.append(message.data)
    if message.data == {NUMBERS - 1}:
        print("lost", {NUMBERS} - len(seen), flush=True)
    if message.data == -1:
        started.set()
import threading
started = threading.Event()
rospy.Subscriber("/out", Int32, take, queue_size=1000)
while not started.wait(0.05) and not rospy.is_shutdown():
    publisher.publish(-1)
rate = rospy.Rate(200)
for number in range({NUMBERS}):
    publisher.publish(number)
    rate.sleep()
rospy.spin()
"""
LIBRARIES = """
import actionlib, rospy, tf2_ros, tf2_geometry_msgs, diagnostic_updater, cv_bridge.core, std_msgs.msg
from pipros.ros1.std_msgs.msg import Header
assert tf2_ros.Header is Header is rospy.Header
assert std_msgs.msg.Header.__module__ == "std_msgs.msg._header"
assert tf2_ros.TransformStamped().header.seq == 0
"""
USES = {
    "rospy.Publisher('/c', String, queue_size=1)": "std_msgs.msg.String",
    "rospy.Subscriber('/c', String, print)": "std_msgs.msg.String",
    "rospy.ServiceProxy('/s', SetBool)": "std_srvs.srv.SetBool",
    "rospy.Service('/s', SetBool, print)": "std_srvs.srv.SetBool",
    "rospy.Publisher('/c', rospy.Header, queue_size=1).publish(String())": "std_msgs.msg.String",
}

WAITING = """
import rospy
from std_srvs.srv import Empty
rospy.init_node("waiting")
empty = rospy.ServiceProxy("empty", Empty)
"""
UNNOTICED_END = """
import time
time.sleep(1)
handle = rclpy.get_default_context().handle
with handle:
    handle.shutdown()
"""


class Shared:
    """An environment with both, in a network of its own."""

    def __init__(self, distro: str, folder: Path, network: LoneNetwork) -> None:
        self.bin = shared_environment(distro, folder / "env")
        self.distro = distro
        self.folder = folder
        self.network = network
        tools = make_tool_folder(folder / "tools")
        self.processes = Processes(
            {
                "PATH": f"{self.bin}:{tools}", "HOME": str(folder), "ROS_HOME": str(folder / ".ros"),
                "ROS_MASTER_URI": "http://localhost:11311", "ROS_IP": "127.0.0.1", "PYTHONUNBUFFERED": "1",
                "ROS_PACKAGE_PATH": str(folder / "ws"),
            },
            folder,
        )  # fmt: skip
        other = FIRST.replace("/usr/bin/env python3", "/usr/bin/python3")
        make_programs(
            folder / "ws" / "programs",
            {
                "ros1.py": FIRST + ROS1_SCRIPT,
                "ros2.py": FIRST + ROS2_SCRIPT,
                "other.sh": "#!/bin/sh\nexec /usr/bin/python3 -c '" + OTHER + "'\n",
                "other.py": other + OTHER,
                "talker.py": FIRST + TALKER,
                "half.py": HALF.read_text(),
                "counter.py": FIRST + COUNTER,
            },
        )
        (folder / "ws" / "programs" / "both.launch").write_text(
            "<launch><node pkg='programs' type='ros1.py' name='ros1' output='screen'/>"
            "<node pkg='programs' type='ros2.py' name='ros2' output='screen'/></launch>"
        )
        (folder / "ws" / "programs" / "both_systems.launch").write_text(BOTH_SYSTEMS)
        (folder / "ws" / "programs" / "prefix.launch").write_text(
            "<launch><node pkg='programs' type='other.py' name='other' output='screen' "
            "launch-prefix='/usr/bin/python3'/></launch>"
        )
        enable_multicast(network)
        self.core = self.start("roscore")
        self.core.wait_for(r"started core service \[/rosout\]")

    def start(self, program: str, *words: str) -> Process:
        return self.processes.start(*self.network.command(str(self.bin / program), *words))

    def run(self, program: str, *words: str, **more: str) -> Process:
        argv = self.network.command(str(self.bin / program), *words)
        return self.processes.run(*argv, environment=more)

    def python(self, code: str, **more: str) -> Process:
        return self.run("python", "-c", code, **more)


@pytest.fixture(scope="module", params=DISTROS)
def shared(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared]:
    network = LoneNetwork("127.0.0.1 localhost\n")
    system = None
    try:
        system = Shared(request.param, tmp_path_factory.mktemp("shared"), network)
        yield system
    finally:
        if system is not None:
            system.processes.end_all()
        network.close()


def test_the_core_keeps_running_and_log_messages_reach_rosout(shared: Shared) -> None:
    node = shared.python(
        "import rospy; rospy.init_node('said'); rospy.logwarn('hello'); rospy.get_published_topics()"
    )
    assert node.returncode == 0, node.output
    assert shared.run("rosnode", "list").stdout == ["/rosout"]
    assert shared.core.is_running


def test_commands_show_the_types_and_sums_of_ros1(shared: Shared) -> None:
    assert shared.run("rosmsg", "md5", "std_msgs/Header").stdout == ["2176decaecbce78abc3b96ef049fabed"]
    assert shared.run("rosmsg", "show", "geometry_msgs/Quaternion").stdout[0] == "float64 x"
    found = shared.run("rospack", "find", "std_msgs").stdout[0]
    assert found.endswith("pipros/share/std_msgs")
    missing = shared.run("rosmsg", "show", "test_msgs/Strings")
    assert missing.returncode != 0
    assert "is a package of ROS 2" in missing.output


def test_messages_can_be_published_echoed_and_recorded(shared: Shared) -> None:
    publisher = shared.start("rostopic", "pub", "-r", "20", "/words", "std_msgs/String", "data: hi")
    assert shared.run("rostopic", "echo", "-n", "1", "/words").stdout[0] == 'data: "hi"'
    recorded = shared.run("rosbag", "record", "-O", "words.bag", "-l", "3", "/words")
    assert recorded.returncode == 0, recorded.output
    assert "std_msgs/String" in shared.run("rosbag", "info", "words.bag").output
    publisher.end()


@pytest.mark.parametrize("use", USES)
def test_rospy_names_the_class_of_ros2_and_both_ways_out(shared: Shared, use: str) -> None:
    imports = "import rospy; from std_msgs.msg import String; from std_srvs.srv import SetBool;"
    refused = shared.python(f"{imports} {use}")
    name = USES[use]
    assert refused.returncode == 1
    text = refused.stderr[-1]
    assert f"{name} is a class of ROS 2 ({shared.folder}/env/lib" in text
    assert "environment of its own" in text
    module, _, name = name.rpartition(".")
    assert text.endswith(f"from pipros.ros1.{module} import {name}")


def test_the_doctor_reports_the_packages_of_ros2(shared: Shared) -> None:
    doctor = ("pipros", "doctor", "--offline")
    report = shared.run(*doctor)
    assert "[ros-2-packages]" in report.output
    assert "classes from geometry_msgs, rosgraph_msgs, sensor_msgs, std_msgs and 1 more" in report.output
    assert "[ros-2-packages]" not in shared.run(*doctor, PIPROS_MESSAGES="ros1").output


def test_libraries_use_the_messages_of_ros1_while_public_names_are_those_of_ros2(shared: Shared) -> None:
    ended = shared.python(LIBRARIES)
    assert ended.returncode == 0, ended.output


def test_a_variable_gives_the_public_names_to_ros1(shared: Shared) -> None:
    ended = shared.python("from std_msgs.msg import String; print(String('x'))", PIPROS_MESSAGES="ros1")
    assert ended.stdout == ['data: "x"']
    refused = shared.python("from std_msgs.msg import String; String('x')")
    assert "takes 1 positional argument" in refused.stderr[-1]


def test_launchers_give_the_public_names_to_ros1_in_scripts_of_rospy(shared: Shared) -> None:
    ros1 = ['data: "positional" ros1 PointCloud2']
    assert shared.run("rosrun", "programs", "ros1.py").stdout == ros1
    ros2 = ["std_msgs.msg.String(data='by keyword') None"]
    assert shared.run("rosrun", "programs", "ros2.py").stdout == ros2
    launch = shared.start("roslaunch", "--no-summary", "programs", "both.launch")
    for line in (*ros1, *ros2):
        launch.wait_for(line.replace("(", r"\(").replace(")", r"\)"))


@pytest.mark.parametrize("program", ["other.sh", "other.py"])
def test_nodes_of_other_environments_do_not_inherit_the_libraries(shared: Shared, program: str) -> None:
    ended = shared.run("rosrun", "programs", program, PIPROS_INTERPRETER="script", LD_LIBRARY_PATH="/own/lib")
    assert ended.stdout == ["inherited None /own/lib"]


def test_the_python_of_a_launch_prefix_does_not_inherit_the_libraries(shared: Shared) -> None:
    launch = shared.run("roslaunch", "--no-summary", "programs", "prefix.launch")
    assert "inherited None None" in launch.output


def test_a_launch_file_has_nodes_for_rclpy_and_the_gateway(shared: Shared) -> None:
    python = environment(shared.distro) / "bin" / "python"  # another environment, without pipros
    launch = shared.start("roslaunch", "programs", "both_systems.launch", f"ros2_python:={python}")
    launch.wait_for(r"/robot/counter 20\.0 \['a', 'b'\] 1\.5")
    assert shared.run("rostopic", "echo", "-n", "1", "/numbers").stdout[0] == "data: 7"
    launch.end()


def test_the_gateway_can_use_the_rclpy_of_its_own_environment(shared: Shared) -> None:
    gateway = shared.start("pipros", "ros2", "--engine", "rclpy", "--distro", shared.distro)
    gateway.wait_for("connected to domain 0 .*, rclpy with rmw_fastrtps_cpp")
    listener = shared.start("python", "-c", LISTENER)
    publisher = shared.start("rostopic", "pub", "-r", "20", "/words", "std_msgs/String", "data: hi")
    listener.wait_for("^heard hi$")
    for process in (publisher, listener, gateway):
        process.end()


def test_a_node_that_is_half_rospy_and_half_rclpy_passes_200_messages_a_second(shared: Shared) -> None:
    half = shared.start("rosrun", "programs", "half.py")
    talker = shared.start("rosrun", "programs", "talker.py")
    talker.wait_for("^lost 0$")
    talker.end()
    half.end()


def test_the_example_of_the_document_passes_messages_to_ros2(shared: Shared) -> None:
    (example,) = re.findall(r"(?ms)^```python\n(.*?)^```", documents.text_of("guides/ros2.md"))
    processes = [
        shared.start("python", "-c", example),
        shared.start("python", "-c", LISTENER),
        shared.start("rostopic", "pub", "-r", "20", "/words", "std_msgs/String", "data: hi"),
    ]
    processes[1].wait_for("^heard hi$")
    for process in processes:
        process.end()


def test_parts_of_services_are_converted_in_both_directions(shared: Shared) -> None:
    ended = shared.python(
        "from pipros_ros2 import to_ros1, to_ros2; from pipros.ros1.std_srvs.srv import SetBoolResponse\n"
        "there = to_ros2(SetBoolResponse(True, 'é')); print(type(there).__name__, to_ros1(there).message)"
    )
    assert ended.stdout == ["SetBool_Response é"]


def test_only_messages_are_converted(shared: Shared) -> None:
    wrong = shared.python("from pipros_ros2 import to_ros2; to_ros2('text')")
    assert wrong.stderr[-1] == "TypeError: to_ros2() needs a ROS 1 message, got str"
    unknown = shared.python(
        "from pipros_ros2 import to_ros2; from pipros.ros1.nav_msgs.msg import Path; to_ros2(Path())"
    )
    assert "this environment has no ROS 2 class nav_msgs.msg.Path" in unknown.stderr[-1]


def test_a_draft_ends_if_its_callbacks_are_not_woken(shared: Shared) -> None:
    # as Ctrl-C sometimes does
    ended = shared.python(draft_of(WAITING, installed_definitions()).text + UNNOTICED_END)
    assert ended.returncode == 0, ended.output
