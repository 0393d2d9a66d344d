"""The case study on machines with several addresses and names, with pipros and genuine nodes.

Each machine is a separate network with its own /etc/hosts.
"""

from collections.abc import Iterator, Mapping

import pytest

from tests.support.network import FarNetwork, LoneNetwork, needs_network
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side

pytestmark = needs_network

HOSTS = """
127.0.0.1 localhost
127.0.1.1 laptop
10.98.0.2 robot
"""
ADDRESSES = ("10.98.0.1/24", "10.98.0.2/24")
FIRST, SECOND = "10.98.0.1", "10.98.0.2"

SAID = r"\[INFO\] \[\d+\.\d+\]: %25"
HEARD = r"\[INFO\] \[\d+\.\d+\]: Battery level of vehicle: %\d+|^heard %25 from /"

WAIT_FOR_SUBSCRIBERS = """
import sys, threading
from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
master, pause = MasterClient(Environment.from_os().master_uri, "/test"), threading.Event()
def count():
    try:
        return len(dict(master.get_system_state()[1]).get("/battery_topic", []))
    except PiprosError:  # the master is not up yet
        return 0
while count() != int(sys.argv[1]):
    pause.wait(0.02)
print("there")
"""

PLACES: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "the name of a Debian machine": ("laptop", {}),
    "loopback as on Debian": ("localhost", {"ROS_IP": "127.0.1.1"}),
    "a name that means loopback": ("localhost", {"ROS_HOSTNAME": "laptop"}),
    "an address, master as localhost": ("localhost", {"ROS_IP": FIRST}),
    "a second address, master as localhost": ("localhost", {"ROS_IP": SECOND}),
    "an address, master at it": (FIRST, {"ROS_IP": FIRST}),
    "an address, master at the other": (SECOND, {"ROS_IP": FIRST}),
    "a second address, master at the other": (FIRST, {"ROS_IP": SECOND}),
    "a name, master as localhost": ("localhost", {"ROS_HOSTNAME": "robot"}),
    "a name, master at it": ("robot", {"ROS_HOSTNAME": "robot"}),
    "a name, master at the other address": (FIRST, {"ROS_HOSTNAME": "robot"}),
}
"""The host in ROS_MASTER_URI, and the variables beside it."""

PAIRS = [
    (master, place)
    for master in ("pipros", "genuine")
    for place in PLACES
    # There a genuine master listens at 127.0.1.1 alone, so that it is not found as localhost.
    if (master, place) != ("genuine", "loopback as on Debian")
]


class Machine:
    """Programs of both sides on a machine with several addresses."""

    def __init__(self, ros: RosSystem, network: LoneNetwork, place: str) -> None:
        self.ros = ros
        self._network = network
        host, variables = PLACES[place]
        for side in (ros.pipros, ros.genuine):
            side.environment.pop("ROS_IP", None)
            side.environment.update({"ROS_MASTER_URI": f"http://{host}:{ros.port}", **variables})

    def start(self, side: Side, *argv: str) -> Process:
        return side.start(*self._network.command(*argv))

    def run(self, side: Side, *argv: str) -> Process:
        return side.run(*self._network.command(*argv), timeout_s=60)

    def start_master(self, side: Side) -> None:
        """Start `roscore` or, for genuine ROS, only the master, which starts four times as fast."""
        if side is self.ros.genuine:
            self.start(side, "rosmaster", "--core", "-p", str(self.ros.port))
        else:
            self.start(side, "roscore", "-p", str(self.ros.port))

    def start_node(self, kind: str, role: str) -> Process:
        name = f"__name:={kind}_{role}"
        if kind == "roscpp":
            genuine = self.ros.genuine
            return self.start(genuine, *genuine.node("cpp_battery", f"battery_{role}"), name)
        side = self.ros.pipros if kind == "pipros" else self.ros.genuine
        return self.start(side, *side.node("composiv_tryouts", f"composiv_{role}.py"), name)

    def wait_for_listeners(self, count: int) -> None:
        waited = self.run(self.ros.pipros, "python", "-c", WAIT_FOR_SUBSCRIBERS, str(count))
        assert waited.stdout == ["there"], waited.output


@pytest.fixture
def network() -> Iterator[LoneNetwork]:
    network = LoneNetwork(HOSTS, addresses=ADDRESSES, hostname="laptop")
    yield network
    network.close()


@pytest.mark.parametrize(("master", "place"), PAIRS)
def test_listeners_started_first_hear_all_talkers(network, ros: RosSystem, master: str, place: str) -> None:
    machine = Machine(ros, network, place)
    machine.start_master(ros.pipros if master == "pipros" else ros.genuine)
    listeners = {kind: machine.start_node(kind, "listener") for kind in ("pipros", "rospy", "roscpp")}
    machine.wait_for_listeners(3)
    for kind in ("rospy", "pipros"):
        marks = [listener.mark() for listener in listeners.values()]
        talker = machine.start_node(kind, "talker")
        for listener, mark in zip(listeners.values(), marks, strict=True):
            listener.wait_for(HEARD, since=mark)
        if (master, kind) == ("pipros", "pipros"):
            called = machine.run(ros.pipros, "rosservice", "call", "/pipros_talker/get_loggers")
            assert "level:" in called.output
        talker.press_ctrl_c()
        assert talker.wait() == 0
    if master == "pipros":
        assert "which is an address of neither the master" not in listeners["pipros"].output
        killed = machine.run(ros.pipros, "rosnode", "kill", "/pipros_listener")
        assert killed.stdout[-1:] == ["killed"]
        assert listeners["pipros"].wait() == 0


@pytest.mark.parametrize("place", PLACES)
def test_a_launch_file_brings_up_master_and_nodes(network: LoneNetwork, ros: RosSystem, place: str) -> None:
    machine = Machine(ros, network, place)
    launch = machine.start(ros.pipros, "roslaunch", "composiv_tryouts", "composiv_tryout.launch", "--screen")
    launch.wait_for("auto-starting new master")
    launch.wait_for(SAID)
    launch.wait_for(HEARD)
    launch.press_ctrl_c()
    assert launch.wait() == 0


@pytest.fixture
def far() -> Iterator[FarNetwork]:
    network = FarNetwork()
    yield network
    network.close()


@pytest.mark.parametrize("listener", ["pipros", "rospy"])
def test_a_master_in_another_network_namespace_that_calls_from_another_address(far, ros, listener) -> None:
    """A master as in a container: it is reached at one address, and calls from another."""
    second = far.give_second_address()
    uri = f"http://{second}:{ros.port}"
    core = ros.pipros.start(*far.command("roscore", "-p", str(ros.port)), ROS_IP=second, ROS_MASTER_URI=uri)
    core.wait_for(r"started core service \[/rosout\]")
    for side in (ros.pipros, ros.genuine):
        side.environment.update({"ROS_MASTER_URI": uri, "ROS_IP": far.near})
    ros.master_uri = uri
    side = ros.pipros if listener == "pipros" else ros.genuine
    hearing = side.start_node("composiv_tryouts", "composiv_listener.py")
    ros.wait_for_subscriber("/battery_topic")
    ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py").wait_for(SAID)
    hearing.wait_for(HEARD)
    if listener == "pipros":
        hearing.wait_for(rf"publisherUpdate of \[/master\] came from {far.far}, which is an address of")
