"""The rosbridge server on real sockets: topics in each encoding, services in both directions, its clients."""

import base64
import hashlib
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import bson
import cbor2
import pytest
from websockets.exceptions import ConnectionClosed

from pipros.basics.limits import Limits
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.service_link import ServiceFailed
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.rosbridge.authentication import Authenticator
from pipros_bridges.rosbridge.server import ServerOptions, WebSocketServer
from pipros_bridges.rosbridge.session import Timing
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.stream_servers import TcpServer
from pipros_bridges.rosbridge.text_input import JsonObjects
from pipros_bridges.rosbridge.udp_server import NotLoopback, UdpServer
from tests.graph.running import running
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.ports import ClaimedPort
from tests.support.rosbridge import RosbridgeClient, rosbridge_server
from tests.support.waiting import wait_until

STRING: Any = load_message_class("std_msgs/String")
IMU: Any = load_message_class("sensor_msgs/Imu")
SET_BOOL: Any = load_service_class("std_srvs/SetBool")
ADD: Any = load_service_class("rospy_tutorials/AddTwoInts")


@pytest.fixture
def node(make_node: MakeNode) -> Node:
    return make_node("bridge")


@pytest.fixture
def robot(make_node: MakeNode) -> Node:
    return make_node("robot")


@pytest.fixture
def url(node: Node) -> Iterator[str]:
    with rosbridge_server(node) as found:
        yield found


@pytest.fixture
def client(url: str) -> Iterator[RosbridgeClient]:
    with RosbridgeClient(url) as found:
        yield found


def test_a_topic_arrives_in_every_encoding_side_by_side(url: str, robot: Node) -> None:
    publisher = robot.advertise("/imu", IMU, latch=True)
    publisher.publish(IMU(orientation_covariance=[1.0] * 9))
    with ExitStack() as open_clients:
        plain, png, cbor, raw = (open_clients.enter_context(RosbridgeClient(url)) for _ in range(4))
        plain.send("subscribe", topic="/imu", type="sensor_msgs/Imu")
        png.send("subscribe", topic="/imu", compression="png")
        cbor.send("subscribe", topic="/imu", compression="cbor")
        raw.send("subscribe", topic="/imu", compression="cbor-raw")
        assert plain.receive()["msg"]["orientation_covariance"] == [1.0] * 9
        picture = png.receive()
        assert (picture["op"], base64.b64decode(picture["data"])[:4]) == ("png", b"\x89PNG")
        assert len(cbor.receive(cbor2.loads)["msg"]["orientation_covariance"].value) == 72
        body = raw.receive(cbor2.loads)["msg"]["bytes"]
        assert list(IMU._from_bytes(body).orientation_covariance) == [1.0] * 9


def test_a_second_subscription_gets_the_latched_message_again(robot: Node, client: RosbridgeClient) -> None:
    robot.advertise("/map", STRING, latch=True).publish(STRING("latched"))
    client.send("subscribe", topic="/map", id="a")
    assert client.receive()["msg"] == {"data": "latched"}
    client.send("subscribe", topic="/map", id="b")
    assert client.receive()["msg"] == {"data": "latched"}


def test_messages_keep_their_order_and_come_once(robot: Node, client: RosbridgeClient) -> None:
    publisher = robot.advertise("chatter", STRING, queue_size=None)
    client.send("subscribe", topic="chatter", id="a")
    client.send("subscribe", topic="chatter", id="b")
    wait_until_connected(publisher)
    for number in range(500):
        publisher.publish(STRING(str(number)))
    got = [client.receive() for _ in range(500)]
    assert [each["msg"]["data"] for each in got] == [str(number) for number in range(500)]
    assert {each["topic"] for each in got} == {"chatter"}


def test_a_topic_of_another_type_is_reported(robot: Node, client: RosbridgeClient) -> None:
    robot.advertise("/x", STRING, latch=True).publish(STRING("x"))
    client.send("subscribe", topic="/x", type="std_msgs/Int32")
    assert "/robot publishes [std_msgs/String]" in client.wait_for("status")["msg"]


def test_a_second_subscription_with_a_wrong_type_leaves_the_first(
    robot: Node, client: RosbridgeClient
) -> None:
    publisher = robot.advertise("/x", STRING)
    client.send("subscribe", topic="/x")
    wait_until_connected(publisher)
    client.send("subscribe", topic="/x", type="std_msgs/Int32")
    assert "/x is already published with the type std_msgs/String" in client.wait_for("status")["msg"]
    client.send("subscribe", topic="/x", type="std_msgs/String", id="b", queue_length=1)
    publisher.publish(STRING("x"))
    assert client.receive()["msg"] == {"data": "x"}


def test_a_client_cannot_replace_the_type_of_a_published_topic(robot: Node, client: RosbridgeClient) -> None:
    # as genuine rosbridge; the master would tell all later subscribers the client's type
    robot.advertise("/x", STRING)
    client.send("advertise", topic="/x", type="std_msgs/Int32")
    reason = "/x is already published with the type std_msgs/String, not std_msgs/Int32"
    assert reason in client.wait_for("status")["msg"]
    assert ["/x", "std_msgs/String"] in robot.master.get_topic_types()


def test_a_throttled_topic_with_a_queue_sends_the_newest_message_later(
    robot: Node, client: RosbridgeClient
) -> None:
    publisher = robot.advertise("/fast", STRING, queue_size=None)
    client.send("subscribe", topic="/fast", throttle_rate=300, queue_length=1)
    wait_until_connected(publisher)
    start = time.monotonic()
    for number in range(20):
        publisher.publish(STRING(str(number)))
    got = [client.receive()["msg"]["data"]]
    while got[-1] != "19":
        got.append(client.receive()["msg"]["data"])
    # The publisher may pause for longer than the interval. Usually two messages arrive.
    assert got[0] == "0"
    assert 1 < len(got) < 20
    assert time.monotonic() - start > 0.2 * (len(got) - 1)


def test_a_throttled_topic_without_a_queue_drops_messages_that_come_too_early(
    url: str, robot: Node, client: RosbridgeClient
) -> None:
    publisher = robot.advertise("/fast", STRING)
    with RosbridgeClient(url) as witness:
        client.send("subscribe", topic="/fast", throttle_rate=100_000)
        wait_until_connected(publisher)
        witness.send("subscribe", topic="/fast")  # gets each message after the first client
        with publishing(publisher, "early"):
            witness.wait_for("publish")
        publisher.publish(STRING("last"))
        while witness.wait_for("publish")["msg"] != {"data": "last"}:
            pass
        client.send("subscribe", topic="/fast", id="b")  # the lower rate applies
        with publishing(publisher, "later"):
            assert [client.receive()["msg"]["data"] for _ in range(2)] == ["early", "later"]


@contextmanager
def publishing(publisher: Any, text: str) -> Iterator[None]:
    """Publish a text repeatedly within the block."""
    end = threading.Event()

    def publish() -> None:
        while not end.wait(0.02):
            publisher.publish(STRING(text))

    thread = threading.Thread(target=publish, daemon=True)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


def test_a_long_message_comes_in_fragments_for_that_subscription_only(
    robot: Node, client: RosbridgeClient
) -> None:
    for topic in ("/long", "/other"):
        robot.advertise(topic, STRING, latch=True).publish(STRING("x" * 300))
    client.send("subscribe", topic="/long", fragment_size=100)
    parts = [client.receive()]
    parts += [client.receive() for _ in range(parts[0]["total"] - 1)]
    assert json.loads("".join(part["data"] for part in parts))["msg"] == {"data": "x" * 300}
    client.send("subscribe", topic="/other")
    assert client.receive()["op"] == "publish"


def test_cbor_is_never_split(robot: Node, client: RosbridgeClient) -> None:
    robot.advertise("/long", STRING, latch=True).publish(STRING("x" * 1000))
    client.send("subscribe", topic="/long", compression="cbor", fragment_size=100)
    assert client.receive(cbor2.loads)["msg"] == {"data": "x" * 1000}


def test_messages_right_after_advertise_reach_the_subscribers(robot: Node, client: RosbridgeClient) -> None:
    first, second = Inbox(), Inbox()
    robot.subscribe("/cmd", STRING, first)
    robot.subscribe("/cmd", STRING, second)
    client.send("advertise", topic="/cmd", type="std_msgs/String")
    for number in range(3):
        client.send("publish", topic="/cmd", msg={"data": str(number)})
    for inbox in (first, second):
        assert [message.data for message in inbox.wait(3)] == ["0", "1", "2"]


def test_a_message_that_does_not_fit_is_refused_and_the_next_one_published(
    robot: Node, client: RosbridgeClient
) -> None:
    inbox = Inbox()
    robot.subscribe("/cmd", STRING, inbox)
    client.send("advertise", topic="/cmd", type="std_msgs/String")
    client.send("publish", topic="/cmd", msg={"data": 5}, id="p1")
    assert client.receive() == {
        "op": "status", "level": "error", "msg": "publish: field data must be a string, got 5", "id": "p1",
    }  # fmt: skip
    client.send("publish", topic="/cmd", msg={"data": "good"})
    assert inbox.wait()[0].data == "good"


def test_latch_in_publish_latches_an_advertised_topic(robot: Node, client: RosbridgeClient) -> None:
    client.send("advertise", topic="/state", type="std_msgs/String")
    client.send("publish", topic="/state", msg={"data": "kept"}, latch=True)
    client.call("/nothing")  # answered after the publication
    inbox = Inbox()
    robot.subscribe("/state", STRING, inbox)
    assert inbox.wait()[0].data == "kept"


def test_a_topic_can_be_published_without_advertising_if_its_type_is_known(
    robot: Node, client: RosbridgeClient
) -> None:
    inbox = Inbox()
    robot.subscribe("/known", STRING, inbox)
    client.send("publish", topic="/unknown", msg={})
    assert "the type of /unknown is unknown" in client.wait_for("status")["msg"]
    client.send("publish", topic="/known", msg={"data": "x"})
    assert inbox.wait()[0].data == "x"


def test_publishers_stay_for_a_while_after_their_client(make_node: MakeNode, robot: Node) -> None:
    node = make_node("quick")
    inbox = Inbox()
    subscriber = robot.subscribe("/cmd", STRING, inbox)
    with rosbridge_server(node, timing=Timing(unregister_s=0.5)) as url:
        with RosbridgeClient(url) as client:
            client.send("advertise", topic="/cmd", type="std_msgs/String")
            wait_until_connected(subscriber)
        with RosbridgeClient(url) as client:
            client.send("publish", topic="/cmd", msg={"data": "again"})
            assert inbox.wait()[0].data == "again"
        wait_until(lambda: not subscriber.connection_count)
        wait_until(lambda: node.endpoints.publication("/cmd") is None)


def test_only_the_end_of_the_client_that_drives_stops_the_robot(url: str, robot: Node) -> None:
    twist: Any = load_message_class("geometry_msgs/Twist")
    inbox = Inbox()
    subscriber = robot.subscribe("/cmd_vel", twist, inbox)
    with RosbridgeClient(url) as driver:
        driver.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist")
        wait_until_connected(subscriber)
        with RosbridgeClient(url) as other:
            other.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.1}})
            wait_until(lambda: len(inbox.messages) == 1)
            driver.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.5}})
            wait_until(lambda: len(inbox.messages) == 2)
        driver.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.6}})
        wait_until(lambda: len(inbox.messages) == 3)
    wait_until(lambda: [each.linear.x for each in inbox.messages] == [0.1, 0.5, 0.6, 0.0])


def test_a_driver_that_latches_its_topic_later_stops_the_robot_at_its_end(url: str, robot: Node) -> None:
    twist: Any = load_message_class("geometry_msgs/Twist")
    inbox = Inbox()
    robot.subscribe("/cmd_vel", twist, inbox)
    with RosbridgeClient(url) as driver:
        for options in ({}, {"latch": True}):
            driver.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist", **options)
            driver.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.5}})
        wait_until(lambda: len(inbox.messages) == 2)
    wait_until(lambda: [each.linear.x for each in inbox.messages] == [0.5, 0.5, 0.0])


def test_services_are_called_with_lists_and_objects(robot: Node, client: RosbridgeClient) -> None:
    robot.serve("/add", ADD, lambda request: ADD._response_class(request.a + request.b))
    for args in ({"a": 1, "b": 2}, [1, 2], [1, 2, 3]):
        answer = client.call("/add", args)
        assert (answer["values"], answer["result"]) == ({"sum": 3}, True)
    assert client.call("/add")["values"] == {"sum": 0}
    wrong = client.call("/add", {"a": "1"})
    assert (wrong["values"], wrong["result"]) == ("field a must be an integer (int64), got '1'", False)
    assert client.call("/none") == {
        "op": "service_response", "service": "/none", "values": "Service [/none] is not available.",
        "result": False, "id": "call:/none",
    }  # fmt: skip


def test_a_client_offers_a_service(robot: Node, client: RosbridgeClient) -> None:
    client.send("advertise_service", service="/switch", type="std_srvs/SetBool")
    answers: list[Any] = []
    wait_until(lambda: _is_offered(robot, "/switch"))

    def call(data: bool) -> None:
        try:
            answers.append(robot.client("/switch", SET_BOOL).call(SET_BOOL._request_class(data), 60.0))
        except ServiceFailed as error:
            answers.append(str(error))

    def answered(data: bool, **response: Any) -> Any:
        thread = threading.Thread(target=call, args=(data,), daemon=True)
        thread.start()
        request = client.wait_for("call_service", service="/switch")
        assert request["args"] == {"data": data}
        client.send("service_response", service="/switch", **{"id": request["id"], **response})
        thread.join(60)
        return answers.pop()

    assert answered(True, values={"success": True, "message": "on"}, result=True).message == "on"
    assert "it is broken" in answered(True, values="it is broken", result=False)
    assert "field message must be a string" in answered(True, values={"message": 1}, result=True)
    assert client.wait_for("status")["level"] == "error"
    assert "values must be an object or a list" in answered(False, result=True)
    assert answered(False, values=[True, "by list"], id=None).message == "by list"


def _is_offered(robot: Node, service: str) -> bool:
    try:
        robot.master.lookup_service(service)
    except Exception:
        return False
    return True


def test_callers_of_a_client_that_leaves_get_an_error(url: str, robot: Node) -> None:
    with RosbridgeClient(url) as client:
        client.send("advertise_service", service="/switch", type="std_srvs/SetBool")
        wait_until(lambda: _is_offered(robot, "/switch"))
        errors: list[str] = []

        def call() -> None:
            try:
                robot.client("/switch", SET_BOOL).call(SET_BOOL._request_class(True), 60.0)
            except ServiceFailed as error:
                errors.append(str(error))

        thread = threading.Thread(target=call, daemon=True)
        thread.start()
        client.wait_for("call_service")
    thread.join(60)
    assert "the client no longer offers the service, or has disconnected" in errors[0]
    wait_until(lambda: not _is_offered(robot, "/switch"))


def test_a_client_withdraws_its_services_and_topics(robot: Node, client: RosbridgeClient) -> None:
    def offered() -> set[bool]:
        topics = {name for name, _ in robot.master.get_system_state()[0]}
        return {_is_offered(robot, "/switch"), "/speed" in topics}

    client.send("advertise", topic="/speed", type="std_msgs/Int32")
    client.send("advertise_service", service="/switch", type="std_srvs/SetBool")
    wait_until(lambda: offered() == {True})
    client.send("unadvertise", topic="/speed")
    client.send("unadvertise_service", service="/switch")
    wait_until(lambda: offered() == {False})


def test_only_the_client_that_offers_a_service_answers_its_calls(
    url: str, robot: Node, client: RosbridgeClient
) -> None:
    with RosbridgeClient(url) as other:
        client.send("advertise_service", service="/switch", type="std_srvs/SetBool")
        wait_until(lambda: _is_offered(robot, "/switch"))
        other.send("call_service", service="/switch", id="c", args=[True])
        request = client.wait_for("call_service")
        other.send("service_response", service="/switch", id=request["id"], values={}, result=True)
        assert "does not offer /switch" in other.wait_for("status")["msg"]
        client.send("service_response", service="/switch", id=request["id"], values=[True], result=True)
        assert other.wait_for("service_response", id="c")["values"]["success"] is True


def test_the_newest_offer_of_a_service_counts(url: str, robot: Node) -> None:
    with RosbridgeClient(url) as old, RosbridgeClient(url) as new:
        for client in (old, new):
            client.send("advertise_service", service="/switch", type="std_srvs/SetBool")
            client.call("/nothing")
        robot_call = threading.Thread(
            target=lambda: robot.client("/switch", SET_BOOL).call(SET_BOOL._request_class(True), 60.0),
            daemon=True,
        )
        robot_call.start()
        request = new.wait_for("call_service")
        new.send("service_response", service="/switch", id=request["id"], values=[True], result=True)
        robot_call.join(60)


def test_clients_are_counted_and_listed(url: str, robot: Node) -> None:
    counts, lists = Inbox(), Inbox()
    robot.subscribe("/client_count", load_message_class("std_msgs/Int32"), counts)
    robot.subscribe("/connected_clients", load_message_class("rosbridge_msgs/ConnectedClients"), lists)
    with RosbridgeClient(url):
        wait_until(lambda: counts.messages and counts.messages[-1].data == 1)
        wait_until(lambda: lists.messages and len(lists.messages[-1].clients) == 1)
        (client,) = lists.messages[-1].clients
        assert (client.ip_address, client.connection_time.secs > 0) == ("127.0.0.1", True)
    wait_until(lambda: counts.messages[-1].data == 0)


def test_bson_mode_has_bson_in_both_directions(node: Node, robot: Node) -> None:
    inbox = Inbox()
    robot.subscribe("/cmd", STRING, inbox)
    robot.advertise("/scan", load_message_class("sensor_msgs/CompressedImage"), latch=True).publish(
        load_message_class("sensor_msgs/CompressedImage")(data=b"\0\1")
    )
    with (
        rosbridge_server(node, settings=RosbridgeSettings(is_bson=True)) as url,
        RosbridgeClient(url) as client,
    ):
        client.socket.send(bson.encode({"op": "subscribe", "topic": "/scan"}))
        assert client.receive(bson.decode)["msg"]["data"] == b"\0\1"
        client.socket.send(bson.encode({"op": "advertise", "topic": "/cmd", "type": "std_msgs/String"}))
        client.socket.send(bson.encode({"op": "publish", "topic": "/cmd", "msg": {"data": "x"}}))
        assert inbox.wait()[0].data == "x"
        client.socket.send(b"\1\2\3")
        assert "not BSON" in client.receive(bson.decode)["msg"]


def test_clients_log_in_with_auth(node: Node) -> None:
    secret = "0123456789abcdef"  # noqa: S105 # of this test
    now = int(time.time())
    authenticator = Authenticator(secret, lambda: now)
    text = f"{secret}127.0.0.1here{'r'}{now}user{now + 100}"
    auth = {
        "op": "auth", "mac": hashlib.sha512(text.encode()).hexdigest(), "client": "127.0.0.1", "dest": "here",
        "rand": "r", "t": now, "level": "user", "end": now + 100,
    }  # fmt: skip
    with rosbridge_server(node, authenticator=authenticator) as url:
        with RosbridgeClient(url) as client:
            client.socket.send(json.dumps(auth))
            assert client.call("/none")["result"] is False
        for first in (auth, {"op": "subscribe", "topic": "/x"}):
            with RosbridgeClient(url) as client:
                client.socket.send(json.dumps(first))
                with pytest.raises(ConnectionClosed):
                    client.receive()


def test_a_client_that_never_reads_costs_the_others_nothing(make_node: MakeNode) -> None:
    limits = Limits(tables=(BridgeLimits(bridge_queue_bytes=200_000),))
    bridge, robot = make_node("bridge", limits=limits), make_node("robot")
    image: Any = load_message_class("sensor_msgs/CompressedImage")
    publisher = robot.advertise("/image", image)
    with rosbridge_server(bridge) as url, RosbridgeClient(url) as stuck, RosbridgeClient(url) as reader:
        for client in (stuck, reader):
            client.send("subscribe", topic="/image", compression="cbor")
            client.call("/nothing")  # answered after the subscription
        wait_until_connected(publisher)
        for number in range(100):
            publisher.publish(image(format=str(number), data=bytes(100_000)))
            assert reader.receive(cbor2.loads)["msg"]["format"] == str(number)


def test_rosapi_answers_about_the_system(robot: Node, make_node: MakeNode, client: RosbridgeClient) -> None:
    from pipros_bridges.rosapi import RosApi

    RosApi(make_node("rosapi")).serve()
    robot.advertise("/scan", load_message_class("sensor_msgs/LaserScan"))
    robot.serve("/add", ADD, lambda request: ADD._response_class(request.a + request.b))
    wait_until(lambda: _is_offered(robot, "/rosapi/topics") and _is_offered(robot, "/add"))

    def ask(question: str, /, **args: Any) -> Any:
        answer = client.call(f"/rosapi/{question}", args)
        assert answer["result"] is True, answer
        return answer["values"]

    wait_until(lambda: "/scan" in ask("topics")["topics"])
    topics = ask("topics")
    assert topics["types"][topics["topics"].index("/scan")] == "sensor_msgs/LaserScan"
    raw = ask("topics_and_raw_types")
    assert "float32[] ranges" in raw["typedefs_full_text"][raw["topics"].index("/scan")]
    assert ask("topics_for_type", type="sensor_msgs/LaserScan") == {"topics": ["/scan"]}
    assert ask("topic_type", topic="/scan") == {"type": "sensor_msgs/LaserScan"}
    assert ask("topic_type", topic="scan") == {"type": ""}
    assert ask("publishers", topic="/scan") == {"publishers": ["/robot"]}
    assert ask("subscribers", topic="/scan") == {"subscribers": []}
    assert ask("service_type", service="/add") == {"type": "rospy_tutorials/AddTwoInts"}
    assert ask("service_type", service="/none") == {"type": ""}
    assert ask("services_for_type", type="rospy_tutorials/AddTwoInts") == {"services": ["/add"]}
    assert ask("service_providers", service="rospy_tutorials/AddTwoInts") == {"providers": ["/robot"]}
    assert ask("service_node", service="/add") == {"node": "/robot"}
    assert ask("service_host", service="/add")["host"]
    assert "/add" in ask("services")["services"]
    assert {"/robot", "/rosapi"} <= set(ask("nodes")["nodes"])
    assert ask("node_details", node="/robot")["publishing"] == ["/scan"]
    assert ask("action_servers") == {"action_servers": []}
    assert ask("get_time")["time"]["secs"] > 0
    for value in (1, 2.5, True, "text", [1, "a"], {"a": {"b": 1}}):
        ask("set_param", name="/p", value=json.dumps(value))
        assert json.loads(ask("get_param", name="/p")["value"]) == value
    assert ask("has_param", name="/p") == {"exists": True}
    assert ask("search_param", name="p") == {"global_name": "/p"}
    assert "/p/a/b" in ask("get_param_names")["names"]
    ask("delete_param", name="/p")
    ask("delete_param", name="/p")
    assert ask("get_param", name="/p") == {"value": "null"}
    assert ask("get_param", name="/p", default="5") == {"value": "5"}
    assert ask("search_param", name="p") == {"global_name": ""}
    for refused, advice in (
        ("null", "delete_param deletes it"),
        ("not json", "a text must be in quotation marks"),
        (str(2**31), "give it as a float or text"),
    ):
        answer = client.call("/rosapi/set_param", {"name": "/p", "value": refused})
        assert (answer["result"], "cannot set /p" in answer["values"]) == (False, True)
        assert advice in answer["values"]
    assert "TopicsRequest has no fields" in client.call("/rosapi/topics", {"x": 1})["values"]
    details = ask("message_details", type="std_msgs/Header")["typedefs"]
    assert details[0] == {
        "type": "std_msgs/Header", "fieldnames": ["seq", "stamp", "frame_id"],
        "fieldtypes": ["uint32", "time", "string"], "fieldarraylen": [-1, -1, -1],
        "examples": ["0", "{}", ""], "constnames": [], "constvalues": [],
    }  # fmt: skip
    imu = ask("message_details", type="sensor_msgs/Imu")["typedefs"]
    assert imu[0]["fieldarraylen"] == [-1, -1, 9, -1, 9, -1, 9]
    assert [each["type"] for each in imu][:3] == ["sensor_msgs/Imu", "std_msgs/Header", "time"]
    assert ask("message_details", type="std_msgs/Char")["typedefs"][0]["fieldtypes"] == ["char"]
    assert ask("message_details", type="int32") == {"typedefs": []}
    [time] = ask("message_details", type="time")["typedefs"]
    assert (time["type"], time["fieldnames"]) == ("time", ["secs", "nsecs"])
    assert ask("service_request_details", type="rospy_tutorials/AddTwoInts")["typedefs"][0]["fieldnames"] == [
        "a",
        "b",
    ]
    assert ask("service_response_details", type="std_srvs/Empty")["typedefs"][0]["fieldnames"] == []
    assert client.call("/rosapi/message_details", {"type": "no/Type"})["result"] is False


HANDSHAKE = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


def test_a_client_that_answers_no_ping_is_disconnected_and_others_stay(node: Node) -> None:
    with rosbridge_server(node, ping_s=0.2, pong_s=1.0) as url, RosbridgeClient(url) as other:
        host, _, port = url.removeprefix("ws://").partition(":")
        with socket.create_connection((host, int(port)), timeout=60) as vanished:
            vanished.sendall(HANDSHAKE)
            while vanished.recv(4096):
                pass
        other.send("no operation")
        assert other.wait_for("status")["level"] == "error"


def test_the_launch_file_serves_clients(ros: Any) -> None:
    ros.serve_master()
    launched = ros.pipros.start(
        "roslaunch", "rosbridge_server", "rosbridge_websocket.launch", "port:=0", "topics_glob:=[/open*]"
    )
    port = int(launched.wait_for(r"Rosbridge WebSocket server started on port (\d+)", 60)[1])
    with RosbridgeClient(f"ws://127.0.0.1:{port}") as client:
        wait_until(lambda: client.call("/rosapi/topics")["result"], 60)
        assert client.call("/rosapi/topics")["values"]["topics"] == []
        client.send("subscribe", topic="/rosout")
        assert "clients may not use /rosout" in client.wait_for("status")["msg"]
        answer = client.call("/rosapi/get_param", {"name": "/rosbridge_websocket/actual_port"})
        assert answer["values"]["value"] == str(port)
        answer = client.call("/rosapi/get_param", {"name": "/rosbridge_websocket/websocket_ping_interval"})
        assert answer["values"]["value"] == "20"
    launched.press_ctrl_c()
    assert launched.wait() == 0


def test_a_missing_secret_file_is_an_error(ros: Any, tmp_path: Path) -> None:
    ros.serve_master()
    ended = ros.pipros.run(
        "rosrun", "rosbridge_server", "rosbridge_websocket", "_authenticate:=true",
        f"_secret_file:={tmp_path}/x",
    )  # fmt: skip
    assert ended.returncode == 1
    assert "secret_file" in ended.output


def test_tcp_clients_send_and_receive_json_objects_without_a_delimiter(node: Node, robot: Node) -> None:
    robot.advertise("/state", STRING, latch=True).publish(STRING("ünïcode"))
    server = TcpServer(node, ServerOptions(port=0))
    with running(server) as port, socket.create_connection(("127.0.0.1", port), 20) as connection:
        connection.settimeout(20)
        request = '{"op": "x"}{"op": "subscribe", "topic": "/state", "id": "ünïcode"}'.encode()
        for byte in request:
            connection.send(bytes([byte]))
        objects = JsonObjects(10_000)
        got: list[Any] = []
        while len(got) < 2:
            got += objects.feed(connection.recv(10_000).decode())
        assert (json.loads(got[0])["level"], json.loads(got[1])["msg"]) == ("error", {"data": "ünïcode"})


def test_tcp_clients_may_use_bson(node: Node, robot: Node) -> None:
    robot.advertise("/state", STRING, latch=True).publish(STRING("x"))
    server = TcpServer(node, ServerOptions(port=0, settings=RosbridgeSettings(is_bson=True)))
    with running(server) as port, socket.create_connection(("127.0.0.1", port), 20) as connection:
        connection.sendall(bson.encode({"op": "subscribe", "topic": "/state"}))
        with connection.makefile("rb") as file:
            head = file.read(4)
            document = head + file.read(int.from_bytes(head, "little") - 4)
        assert bson.decode(document)["msg"] == {"data": "x"}
        connection.sendall(b"\xff\xff\xff\x7f")
        assert connection.recv(1) == b""


@pytest.mark.parametrize("is_bson", [False, True])
@pytest.mark.parametrize("start", [b"POST / HTTP/1.1\r\n", b"\r\nPUT / HTTP/1.1\r\n", b"QUIT\r\n"])
def test_tcp_connections_that_begin_as_a_web_request_end_before_anything_is_read(
    node: Node, robot: Node, caplog: pytest.LogCaptureFixture, start: bytes, is_bson: bool
) -> None:
    received = Inbox()
    robot.subscribe("/cmd_vel", STRING, received)
    operations = [
        {"op": "advertise", "topic": "/cmd_vel", "type": "std_msgs/String"},
        {"op": "publish", "topic": "/cmd_vel", "msg": {"data": "drive"}},
    ]
    body = b"".join(bson.encode(each) if is_bson else json.dumps(each).encode() for each in operations)
    server = TcpServer(node, ServerOptions(port=0, settings=RosbridgeSettings(is_bson=is_bson)))
    with running(server) as port:
        for _ in range(2):
            with socket.create_connection(("127.0.0.1", port), 20) as connection, suppress(ConnectionError):
                connection.sendall(start + b"Host: localhost\r\n\r\n" + body)
                assert connection.recv(100) == b""
        with socket.create_connection(("127.0.0.1", port), 20) as connection:
            connection.sendall(body.replace(b"drive", b"stop!"))
            wait_until(lambda: [each.data for each in received.messages] == ["stop!"], 20)
    if not (is_bson and start.startswith(b"\r")):  # in BSON, these bytes are an absurd length
        assert caplog.text.count("must begin with an operation") == 1


def test_a_client_that_sends_too_much_is_read_more_slowly(make_node: MakeNode) -> None:
    limits = Limits(tables=(BridgeLimits(bridge_client_rate=5),))
    server = WebSocketServer(make_node("bridge", limits=limits), ServerOptions(port=0))
    with running(server) as port:
        url = f"ws://127.0.0.1:{port}"
        with RosbridgeClient(url) as flooding, RosbridgeClient(url) as other:
            for _ in range(500):
                flooding.send("set_level", level="none")
            wait_until(
                lambda: (
                    server.server.clients()[0].received.messages > limits.of(BridgeLimits).bridge_client_rate
                )
            )
            other.send("unknown")
            assert other.wait_for("status")["level"] == "error"
            assert server.server.clients()[0].received.messages < 500


def test_idle_tcp_clients_make_room_for_others(make_node: MakeNode) -> None:
    limits = Limits(tables=(BridgeLimits(bridge_clients=2),))
    bridge, robot = make_node("bridge", limits=limits), make_node("robot")
    publisher = robot.advertise("/state", STRING, latch=True)
    publisher.publish(STRING("x"))
    server = TcpServer(bridge, ServerOptions(port=0))
    address = "127.0.0.1", server.start()
    request = b'{"op": "subscribe", "topic": "/state"}'
    try:
        with ExitStack() as open_clients:

            def connected() -> socket.socket:
                return open_clients.enter_context(socket.create_connection(address, 20))

            for _ in range(2):
                idle, user = connected(), connected()
                user.sendall(request)
                assert user.recv(10_000)
            with suppress(ConnectionResetError):
                assert idle.recv(1) == b""
            with suppress(ConnectionResetError):
                assert connected().recv(1) == b""
    finally:
        server.close()


def test_a_tcp_client_that_does_not_log_in_is_disconnected(make_node: MakeNode) -> None:
    node = make_node("bridge", limits=Limits()._replace(login_s=0.2))
    settings = RosbridgeSettings(authenticator=Authenticator("0123456789abcdef", time.time))
    with running(TcpServer(node, ServerOptions(port=0, settings=settings))) as port:
        for first in (b"", b'{"op": "subscribe", "topic": "/x"}'):
            with socket.create_connection(("127.0.0.1", port), 20) as connection:
                connection.sendall(first)
                with suppress(ConnectionResetError):
                    assert connection.recv(1) == b""


def test_udp_clients_are_served_on_loopback_only(node: Node, robot: Node) -> None:
    robot.advertise("/state", STRING, latch=True).publish(STRING("x"))
    with pytest.raises(NotLoopback):
        UdpServer(node, ServerOptions(host="0.0.0.0", port=0))  # noqa: S104 # it is refused
    server = UdpServer(node, ServerOptions(port=0))
    with running(server) as port, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(20)
        client.sendto(b'{"op": "subscribe", "topic": "/state"}', ("127.0.0.1", port))
        assert json.loads(client.recv(10_000))["msg"] == {"data": "x"}
        buffer = socket.SOL_SOCKET, socket.SO_RCVBUF  # of the datagrams that arrive while others are handled
        assert server._transport.get_extra_info("socket").getsockopt(*buffer) > client.getsockopt(*buffer)


def test_the_first_message_that_no_datagram_can_hold_is_reported(node: Node, robot: Node) -> None:
    large, small = (robot.advertise(name, STRING, latch=True) for name in ("/large", "/small"))
    large.publish(STRING("x" * 70_000))
    server = UdpServer(node, ServerOptions(port=0))
    with running(server) as port:
        place = "127.0.0.1", port
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(20)
            client.sendto(b'{"op": "subscribe", "topic": "/large"}', place)
            status = json.loads(client.recv(10_000))
            assert (status["op"], status["level"]) == ("status", "error")
            assert "at most 65507" in status["msg"]
            large.publish(STRING("x" * 70_000))
            small.publish(STRING("after it"))
            client.sendto(b'{"op": "subscribe", "topic": "/small"}', place)
            assert json.loads(client.recv(10_000))["msg"] == {"data": "after it"}
            client.sendto(b'{"op": "unsubscribe", "topic": "/large"}', place)
            client.sendto(b'{"op": "subscribe", "topic": "/large", "fragment_size": 50000}', place)
            assert json.loads(client.recv(60_000))["op"] == "fragment"


@pytest.mark.parametrize("server_class", [WebSocketServer, TcpServer])
def test_a_server_can_be_started_again_when_its_port_is_free(
    server_class: Any, node: Node, claimed_port: ClaimedPort
) -> None:
    port = claimed_port.number
    with socket.create_server(("127.0.0.1", port)):
        server = server_class(node, ServerOptions(port=port))
        with pytest.raises(OSError, match=r"[Ii]n use"):
            server.start()
    assert server.start() == port
    socket.create_connection(("127.0.0.1", port), 20).close()
    server.close()


@pytest.mark.parametrize("server_class", [WebSocketServer, TcpServer])
def test_a_server_closes_while_its_node_shuts_down(server_class: Any, make_node: MakeNode) -> None:
    node = make_node("ending")
    server = server_class(node, ServerOptions(port=0))
    with socket.create_connection(("127.0.0.1", server.start()), 20) as client:
        # blocks until the server ends the connection
        node.on_shutdown(lambda: ended.append(client.recv(100)))
        ended: list[bytes] = []
        node.shutdown()
        assert ended == [b""]
    server.close()


@pytest.mark.parametrize(("argument", "error"), [
    ("_unregister_timeout:=-1", "~unregister_timeout must be a number >= 0, got -1"),
    ("_max_message_size:=big", "~max_message_size must be a number >= 0, got big"),
    ("_address:=10.0.0.1", "UDP serves only this machine"),
])  # fmt: skip
def test_wrong_parameters_of_a_server_are_errors(ros: Any, argument: str, error: str) -> None:
    ros.serve_master()
    ended = ros.pipros.run("rosrun", "rosbridge_server", "rosbridge_udp", argument)
    assert ended.returncode == 1
    assert error in ended.output


@pytest.mark.parametrize("value", [".inf", ".nan", "-1", "true"])
def test_a_wrong_buffer_of_foxglove_bridge_is_an_error(ros: Any, value: str) -> None:
    ros.serve_master()
    ended = ros.pipros.run("rosrun", "foxglove_bridge", "foxglove_bridge", f"_send_buffer_limit:={value}")
    assert ended.returncode == 1
    assert "parameter ~send_buffer_limit must be a finite number >= 0, got" in ended.output


def test_the_command_line_sets_port_and_address(ros: Any) -> None:
    ros.serve_master()
    command = ("rosrun", "rosbridge_server", "rosbridge_websocket.py")
    assert "--port needs a number" in ros.pipros.run(*command, "--port").output
    server = ros.pipros.start(*command, "--port", "0", "--address", "localhost")
    port = int(server.wait_for(r"started on port (\d+)")[1])
    with RosbridgeClient(f"ws://localhost:{port}") as client:
        assert client.call("/none")["result"] is False
    server.press_ctrl_c()
    assert server.wait() == 0
