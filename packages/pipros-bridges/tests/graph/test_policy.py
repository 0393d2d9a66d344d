"""A policy in front of rosbridge, Foxglove and the page: what it does not allow reaches no node."""

import json
import math
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_bridges.foxglove.parameters import flattened
from pipros_bridges.rosbridge.globs import Globs
from pipros_bridges.rosbridge.server import ServerOptions
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.stream_servers import TcpServer
from pipros_bridges.rosbridge.udp_server import UdpServer
from pipros_server.act_gate import ActGate
from pipros_server.policy.model import ActRefused
from pipros_server.policy.policy_file import parse_policy
from tests.graph.running import running
from tests.support.foxglove import connected, serving
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.rosbridge import RosbridgeClient, rosbridge_server
from tests.support.waiting import wait_until

TWIST: Any = load_message_class("geometry_msgs/Twist")
JOY: Any = load_message_class("sensor_msgs/Joy")
BOOL: Any = load_message_class("std_msgs/Bool")
SET_BOOL: Any = load_service_class("std_srvs/SetBool")
TEXT = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-0.3, 0.3], unit: m/s}}
    per_minute: 5
services:
  /motor: {type: std_srvs/SetBool, fields: {data: {one_of: [false]}}}
parameters:
  /speed: {type: double, range: [0, 1]}
"""
POLICY = parse_policy(TEXT, "p.yaml")
GUARDED = parse_policy(
    """\
topics: {/cmd_vel: {type: geometry_msgs/Twist, fields: any, requires: held, stop: zero}}
conditions: {held: {topic: /joy, type: sensor_msgs/Joy, field: "buttons[0]", one_of: [1], max_age_s: 60}}
""",
    "guarded.yaml",
)
RULE = "p.yaml:4: topics./cmd_vel.fields.linear.x"


@pytest.fixture
def robot(make_node: MakeNode) -> Node:
    return make_node("robot")


@pytest.fixture
def driven(robot: Node) -> Inbox:
    """The commands that reach the robot."""
    inbox = Inbox()
    robot.subscribe("/cmd_vel", TWIST, inbox)
    return inbox


@pytest.fixture
def url(make_node: MakeNode) -> Iterator[str]:
    with rosbridge_server(make_node("bridge"), settings=RosbridgeSettings(policy=POLICY)) as found:
        yield found


@pytest.fixture
def client(url: str) -> Iterator[RosbridgeClient]:
    with RosbridgeClient(url) as found:
        yield found


def drive(client: RosbridgeClient, x: object, topic: str = "/cmd_vel", **more: Any) -> None:
    values = {"linear": {"x": x}, **more}
    client.send("publish", topic=topic, msg=values, type="geometry_msgs/Twist")


def refusal(client: RosbridgeClient) -> str:
    text = client.wait_for("status", level="error")["msg"]
    assert isinstance(text, str)
    return text


def test_rosbridge_publishes_what_is_inside_the_ranges_and_nothing_else(
    driven: Inbox, client: RosbridgeClient
) -> None:
    client.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist")
    drive(client, 0.3)
    for bad in (0.31, math.nextafter(0.3, 1), 1e300):
        drive(client, bad)
        assert f"linear.x of /cmd_vel must be from -0.3 to 0.3 m/s, got {bad:g} m/s ({RULE})" in refusal(
            client
        )
    drive(client, math.nan)
    assert f"linear.x of /cmd_vel must be a finite number, got nan ({RULE})" in refusal(client)
    drive(client, 0.0, angular={"z": 0.1})
    assert "angular.z of /cmd_vel has no rule and must be zero or empty" in refusal(client)
    drive(client, -0.3)
    assert [message.linear.x for message in driven.wait(2)] == [0.3, -0.3]


@pytest.mark.parametrize("topic", ["/cmd_v\u0435l", "/other", "/cmd_vel/x", "~cmd_vel"])
def test_a_topic_with_a_similar_name_is_not_advertised(
    robot: Node, topic: str, client: RosbridgeClient
) -> None:
    client.send("advertise", topic=topic, type="geometry_msgs/Twist")
    refusal(client)
    topics = {name for name, _ in robot.master.get_system_state()[0]}
    assert not topics & {"/other", "/cmd_vel/x", "/bridge/cmd_vel"}


def test_relative_names_and_doubled_slashes_are_the_names_that_they_stand_for(
    driven: Inbox, client: RosbridgeClient
) -> None:
    for topic in ("cmd_vel", "//cmd_vel"):
        drive(client, 0.1, topic)
        drive(client, 0.4, topic)
        assert RULE in refusal(client)
    assert len(driven.wait(2)) == 2


def test_a_remapping_of_the_server_does_not_lead_around_the_policy(
    make_node: MakeNode, driven: Inbox
) -> None:
    bridge = make_node("bridge", argv=["/cmd_vel:=/other", "/allowed:=/cmd_vel"])
    with (
        rosbridge_server(bridge, settings=RosbridgeSettings(policy=POLICY)) as url,
        RosbridgeClient(url) as client,
    ):
        client.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist")
        assert "the policy has no rule for the topic /other" in refusal(client)
        client.send("advertise", topic="/allowed", type="geometry_msgs/Twist")
        assert "the policy has no rule for the topic /other" in refusal(client)


def test_a_remapping_of_the_server_does_not_let_clients_publish_a_condition(make_node: MakeNode) -> None:
    text = (
        "topics:\n  /allowed: {type: std_msgs/Bool, fields: any, requires: [b]}\n"
        "conditions:\n  b: {topic: /joy, type: std_msgs/Bool, field: data, one_of: [true], max_age_s: 1}\n"
    )
    bridge = make_node("bridge", argv=["/joy:=/allowed"])
    with pytest.raises(ActRefused, match="the condition b reads /allowed after remapping"):
        ActGate(bridge, parse_policy(text, "p.yaml"))


def test_a_latched_message_over_a_new_connection_is_as_old_as_before(make_node: MakeNode) -> None:
    text = (
        "topics: {/cmd_vel: {type: geometry_msgs/Twist, fields: any, requires: b, stop: zero}}\n"
        "conditions: {b: {topic: /joy, type: std_msgs/Bool, field: data, one_of: [true], max_age_s: 60}}\n"
    )
    now_s, moving = 0.0, TWIST()
    moving.linear.x = 0.1
    bridge = make_node("bridge")
    gate = ActGate(bridge, parse_policy(text, "p.yaml"), clock_s=lambda: now_s)
    gate.start()

    def is_allowed() -> bool:
        with suppress(ActRefused):
            gate.check_message("/cmd_vel", moving)
            return True
        return False

    try:
        first = make_node("robot")
        first.advertise("/joy", BOOL, latch=True).publish(BOOL(True))
        wait_until(is_allowed)
        now_s = 59.0
        first.shutdown("it restarts")
        again = make_node("second").advertise("/joy", BOOL, latch=True)
        again.publish(BOOL(True))
        other = Inbox()
        bridge.subscribe("/joy", BOOL, other)
        other.wait(1)
        now_s = 61.0
        with pytest.raises(ActRefused, match=r"the last message on /joy is 61\.0 s old"):
            gate.check_message("/cmd_vel", moving)
        third = make_node("third").advertise("/joy", BOOL, latch=True)
        for publisher in (again, third, again, third):  # publishers that alternate send new messages, too
            now_s += 40
            count = len(other.messages)
            publisher.publish(BOOL(True))
            other.wait(count + 1)
        assert is_allowed()
    finally:
        gate.close()


def test_two_clients_share_the_count_and_advertising_again_does_not_renew_it(url: str, robot: Node) -> None:
    driven: list[float] = []  # the end of an advertisement stops the robot, which does not count

    def drives(message: Any) -> None:
        driven.extend(filter(None, [message.linear.x]))

    commands = robot.subscribe("/cmd_vel", TWIST, drives)
    with RosbridgeClient(url) as one, RosbridgeClient(url) as two:
        for client, count in zip((one, two) * 3, (1, 2, 3, 4, 5, 5), strict=True):
            client.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist")
            wait_until_connected(commands)
            drive(client, 0.1)
            wait_until(lambda count=count: len(driven) == count)
            client.send("unadvertise", topic="/cmd_vel")
        assert "/cmd_vel exceeds the limit of 5 per minute (p.yaml:2: topics./cmd_vel)" in refusal(two)
    with RosbridgeClient(url) as three:
        drive(three, 0.1)
        assert "the limit of 5 per minute" in refusal(three)


def test_rosbridge_calls_services_with_the_permitted_values_only(
    robot: Node, client: RosbridgeClient
) -> None:
    calls: list[bool] = []

    def motor(request: Any) -> Any:
        calls.append(request.data)
        return SET_BOOL._response_class(True, "")

    for name in ("/motor", "/other"):
        robot.serve(name, SET_BOOL, motor)
    assert client.call("/motor", {"data": False})["result"] is True
    answer = client.call("/motor", {"data": True})
    assert (answer["result"], "data of /motor must be one of False; got True" in answer["values"]) == (
        False,
        True,
    )
    assert "the policy has no rule for the service /other" in client.call("/other", {"data": False})["values"]
    client.send("advertise_service", service="/new", type="std_srvs/SetBool")
    assert "the policy does not let clients offer services" in refusal(client)
    assert calls == [False]


def test_rosapi_sets_the_permitted_parameters_only(ros: RosSystem, tmp_path: Path) -> None:
    ros.serve_master()
    (tmp_path / "p.yaml").write_text(TEXT)
    server = ros.pipros.start("pipros", "serve", "--port", "0", "--control", "--policy", tmp_path / "p.yaml")
    url = server.wait_for(r"ws://\S+")[0]
    with RosbridgeClient(url) as client:
        half = {"name": "/speed", "value": "0.5"}
        wait_until(lambda: client.call("/rosapi/set_param", half)["result"])
        for name, value, text in (
            ("/speed", "1.5", "/speed must be from 0 to 1, got 1.5"),
            ("/speed", "NaN", "/speed must be a finite number"),
            ("/", '{"speed": 2}', "the policy has no rule for the parameter /"),
            ("speed", "0.5", "name must be a global name, got speed"),
        ):
            assert text in client.call("/rosapi/set_param", {"name": name, "value": value})["values"]
        assert client.call("/rosapi/get_param", {"name": "/speed"})["values"]["value"] == "0.5"
        deleted = client.call("/rosapi/delete_param", {"name": "/speed"})
        assert "the policy has no rule for the service /rosapi/delete_param" in deleted["values"]


def test_globs_must_allow_what_the_policy_allows(make_node: MakeNode) -> None:
    settings = RosbridgeSettings(topics=Globs(["/scan"]), policy=POLICY)
    with rosbridge_server(make_node("bridge"), settings=settings) as url, RosbridgeClient(url) as client:
        drive(client, 0.1)
        assert "clients may not use /cmd_vel" in refusal(client)


@pytest.mark.parametrize("words", [["pipros", "serve", "--port", "0"], ["rqt_graph", "--no-browser"]])
def test_a_server_says_that_a_policy_needs_control(words: list[str], ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text(TEXT)
    ros.serve_master()
    server = ros.pipros.start(*words, "--policy", tmp_path / "p.yaml")
    server.wait_for("With --control,? (they|it) can also do what the policy permits.")


def test_without_control_a_policy_allows_nothing(make_node: MakeNode) -> None:
    settings = RosbridgeSettings(has_control=False, policy=POLICY)
    with rosbridge_server(make_node("bridge"), settings=settings) as url, RosbridgeClient(url) as client:
        drive(client, 0.1)
        assert "this server is read-only" in refusal(client)


def test_a_condition_follows_its_topic(make_node: MakeNode, robot: Node, driven: Inbox) -> None:
    joy = robot.advertise("/joy", JOY)
    with (
        rosbridge_server(make_node("bridge"), settings=RosbridgeSettings(policy=GUARDED)) as url,
        RosbridgeClient(url) as client,
    ):
        drive(client, 0.1)
        assert "the condition held does not hold: no message on /joy yet" in refusal(client)
        drive(client, 0.0)
        assert driven.wait(1)[0].linear.x == 0.0
        wait_until(lambda: joy.connection_count == 1)

        def passes() -> bool:
            joy.publish(JOY(buttons=[1]))
            drive(client, 0.2)
            return len(driven.messages) > 1

        wait_until(passes)

        def is_refused() -> bool:
            joy.publish(JOY(buttons=[0]))
            drive(client, 0.2)
            # It is refused in any case, after the drive.
            client.send("advertise", topic="/other", type="geometry_msgs/Twist")
            texts = [refusal(client)]
            while "the policy has no rule for the topic /other" not in texts[-1]:
                texts.append(refusal(client))
            return "must be one of 1; got 0" in "".join(texts)

        wait_until(is_refused)


@pytest.mark.parametrize("kind", [socket.SOCK_STREAM, socket.SOCK_DGRAM], ids=["TCP", "UDP"])
def test_tcp_and_udp_have_the_same_policy(
    make_node: MakeNode, driven: Inbox, kind: socket.SocketKind
) -> None:
    server_class: Any = TcpServer if kind == socket.SOCK_STREAM else UdpServer
    server = server_class(
        make_node("bridge"), ServerOptions(port=0, settings=RosbridgeSettings(policy=POLICY))
    )
    with running(server) as port, socket.socket(socket.AF_INET, kind) as connection:
        connection.settimeout(60)
        connection.connect(("127.0.0.1", port))
        topic = {"topic": "/cmd_vel", "type": "geometry_msgs/Twist"}
        connection.send(json.dumps({"op": "advertise", **topic}).encode())
        for x in (0.1, 0.5):
            values = {"linear": {"x": x}}
            connection.send(json.dumps({"op": "publish", **topic, "msg": values}).encode())
        assert RULE in _status(connection)
        assert driven.wait(1)[0].linear.x == 0.1


def _status(connection: socket.socket) -> str:
    """Return the text of the next status."""
    text = b""
    while b'"status"' not in text or not text.rstrip().endswith(b"}"):
        data = connection.recv(65536)
        assert data
        text += data
    return text.decode()


def test_foxglove_publishes_calls_and_sets_what_the_policy_allows(
    make_node: MakeNode, robot: Node, driven: Inbox
) -> None:
    calls: list[bool] = []
    robot.serve(
        "/motor", SET_BOOL, lambda request: (calls.append(request.data), SET_BOOL._response_class())[1]
    )
    bridge = make_node("bridge")
    with serving(bridge, gate=ActGate(bridge, POLICY)) as address, connected(address) as client:
        channel = {"encoding": "ros1", "schemaName": "geometry_msgs/Twist"}
        client.send("advertise", channels=[{"id": 1, "topic": "/cmd_vel", **channel}])
        client.send("advertise", channels=[{"id": 2, "topic": "/other", **channel}])
        assert "the policy has no rule for the topic /other" in client.next("status")["message"]
        body = struct.pack("<6d", 0.2, 0, 0, 0, 0, 0)
        for bad, text in (
            (struct.pack("<6d", 0.4, 0, 0, 0, 0, 0), RULE),
            (struct.pack("<6d", math.nan, 0, 0, 0, 0, 0), "must be a finite number"),
            (struct.pack("<6d", 0, 0, 0, 0, 0, math.inf), "angular.z of /cmd_vel has no rule"),
            (body + b"x", "has bytes that do not belong to the type geometry_msgs/Twist"),
            (body[:-1], "not a message of the type geometry_msgs/Twist"),
        ):
            client.socket.send(struct.pack("<BI", 1, 1) + bad)
            assert text in client.next("status")["message"]
        wait_until(lambda: (found := bridge.endpoints.publication("/cmd_vel")) is not None and found.links)
        client.socket.send(struct.pack("<BI", 1, 1) + body)
        assert driven.wait(1)[0].linear.x == 0.2

        service = client.until(lambda: client.services.get("/motor"))["id"]
        head = struct.pack("<BIII", 2, service, 7, 4) + b"ros1"
        client.socket.send(head + b"\x01")
        assert "data of /motor must be one of False; got True" in client.next("serviceCallFailure")["message"]
        client.socket.send(head + b"\x00")
        wait_until(lambda: calls == [False])

        client.send(
            "setParameters", parameters=[{"name": "/speed", "value": 2.0}, {"name": "/speed", "value": 0.5}]
        )
        assert "/speed must be from 0 to 1, got 2" in client.next("status")["message"]
        wait_until(lambda: flattened(bridge.params.get("/")).get("/speed") == 0.5)
        client.send("setParameters", parameters=[{"name": "/speed"}])
        assert "the policy does not let clients delete parameters" in client.next("status")["message"]
    wait_until(lambda: [each.linear.x for each in driven.messages] == [0.2, 0.0])  # the client has gone


@pytest.fixture
def system(ros: RosSystem, tmp_path: Path) -> RosSystem:
    ros.serve_master()
    (tmp_path / "p.yaml").write_text(TEXT)
    return ros


def test_the_page_does_what_the_policy_allows(system: RosSystem, tmp_path: Path) -> None:
    page = Page(system, "--control", "--policy", tmp_path / "p.yaml")
    with page.connect() as browser:
        publishing = {"name": "/cmd_vel", "type": "geometry_msgs/Twist", "rate": 0}
        good = browser.watch("publishing", message="linear: {x: 0.3}", **publishing)
        assert next(good)["count"] == 1
        bad = next(browser.watch("publishing", message="linear: {x: 0.4}", **publishing))
        assert f"linear.x of /cmd_vel must be from -0.3 to 0.3 m/s, got 0.4 m/s ({RULE})" in bad["error"]
        other = {**publishing, "name": "/other"}
        assert (
            "has no rule for the topic /other"
            in next(browser.watch("publishing", message="{}", **other))["error"]
        )
        assert browser.act("set_param", name="/speed", value="0.5") is True
        refused = browser.act("set_param", name="/speed", value="3")
        assert "/speed must be from 0 to 1, got 3" in refused["error"]
        may = browser.act("about")["may"]
        assert "publishing" in may
        assert not {"kill_node", "delete_param", "record", "set_reconfigured", "stop_launched"} & set(may)


def test_a_policy_that_is_wrong_ends_the_command(system: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("topics: {/x: {}}\n")
    for command in (("pipros", "serve"), ("pipros", "foxglove"), ("rqt_graph", "--no-browser")):
        server = system.pipros.start(*command, "--policy", tmp_path / "p.yaml")
        server.wait_for("topics./x.type: is missing")
        assert server.wait() == 1
    rosbridge = system.pipros.start(
        "rosrun", "rosbridge_server", "rosbridge_websocket", "--policy", tmp_path / "p.yaml"
    )
    rosbridge.wait_for("topics./x.type: is missing")
    assert rosbridge.wait() == 1
