"""Foxglove's client library and decoder for Node.js, with nodes of pipros and genuine rospy and roscpp."""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pipros_bridges.foxglove.handler import SUBPROTOCOLS
from tests.support.bridge_clients import MODULES
from tests.support.genuine import missing_packages
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "foxglove_client.cjs"
SIDES = ["pipros", *([] if missing_packages() else ["genuine"])]


class NodeClient:
    """The client program."""

    def __init__(self, ros: RosSystem, address: str, subprotocol: str = SUBPROTOCOLS[0]) -> None:
        self.process = ros.pipros.processes.start(
            str(shutil.which("node")), PROGRAM, address, subprotocol, stdin=subprocess.PIPE,
            environment={"NODE_PATH": str(MODULES)},
        )  # fmt: skip

    def order(self, order: str, **fields: Any) -> None:
        self.process.write_line(json.dumps({"order": order, **fields}))

    def wait_for(self, event: str, check: Callable[[Any], Any] = lambda _: True) -> Any:
        """Wait for an event that meets a condition, and return it."""

        def find() -> Any:
            events = (json.loads(line) for line in list(self.process.stdout))
            return next((each for each in events if each["event"] == event and check(each)), None)

        wait_until(lambda: find() is not None, 60)
        return find()


def served(ros: RosSystem, *options: str) -> str:
    """Start `pipros foxglove` and return its address."""
    server = ros.pipros.start("pipros", "foxglove", "--port", "0", *options)
    return server.wait_for(r"ws://\S+")[0]


@pytest.mark.parametrize("subprotocol", SUBPROTOCOLS)
@pytest.mark.parametrize("side", SIDES)
def test_topics_and_services_of_each_implementation(ros: RosSystem, side: str, subprotocol: str) -> None:
    ros.serve_master()
    nodes = ros.genuine if side == "genuine" else ros.pipros
    nodes.start("rostopic", "pub", "-r", "20", "/chatter", "std_msgs/String", "data: hello")
    nodes.start_node("topic_tools", "relay", "/chatter", "/relayed", "__name:=relay_out")
    nodes.start_node("topic_tools", "relay", "/from_client", "/echoed", "__name:=relay_back")
    nodes.start_node("topic_tools", "mux", "/selected", "/chatter", "/other", "__name:=mux")
    client = NodeClient(ros, served(ros, "--control"), subprotocol)
    assert client.wait_for("open")["protocol"] == subprotocol

    for topic in ("/chatter", "/relayed"):
        client.wait_for("channel", lambda each, topic=topic: each["topic"] == topic)
        client.order("subscribe", topic=topic)
        received = client.wait_for("message", lambda each, topic=topic: each["topic"] == topic)
        assert received["message"] == {"data": "hello"}

    client.order(
        "publish", topic="/from_client", type="std_msgs/String", definition="string data",
        message={"data": "from the client"},
    )  # fmt: skip
    client.wait_for("channel", lambda each: each["topic"] == "/echoed")
    client.order("subscribe", topic="/echoed")
    echoed = client.wait_for("message", lambda each: each["topic"] == "/echoed")
    assert echoed["message"] == {"data": "from the client"}

    client.wait_for("service", lambda each: each["name"] == "/mux/list")
    client.order("call", name="/mux/list", request={}, callId=1)
    assert client.wait_for("response")["response"]["topics"] == ["/chatter", "/other"]
    client.order("call", name="/mux/select", request={"topic": "/other"}, callId=2)
    answer = client.wait_for("response", lambda each: each["callId"] == 2)
    assert answer["response"] == {"prev_topic": "/chatter"}
    client.order("call", name="/mux/select", request={"topic": "/nothing"}, callId=3)
    client.wait_for("failure", lambda each: each["callId"] == 3)
    client.order("graph")
    graph = client.wait_for("graph")["graph"]
    assert "/relayed" in [each["name"] for each in graph["publishedTopics"]]


def test_parameters_and_assets(ros: RosSystem, tmp_path: Path) -> None:
    ros.serve_master()
    package = tmp_path / "ws" / "my_robot"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_robot</name></package>")
    (package / "robot.urdf").write_text("<robot/>")
    server = ros.pipros.start(
        "pipros", "foxglove", "--port", "0", "--control", ROS_PACKAGE_PATH=str(tmp_path / "ws")
    )
    client = NodeClient(ros, server.wait_for(r"ws://\S+")[0])
    client.wait_for("open")
    client.order("subscribeParameters", names=["/speed"])
    parameters = [{"name": "/speed", "value": 1.5, "type": "float64"}]
    client.order("setParameters", parameters=parameters, id="a")
    assert client.wait_for("parameters", lambda each: each.get("id") == "a")["parameters"] == parameters
    assert ros.pipros.run("rosparam", "get", "/speed").stdout == ["1.5"]
    ros.pipros.run("rosparam", "set", "/speed", "2.5")
    client.wait_for("parameters", lambda each: "id" not in each and each["parameters"][0]["value"] == 2.5)
    client.order("asset", uri="package://my_robot/robot.urdf", requestId=4)
    assert client.wait_for("asset") == {"event": "asset", "requestId": 4, "status": 0, "text": "<robot/>"}


def test_the_launch_file_has_the_arguments_of_the_genuine_one(ros: RosSystem) -> None:
    ros.serve_master()
    launch = ros.pipros.start(
        "roslaunch", "foxglove_bridge", "foxglove_bridge.launch", "port:=0", "topic_whitelist:=['/chat.*']",
        "send_buffer_limit:=1000000", "capabilities:=[clientPublish,services]",
    )  # fmt: skip
    ros.pipros.start("rostopic", "pub", "-r", "20", "/chatter", "std_msgs/String", "data: hello")
    ros.pipros.start("rostopic", "pub", "-r", "20", "/hidden", "std_msgs/String", "data: hello")
    client = NodeClient(ros, launch.wait_for(r"ws://\S+")[0])
    info = client.wait_for("info")["info"]
    assert info["capabilities"] == ["clientPublish", "services"]
    client.wait_for("channel", lambda each: each["topic"] == "/chatter")
    assert not any("/hidden" in line for line in client.process.stdout)
    launch.press_ctrl_c()
    client.wait_for("close")
    assert launch.wait() == 0
