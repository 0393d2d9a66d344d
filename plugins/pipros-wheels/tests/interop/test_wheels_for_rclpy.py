"""`pipros wheel --ros2` makes wheels that genuine rclpy uses, and whose types the gateway passes.

# needs the plugins: ros2
"""

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support.dds_peers import enable_multicast
from tests.support.environments import EXAMPLES, VENV_BIN
from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Process, Processes
from tests.support.ros2_wheels import DISTROS, environment

pytestmark = [needs_network, pytest.mark.timeout(400)]  # two dozen files are compiled
PACKAGES = (EXAMPLES / "vehicle_battery", EXAMPLES / "composiv_tryouts", "tf2_msgs", "example_interfaces")
ROS2_NODE = """
import rclpy
from composiv_tryouts.msg import BatteryLevel
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from geometry_msgs.msg import TransformStamped
from rclpy.action import ActionServer
from tf2_msgs.msg import TFMessage
from vehicle_battery.msg import BatteryWarning

def warn(message):
    warning = BatteryWarning(level=BatteryWarning.LOW, text=f"heard {message.battery}")
    warning.header.frame_id = "base"
    warning.header.stamp.sec = 12
    publisher.publish(warning)
    frame = TransformStamped(child_frame_id="battery")
    frame.header.frame_id = "base"
    frame.transform.translation.x = 1.5
    transforms.publish(TFMessage(transforms=[frame]))

def add(request, response):
    response.sum = request.a + request.b
    return response

def count(goal):
    goal.publish_feedback(Fibonacci.Feedback(sequence=[0]))
    goal.succeed()
    return Fibonacci.Result(sequence=list(range(goal.request.order)))

rclpy.init()
node = rclpy.create_node("rclpy_battery")
publisher = node.create_publisher(BatteryWarning, "/warning", 10)
transforms = node.create_publisher(TFMessage, "/tf", 10)
node.create_subscription(BatteryLevel, "/battery", warn, 10)
node.create_service(AddTwoInts, "/add", add)
server = ActionServer(node, Fibonacci, "/count", count)
rclpy.spin(node)
"""
ROS1_NODE = """
import actionlib, rospy
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal
from composiv_tryouts.msg import BatteryLevel
from rospy_tutorials.srv import AddTwoInts
from tf2_msgs.msg import TFMessage
from vehicle_battery.msg import BatteryWarning

def show(message):
    print(message.header.frame_id, message.header.stamp.secs, message.level, message.text, flush=True)

def show_frame(message):
    frame = message.transforms[0]
    print("frame", frame.child_frame_id, frame.transform.translation.x, flush=True)

rospy.init_node("talker")
publisher = rospy.Publisher("/battery", BatteryLevel, queue_size=10)
rospy.Subscriber("/warning", BatteryWarning, show)
rospy.Subscriber("/tf", TFMessage, show_frame)
rospy.Timer(rospy.Duration(0.1), lambda event: publisher.publish("87 %"))
rospy.wait_for_service("/add")
print("sum", rospy.ServiceProxy("/add", AddTwoInts)(20, 22).sum, flush=True)
client = actionlib.SimpleActionClient("/count", FibonacciAction)
client.wait_for_server()
client.send_goal_and_wait(FibonacciGoal(order=4))
print("result", *client.get_result().sequence, flush=True)
rospy.spin()
"""


@dataclass(frozen=True, slots=True)
class Built:
    """Wheels of a distribution, and the output of the command that built them."""

    distro: str
    python: Path
    output: str
    files: list[str]


@pytest.fixture(scope="module", params=DISTROS)
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Built:
    distro, folder = request.param, tmp_path_factory.mktemp("rclpy")
    cache = folder / ".ros" / "pipros"
    cache.mkdir(parents=True)
    (cache / f"ros2_{distro}_{sys.implementation.cache_tag}").symlink_to(environment(distro))
    made = subprocess.run(
        [VENV_BIN / "pipros", "wheel", "--ros2", distro, "-o", folder / "dist", *PACKAGES],
        env={"PATH": "/usr/bin:/bin", "HOME": str(folder), "ROS_HOME": str(folder / ".ros")},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    files = made.stdout.splitlines()
    copy = "-al" if environment(distro).stat().st_dev == folder.stat().st_dev else "-a"
    subprocess.run(["cp", copy, environment(distro), folder / "env"], check=True)
    python = folder / "env" / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", "--quiet")
    subprocess.run([*pip, *files], check=True)
    return Built(distro, python, made.stderr, files)


@pytest.fixture
def talker(built: Built, tmp_path: Path) -> Iterator[Process]:
    """Run a node on each side of a gateway that is given no definitions, and return the node of ROS 1."""
    network = LoneNetwork("127.0.0.1 localhost\n")
    processes = Processes(
        {
            "PATH": f"{VENV_BIN}:/usr/bin:/bin", "HOME": str(tmp_path), "ROS_HOME": str(tmp_path / ".ros"),
            "ROS_MASTER_URI": "http://localhost:11311", "ROS_IP": "127.0.0.1",
            "ROS_PACKAGE_PATH": str(EXAMPLES),
        },
        tmp_path,
    )  # fmt: skip
    try:
        enable_multicast(network)
        processes.start(*network.command(str(VENV_BIN / "rosmaster"), "--core"))
        gateway = network.command(str(VENV_BIN / "pipros"), "ros2", "--domain", "0", "--distro", built.distro)
        processes.start(*gateway).wait_for("connected to domain")
        # Programs that were killed leave files in the shared memory, which all networks have in common.
        private = 'mount -t tmpfs shm /dev/shm && exec "$@"'
        processes.start(*network.command("/bin/sh", "-c", private, "sh", str(built.python), "-c", ROS2_NODE))
        yield processes.start(*network.command(sys.executable, "-u", "-c", ROS1_NODE))
    finally:
        processes.end_all()
        network.close()


def test_each_change_to_a_definition_is_printed(built: Built) -> None:
    line = "vehicle_battery/BatteryWarning: std_msgs/Header header becomes std_msgs/Header without seq"
    assert built.output.splitlines() == [line]


def test_messages_services_and_actions_pass_the_gateway_without_its_option_msgs(talker: Process) -> None:
    for line in ("^base 12 1 heard 87 %$", r"^frame battery 1\.5$", "^sum 42$", "^result 0 1 2 3$"):
        talker.wait_for(line)
