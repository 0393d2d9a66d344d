"""ROS_IPV6=on: pipros, genuine rospy and roscpp nodes communicate over IPv6, with both masters.

Genuine nodes use names that resolve to an IPv6 address, so the tests run in a separate network that has one.
"""

import textwrap
from collections.abc import Iterator

import pytest

from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side

pytestmark = needs_network

HOSTS = """
127.0.0.1 localhost
::1 localhost robot
"""
TALKER = """
    import sys, rospy
    from composiv_tryouts.msg import BatteryLevel
    rospy.init_node(sys.argv[1])
    publisher = rospy.Publisher("battery_topic", BatteryLevel, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish("%25")
        rate.sleep()
"""
LISTENER = """
    import sys, rospy
    from composiv_tryouts.msg import BatteryLevel
    def hear(message):
        print("heard", message.battery, "from", message._connection_header["callerid"], flush=True)
    rospy.init_node(sys.argv[1])
    rospy.Subscriber("battery_topic", BatteryLevel, hear)
    rospy.spin()
"""
KINDS = ("pipros", "rospy", "roscpp")


class Scene:
    """Programs of both sides in their own network."""

    def __init__(self, ros: RosSystem, network: LoneNetwork, host: str) -> None:
        self.ros = ros
        self._network = network
        for side in (ros.pipros, ros.genuine):
            side.environment.pop("ROS_IP", None)
            side.environment.update(
                {"ROS_IPV6": "on", "ROS_HOSTNAME": host, "ROS_MASTER_URI": f"http://{host}:{ros.port}"}
            )

    def start_master(self, side: Side) -> None:
        """Start `roscore` or, for genuine ROS, only the faster-starting master; nodes wait for it."""
        if side is self.ros.genuine:
            self._start(side, "rosmaster", "--core", "-p", str(self.ros.port))
        else:
            self._start(side, "roscore", "-p", str(self.ros.port))

    def start_node(self, kind: str, role: str) -> Process:
        name = f"{kind}_{role}"
        if kind == "roscpp":
            program = (*self.ros.genuine.node("cpp_battery", f"battery_{role}"), f"__name:={name}")
            return self._start(self.ros.genuine, *program)
        file = self.ros.home / f"{role}.py"
        file.write_text(textwrap.dedent(TALKER if role == "talker" else LISTENER))
        side = self.ros.pipros if kind == "pipros" else self.ros.genuine
        return self._start(side, "python" if kind == "pipros" else "/usr/bin/python3", str(file), name)

    def run(self, side: Side, *argv: str) -> str:
        return side.run(*self._network.command(*argv), timeout_s=60).output

    def _start(self, side: Side, *argv: str) -> Process:
        return side.start(*self._network.command(*argv))


@pytest.fixture
def network() -> Iterator[LoneNetwork]:
    network = LoneNetwork(HOSTS)
    yield network
    network.close()


@pytest.mark.parametrize("host", ["localhost", "robot"])
@pytest.mark.parametrize("master", ["pipros", "genuine"])
def test_topics_and_services(network: LoneNetwork, ros: RosSystem, master: str, host: str) -> None:
    scene = Scene(ros, network, host)
    scene.start_master(ros.pipros if master == "pipros" else ros.genuine)
    for kind in KINDS:
        scene.start_node(kind, "talker")
    listeners = [scene.start_node(kind, "listener") for kind in KINDS]

    for listener in listeners:
        for kind in KINDS:
            listener.wait_for(rf"heard %\d+ from /{kind}_talker")
    # Genuine tools reach genuine services if their addresses are right, which the links have shown.
    for side, kinds in ((ros.pipros, KINDS), (ros.genuine, ("pipros",))):
        for kind in kinds:
            assert "level:" in scene.run(side, "rosservice", "call", f"/{kind}_talker/get_loggers")


def test_nodes_of_pipros_without_a_name_work_with_genuine_ones(network: LoneNetwork, ros: RosSystem) -> None:
    scene = Scene(ros, network, "localhost")
    del ros.pipros.environment["ROS_HOSTNAME"]
    scene.start_master(ros.pipros)
    scene.start_node("pipros", "talker")
    for kind in KINDS:
        scene.start_node(kind, "listener").wait_for(r"heard %\d+ from /pipros_talker")
    connections = scene.run(ros.genuine, "ss", "--tcp", "--numeric", "--no-header")
    assert "[::1]:" in connections
    assert "127.0.0.1" not in connections
