"""Tools on a machine in another network than the master."""

import json
from collections.abc import Iterator
from typing import Any

import pytest

from tests.support.network import FarNetwork, needs_network
from tests.support.processes import Process
from tests.support.ros import RosSystem

pytestmark = [needs_network, pytest.mark.timeout(500)]  # waits for browser tests

UNKNOWN = "robot.name.invalid"


@pytest.fixture
def network() -> Iterator[FarNetwork]:
    network = FarNetwork()
    yield network
    network.close()


class TwoMachines:
    """A master on this machine, and programs on both."""

    def __init__(self, ros: RosSystem, network: FarNetwork) -> None:
        self._ros = ros
        self._network = network
        self._uri = f"http://{network.near}:{ros.port}"
        core = self.near("roscore", "-p", str(ros.port))
        core.wait_for(r"started core service \[/rosout\]")

    def near(self, *argv: str, **variables: str) -> Process:
        """Start a program on the master's machine."""
        places = {"ROS_MASTER_URI": self._uri, "ROS_IP": self._network.near, "ROS_HOSTNAME": ""}
        return self._ros.pipros.start(*argv, **{**places, **variables})

    def far(self, *argv: str, **variables: str) -> Process:
        """Start a program on the other machine."""
        places = {"ROS_MASTER_URI": self._uri, "ROS_IP": self._network.far, "ROS_HOSTNAME": ""}
        return self._ros.pipros.start(*self._network.command(*argv), **{**places, **variables})

    def publish(self, topic: str, **variables: str) -> None:
        """Publish a text on the master's machine, until the end of the test."""
        talker = self.near(
            "rostopic", "pub", topic, "std_msgs/String", "hello", f"__name:={topic.strip('/')}", **variables
        )
        talker.wait_for("publishing and latching")

    def findings_there(self, **variables: str) -> dict[str, list[str]]:
        """Return the findings of the doctor on the other machine: the subject of each rule."""
        doctor = self.far("pipros", "doctor", "--json", **variables)
        doctor.wait(60.0)
        report: dict[str, Any] = json.loads("\n".join(doctor.stdout))
        return {found["rule"]: found["subjects"] for found in report["findings"]}


@pytest.fixture
def machines(ros: RosSystem, network: FarNetwork) -> TwoMachines:
    return TwoMachines(ros, network)


def test_tools_of_another_machine_see_the_system(machines: TwoMachines) -> None:
    machines.publish("/text")
    for command, expected in {
        "rostopic list": "/text", "rosnode list": "/text",
        "rosnode ping -c 1 /text": "rosnode: node is [/text]", "rosparam get /rosdistro": "noetic",
        "rosservice type /rosout/get_loggers": "roscpp/GetLoggers", "rosconsole list /rosout": "rosmaster",
        "rostopic echo -n 1 /text": 'data: "hello"',
    }.items():  # fmt: skip
        done = machines.far(*command.split())
        assert done.wait() == 0, done.output
        assert any(expected in line for line in done.stdout), done.output
    heard = machines.near("rostopic", "echo", "-n", "1", "/from_far")
    machines.far("rostopic", "pub", "/from_far", "std_msgs/String", "back")
    heard.wait_for("back")
    assert heard.wait() == 0
    rules = machines.findings_there().keys() - {"mixed-programs", "mixed-paths", "no-publishers"}
    assert rules == set()


def test_a_publisher_with_an_unknown_host_name_is_explained(machines: TwoMachines) -> None:
    machines.publish("/text", ROS_HOSTNAME=UNKNOWN)
    echo = machines.far("rostopic", "echo", "/text")
    echo.wait_for(rf"This machine cannot resolve the name \[{UNKNOWN}\]: set ROS_IP on the node's", 60.0)
    echo.press_ctrl_c(code=0)
    ping = machines.far("rosnode", "ping", "-c", "1", "/text")
    ping.wait()
    assert ping.stderr[0] == f"ERROR: Unknown host [{UNKNOWN}] for node [/text]"
    assert machines.findings_there()["unknown-host"] == ["/text"]
    wtf = machines.far("roswtf", "--no-plugins")
    assert wtf.wait(60.0) == 0
    assert any(line.startswith("ERROR Node [/text]") for line in wtf.stdout)


def test_an_address_that_others_cannot_reach_is_explained(machines: TwoMachines) -> None:
    assert "ip-of-another" in machines.findings_there(ROS_IP="10.99.99.99")
    assert "loopback-advertised" in machines.findings_there(ROS_IP="127.0.0.1")
    machines.publish("/text", ROS_IP="127.0.0.1")
    assert machines.findings_there()["ghost-node"] == ["/text"]
