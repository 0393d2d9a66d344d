"""`pipros ros2` with peers on Fast DDS and Cyclone DDS, which have the conventions of ROS 2's middlewares."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.dds_peers import DOMAIN, Peers
from tests.support.network import needs_network
from tests.support.processes import Process
from tests.support.waiting import wait_until

pytestmark = needs_network

KINDS = ["fast-udp", "cyclone"]
LIMIT_S = 60
RULES = """
topics: {to_ros1: {allow: [/back]}}
services: {to_ros1: {allow: [/add]}, to_ros2: {allow: [/sum]}}
actions: {to_ros1: {allow: [/fibonacci]}, to_ros2: {allow: [/fibonacci]}}
"""
Run = Callable[..., Process]


@pytest.fixture
def ros(peers: Peers, tmp_path: Path) -> Run:
    """Start commands of pipros in the network of the peers, with a master and a gateway."""
    package = tmp_path / "packages" / "example_interfaces"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>example_interfaces</name></package>")
    (package / "msg" / "Blob.msg").write_text("uint32 number\nuint8[] data\n")
    (tmp_path / "rules.yaml").write_text(RULES)
    variables = [
        f"ROS_HOME={tmp_path}", f"ROS_PACKAGE_PATH={package.parent}", "ROS_MASTER_URI=http://localhost:11311",
        "ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET", "PYTHONUNBUFFERED=1",
    ]  # fmt: skip

    def run(command: str, *words: object) -> Process:
        return peers.run("env", *variables, Path(sys.executable).parent / command, *words)

    run("rosmaster", "--core")
    gateway = run(
        *("pipros", "ros2", "--domain", DOMAIN, "--distro", "humble"),
        *("--rules", tmp_path / "rules.yaml", "--msgs", package.parent),
    )
    gateway.wait_for("connected to domain", LIMIT_S)
    return run


@pytest.mark.parametrize("kind", KINDS)
def test_topics_of_ros1_reach_the_peer(peers: Peers, ros: Run, kind: str) -> None:
    reader = peers.start(kind, "sub", "rt/chatter", "reliable")
    ros("rostopic", "pub", "-r", "10", "/chatter", "example_interfaces/Blob", "{number: 7, data: [7, 7, 7]}")

    wait_until(lambda: "got 7 3" in reader.output, LIMIT_S, lambda: reader.output[-300:])


@pytest.mark.parametrize("kind", KINDS)
def test_latched_topics_of_ros1_reach_late_peers(peers: Peers, ros: Run, kind: str) -> None:
    ros("rostopic", "pub", "-l", "/chatter", "example_interfaces/Blob", "{number: 5, data: [5, 5]}")

    for _ in range(2):  # the second one is late
        peers.start(kind, "sub", "rt/chatter", "latched").wait_for("^got 5 2$", LIMIT_S)


@pytest.mark.parametrize("kind", KINDS)
def test_topics_of_the_peer_reach_ros1(peers: Peers, ros: Run, kind: str) -> None:
    peers.start(kind, "pub", "rt/back", 3, 2, 1000, "reliable")
    echo = ros("rostopic", "echo", "/back")

    wait_until(lambda: "number: 2" in echo.output, LIMIT_S, lambda: echo.output[-300:])


@pytest.mark.parametrize("kind", KINDS)
def test_latched_topics_of_the_peer_reach_ros1(peers: Peers, ros: Run, kind: str) -> None:
    peers.start(kind, "pub", "rt/back", 1, 2, 1000, "latched").wait_for("published", LIMIT_S)
    echo = ros("rostopic", "echo", "/back")

    wait_until(lambda: "number: 0" in echo.output, LIMIT_S, lambda: echo.output[-300:])


@pytest.mark.parametrize("kind", KINDS)
def test_services_of_the_peer_are_called_from_ros1(peers: Peers, ros: Run, kind: str) -> None:
    peers.start(kind, "server", "/sum").wait_for("ready", LIMIT_S)

    call = ros("rosservice", "call", "--wait", "/sum", "20", "22")

    wait_until(lambda: "sum: 42" in call.output, LIMIT_S, lambda: call.output[-300:])


@pytest.mark.parametrize("kind", KINDS)
def test_services_of_ros1_are_called_by_the_peer(peers: Peers, ros: Run, kind: str) -> None:
    ros("rosrun", "rospy_tutorials", "add_two_ints_server", "add_two_ints:=/add")

    client = peers.start(kind, "client", "/add", 20)

    wait_until(lambda: "right 20" in client.output, LIMIT_S, lambda: client.output[-300:])


@pytest.mark.parametrize("kind", KINDS)
def test_actions_of_the_peer_are_used_from_ros1(peers: Peers, ros: Run, kind: str) -> None:
    server = peers.start(kind, "action-server", "/fibonacci")
    server.wait_for("ready", LIMIT_S)

    client = ros("rosrun", "actionlib_tutorials", "fibonacci_client.py")

    wait_until(lambda: "Result: 0, 1, 1, 2, 3, 5" in client.output, LIMIT_S, lambda: client.output[-300:])
    server.wait_for("^goal 20$")


@pytest.mark.parametrize("kind", KINDS)
def test_actions_of_ros1_are_used_and_cancelled_by_the_peer(peers: Peers, ros: Run, kind: str) -> None:
    ros("rosrun", "actionlib_tutorials", "fibonacci_server.py")

    client = peers.start(kind, "action-client", "/fibonacci", 2, "finish")
    wait_until(lambda: "result 4: 0 1 1" in client.output, LIMIT_S, lambda: client.output[-300:])
    for line in ("accepted 1", "feedback 3", "status 4"):  # each is sent on its own topic or service
        client.wait_for(f"^{line}$", LIMIT_S)

    client = peers.start(kind, "action-client", "/fibonacci", 40, "cancel")
    wait_until(lambda: "result 5:" in client.output, LIMIT_S, lambda: client.output[-300:])
    client.wait_for("^cancelling 0 of 1$", LIMIT_S)
