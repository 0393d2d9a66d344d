"""The Foxglove server with real nodes, and a plain client."""

import base64
import itertools
import json
import struct
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.msg.class_finder import installed_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros_bridges.foxglove.handler import FETCHED_APART, SUBPROTOCOLS, Rules
from pipros_bridges.foxglove.session import OPEN_REQUESTS
from pipros_libraries.topic_tools.raw import class_like
from tests.support.foxglove import CONTROL, Client, connected, only, serving
from tests.support.nodes import Inbox, MakeNode
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
Int32: Any = load_message_class("std_msgs/Int32")
Clock: Any = load_message_class("rosgraph_msgs/Clock")
SetBool: Any = load_service_class("std_srvs/SetBool")


@pytest.fixture
def client(make_node: MakeNode) -> Iterator[Client]:
    """A client of a server without special rules."""
    with serving(make_node("bridge")) as address, connected(address) as found:
        yield found


def text_of(body: bytes) -> str:
    return body[4:].decode()


def bytes_of(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()


@pytest.mark.parametrize("subprotocol", SUBPROTOCOLS)
def test_a_client_receives_what_nodes_publish(make_node: MakeNode, subprotocol: str) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    with serving(make_node("bridge")) as address, connected(address, subprotocol) as client:
        info = client.next("serverInfo")
        assert info["supportedEncodings"] == ["ros1", "json"]
        assert set(info["capabilities"]) == {
            "parameters", "parametersSubscribe", "connectionGraph", "assets", "clientPublish", "services",
        }  # fmt: skip
        channel = client.subscribe(7, "/chatter")
        assert (channel["encoding"], channel["schemaName"]) == ("ros1", "std_msgs/String")
        assert channel["schemaEncoding"] == "ros1msg"
        assert "string data" in channel["schema"]
        wait_until(lambda: publisher.connection_count == 1)
        publisher.publish(String("hello"))
        number, time_ns, body = client.next_message()
        assert (number, text_of(body)) == (7, "hello")
        assert time_ns > 1_700_000_000 * 10**9

        client.send("unsubscribe", subscriptionIds=[7])
        wait_until(lambda: publisher.connection_count == 0)


def test_definitions_contain_those_of_embedded_types(make_node: MakeNode, client: Client) -> None:
    make_node("camera").advertise("/image", load_message_class("sensor_msgs/Image"))
    schema = client.until(lambda: client.channels.get("/image"))["schema"]
    found = message_classes_from_text("sensor_msgs/Image", schema)["sensor_msgs/Image"]
    assert found._md5sum == load_message_class("sensor_msgs/Image")._md5sum


def test_topics_come_and_go_with_their_nodes(make_node: MakeNode, client: Client) -> None:
    client.until(lambda: "/rosout" in client.channels or client.news)
    publisher = make_node("talker").advertise("/chatter", String)
    first = client.until(lambda: client.channels.get("/chatter"))
    client.subscribe(1, "/chatter")
    publisher.unregister()
    client.until(lambda: "/chatter" not in client.channels)
    other = make_node("other").advertise("/chatter", Int32)
    second = client.until(lambda: client.channels.get("/chatter"))
    assert second["schemaName"] == "std_msgs/Int32"
    assert second["id"] != first["id"]
    client.subscribe(1, "/chatter")
    wait_until(lambda: other.connection_count == 1)
    other.publish(Int32(5))
    assert client.next_message()[2] == b"\5\0\0\0"


def test_latched_messages_come_to_every_client(make_node: MakeNode) -> None:
    make_node("map").advertise("/map", String, latch=True).publish(String("latched"))
    with serving(make_node("bridge")) as address, connected(address) as first:
        first.subscribe(0, "/map")
        assert text_of(first.next_message()[2]) == "latched"
        with connected(address) as second:
            second.subscribe(9, "/map")
            assert text_of(second.next_message()[2]) == "latched"


def test_types_that_are_not_installed_come_from_their_publisher(make_node: MakeNode, client: Client) -> None:
    found = message_classes_from_text("alien_msgs/Thing", "int32 legs\nstring name\n")["alien_msgs/Thing"]
    publisher = make_node("alien").advertise("/thing", found, latch=True)
    assert installed_class("alien_msgs/Thing") is None
    channel = client.subscribe(1, "/thing")
    assert channel["schema"] == "int32 legs\nstring name\n"
    publisher.publish(found(4, "dog"))  # latched: the bridge may still be reading the definition alone
    assert client.next_message()[2] == b"\4\0\0\0\3\0\0\0dog"


def test_another_definition_of_an_installed_type_replaces_it(make_node: MakeNode, client: Client) -> None:
    found = message_classes_from_text("std_msgs/String", "int32 other\n")["std_msgs/String"]
    make_node("other").advertise("/chatter", found, latch=True).publish(found(4))
    first = client.subscribe(1, "/chatter")
    assert "string data" in first["schema"]
    client.until(lambda: client.channels.get("/chatter", first) is not first)
    assert client.subscribe(2, "/chatter")["schema"] == "int32 other\n"
    number, _, body = client.next_message()
    assert (number, body) == (2, b"\4\0\0\0")


def test_a_hostile_definition_is_not_passed_on(make_node: MakeNode, client: Client) -> None:
    bomb = "alien_msgs/A[1000000] a\n" + "=" * 80 + "\nMSG: alien_msgs/A\nfloat64[1000000] x\n"
    kinds = {
        "/bomb": {"type": "alien_msgs/B", "md5sum": "1" * 32, "message_definition": bomb * 100},
        "/wrong": {"type": "alien_msgs/C", "md5sum": "2" * 32, "message_definition": "int32 x"},
        "/empty": {"type": "alien_msgs/D", "md5sum": "3" * 32, "message_definition": ""},
        "/fine": {"type": "std_msgs/Int32", "md5sum": Int32._md5sum, "message_definition": Int32._full_text},
    }
    node = make_node("hostile")
    for topic, header in kinds.items():
        node.advertise(topic, class_like(header))
    client.until(lambda: "/fine" in client.channels)
    assert set(client.channels) & set(kinds) == {"/fine"}


def test_a_client_publishes_in_ros1_and_json(make_node: MakeNode) -> None:
    received: list[str] = []
    make_node("listener").subscribe("/command", String, lambda message: received.append(message.data))
    bridge = make_node("bridge")
    with serving(bridge) as address, connected(address) as client:
        for number, encoding in enumerate(("ros1", "json")):
            channel = {
                "id": number, "topic": "/command", "encoding": encoding, "schemaName": "std_msgs/String",
            }  # fmt: skip
            client.send("advertise", channels=[channel])
        wait_until(lambda: bridge.endpoints.publication("/command") is not None)
        wait_until(lambda: bridge.endpoints.publications[-1].links)
        client.socket.send(b"\1" + struct.pack("<I", 0) + bytes_of("raw"))
        client.socket.send(b"\1" + struct.pack("<I", 1) + b'{"data": "json"}')
        wait_until(lambda: received == ["raw", "json"])

        client.socket.send(b"\1" + struct.pack("<I", 1) + b'{"text": "json"}')
        assert "text" in client.next("status", level=2)["message"]
        client.send("unadvertise", channelIds=[0, 1])
        wait_until(lambda: bridge.endpoints.publication("/command") is None)
        client.socket.send(b"\1" + struct.pack("<I", 1) + b"{}")
        assert client.next("status")["message"] == "channel 1 is not advertised"


def test_a_client_cannot_replace_the_type_of_a_published_topic(make_node: MakeNode, client: Client) -> None:
    talker = make_node("talker")
    talker.advertise("/x", String)
    channel = {"id": 1, "topic": "/x", "encoding": "ros1", "schemaName": "std_msgs/Int32"}
    client.send("advertise", channels=[channel])
    reason = "/x is already published with the type std_msgs/String, not std_msgs/Int32"
    assert client.next("status", level=2)["message"] == reason
    assert ["/x", "std_msgs/String"] in talker.master.get_topic_types()


def test_a_client_that_ends_stops_the_robot_that_it_drives(make_node: MakeNode) -> None:
    twist: Any = load_message_class("geometry_msgs/Twist")
    robot, inbox = make_node("robot"), Inbox()
    robot.subscribe("/cmd_vel", twist, inbox)
    channel = {"id": 1, "topic": "/cmd_vel", "encoding": "json", "schemaName": "geometry_msgs/Twist"}
    with serving(make_node("bridge")) as address, connected(address) as client:
        client.send("advertise", channels=[channel])

        def drives() -> bool:
            client.socket.send(b"\1" + struct.pack("<I", 1) + b'{"linear": {"x": 0.5}}')
            return bool(inbox.messages)

        wait_until(drives)
    wait_until(lambda: inbox.messages[-1] == twist())


def test_publications_end_with_their_client(make_node: MakeNode) -> None:
    bridge = make_node("bridge")
    channel = {"id": 1, "topic": "/a", "encoding": "ros1", "schemaName": "alien_msgs/X", "schema": "int8 x\n"}
    with serving(bridge) as address:
        with connected(address) as client:
            client.send("advertise", channels=[channel])
            wait_until(lambda: bridge.endpoints.publication("/a") is not None)
        wait_until(lambda: bridge.endpoints.publication("/a") is None)


@pytest.mark.parametrize(("changes", "reason"), [
    ({"encoding": "cdr"}, "encoding 'cdr' is not one of ros1, json"),
    ({"schemaName": "alien_msgs/X"}, "type [alien_msgs/X] is not installed, and its schema is missing"),
    ({"schema": "int32 data"}, "the schema of [std_msgs/String] differs from the installed definition"),
    ({"topic": "not a name"}, "not a name"),
])  # fmt: skip
def test_channels_that_cannot_be_published_are_refused(
    changes: dict[str, str], reason: str, client: Client
) -> None:
    channel = {"id": 1, "topic": "/a", "encoding": "ros1", "schemaName": "std_msgs/String", **changes}
    client.send("advertise", channels=[channel])
    assert reason in client.next("status", level=2)["message"]


def test_a_wrong_entry_of_a_list_leaves_the_others(make_node: MakeNode) -> None:
    good = {"id": 3, "topic": "/a", "encoding": "ros1", "schemaName": "std_msgs/String"}
    bad = [{"id": 1}, 7, {**good, "id": 2, "schemaName": "std_msgs/Nope"}]
    make_node("talker").advertise("/chatter", String, latch=True).publish(String("x"))
    bridge = make_node("bridge")
    with serving(bridge) as address, connected(address) as client:
        client.send("advertise", channels=[*bad, good])
        expected = "channels[0]: topic must be a string, got NoneType (and 1 more)"
        assert client.next("status", level=2)["message"] == expected
        assert "Nope" in client.next("status", level=2)["message"]
        wait_until(lambda: bridge.endpoints.publication("/a") is not None)

        client.send("setParameters", parameters=[{"name": 5}, {"name": "/p", "value": 1}])
        assert "parameters[0]" in client.next("status", level=2)["message"]
        client.send("getParameters", parameterNames=[5, "/p", "/a b"], id="x")
        assert "parameterNames[0]" in client.next("status", level=2)["message"]
        assert client.next("parameterValues")["parameters"] == [{"name": "/p", "value": 1}]

        channel = client.until(lambda: client.channels.get("/chatter"))["id"]
        client.send("subscribe", subscriptions=[{"id": -1, "channelId": 1}, {"id": 1, "channelId": channel}])
        assert "subscriptions[0]" in client.next("status", level=2)["message"]
        assert client.next_message()[0] == 1


def test_services_are_offered_and_called(make_node: MakeNode, client: Client) -> None:
    server = make_node("server")

    def answer(request: Any) -> Any:
        if not request.data:
            raise RuntimeError("no")
        return SetBool._response_class(True, "done")

    server.serve("/switch", SetBool, answer, lambda _: None)
    offered = client.until(lambda: client.services.get("/switch"))
    assert offered["type"] == "std_srvs/SetBool"
    assert "bool data" in offered["request"]["schema"]
    assert offered["request"]["schema"] == offered["requestSchema"]
    assert "bool success" in offered["response"]["schema"]
    client.call("/switch", 5, b"\1")
    head = struct.pack("<III", offered["id"], 5, 4)
    assert client.next_binary(3) == head + b"ros1" + b"\1" + bytes_of("done")
    client.call("/switch", 6, b'{"data": true}', "json")
    answer_data = client.next_binary(3)
    assert json.loads(answer_data[16:]) == {"success": True, "message": "done"}
    client.call("/switch", 7, b"\0")
    failure = client.next("serviceCallFailure", callId=7, serviceId=offered["id"])
    assert "no" in failure["message"]
    client.call("/switch", 8, b"", "cdr")
    assert "cdr" in client.next("serviceCallFailure", callId=8)["message"]
    server.endpoints.stop_serving(server.endpoints.service("/switch"))  # type: ignore[arg-type]
    client.until(lambda: "/switch" not in client.services)
    client.socket.send(struct.pack("<BIII", 2, offered["id"], 9, 4) + b"ros1")
    assert "service 1 does not exist" in client.next("serviceCallFailure", callId=9)["message"]


def test_calls_that_hang_delay_nothing_and_end_with_their_client(make_node: MakeNode) -> None:
    is_called, is_over = threading.Event(), threading.Event()

    def hang(_: Any) -> Any:
        is_called.set()
        is_over.wait(30)
        return SetBool._response_class()

    make_node("server").serve("/hang", SetBool, hang)
    bridge = make_node("bridge")
    with serving(bridge) as address, connected(address) as client:
        for number in range(OPEN_REQUESTS + 1):
            client.call("/hang", number, b"\1")
        assert "are pending" in client.next("status", level=2)["message"]
        wait_until(is_called.is_set)
        client.send("getParameters", parameterNames=["/none"], id="later")
        assert client.next("parameterValues", id="later")["parameters"] == []
    is_over.set()


def test_parameters_are_read_written_and_watched(make_node: MakeNode, client: Client) -> None:
    other = make_node("other")
    other.params.set("/robot/speed", 1.0)
    other.params.set("/robot/name", "r2")
    client.send("getParameters", parameterNames=[], id="all")
    found = {each["name"]: each for each in client.next("parameterValues", id="all")["parameters"]}
    assert found["/robot/speed"] == {"name": "/robot/speed", "value": 1.0, "type": "float64"}
    client.send("getParameters", parameterNames=["/robot"])
    robot = {"name": "/robot", "value": {"speed": 1.0, "name": "r2"}}
    assert client.next("parameterValues")["parameters"] == [robot]

    client.send("subscribeParameterUpdates", parameterNames=["/robot/speed", "/robot/bytes"])
    wait_until(lambda: other.master.set_param("/robot/name", "r3") or True)
    values = [
        {"name": "/robot/speed", "value": 3, "type": "float64"},
        {"name": "/robot/bytes", "value": base64.b64encode(b"\0\1").decode(), "type": "byte_array"},
        {"name": "/robot/list", "value": [1, "two"]},
    ]
    client.send("setParameters", parameters=values, id="set")
    answer = client.next("parameterValues", id="set")["parameters"]
    assert (answer, other.params.get("/robot/speed")) == ([{**values[0], "value": 3.0}, *values[1:]], 3.0)
    assert other.params.get("/robot/list") == [1, "two"]
    client.send("setParameters", parameters=[{"name": "/robot/name"}], id="deleted")
    assert client.next("parameterValues", id="deleted")["parameters"] == []
    assert not other.params.has("/robot/name")
    client.send("setParameters", parameters=[{"name": "/robot/big", "value": 2**40}])
    assert "/robot/big" in client.next("status", level=2)["message"]


def test_only_the_requested_parameters_are_fetched(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch, client: Client
) -> None:
    other = make_node("other")
    for name in ("/robot/speed", "/robot/arm/joints", "/robots", "/large"):
        other.params.set(name, 1)
    fetched: list[str] = []
    fetch = MasterClient.get_param

    def record(master: MasterClient, name: str) -> Any:
        fetched.append(name)
        return fetch(master, name)

    monkeypatch.setattr(MasterClient, "get_param", record)

    def found(*names: str) -> list[str]:
        fetched.clear()
        client.send("getParameters", parameterNames=names, id="x")
        return sorted(each["name"] for each in client.next("parameterValues", id="x")["parameters"])

    assert found("/robot/speed", "/none", "robots") == ["/robot/speed", "/robots"]
    assert fetched == ["/none", "/robot/speed", "/robots"]
    assert found("/robot/arm/joints", "/robot") == ["/robot", "/robot/arm/joints"]
    assert fetched == ["/robot"]
    assert {"/large", "/robot/arm/joints", "/robot/speed"} <= {*found()}
    assert fetched == ["/"]
    many = [f"/x{number}" for number in range(FETCHED_APART + 1)]
    for names, expected in (("/",), ["/"]), (("/robot", "/"), ["/"]), (many, []):
        assert (found(*names), fetched) == (expected, ["/"])


def test_changes_of_other_nodes_reach_subscribers(make_node: MakeNode, client: Client) -> None:
    other = make_node("other")
    other.params.set("/speed", 1)
    client.send("subscribeParameterUpdates", parameterNames=["/speed"])
    numbers = itertools.count(100)

    def updates_after_a_change() -> list[Any]:
        other.params.set("/speed", next(numbers))  # again and again: the bridge may not subscribe yet
        other.params.set("/other", next(numbers))
        client.send("getParameters", parameterNames=["/none"], id="x")
        news = [each for each in client.news if isinstance(each, dict)]
        return [each for each in news if each["op"] == "parameterValues" and "id" not in each]

    (update, *_) = client.until(updates_after_a_change)
    assert [each["name"] for each in update["parameters"]] == ["/speed"]


def test_the_connection_graph_is_sent_and_followed(make_node: MakeNode, client: Client) -> None:
    make_node("talker").advertise("/chatter", String)
    client.until(lambda: "/chatter" in client.channels)
    client.send("subscribeConnectionGraph")
    update = client.next("connectionGraphUpdate")
    assert {"name": "/chatter", "publisherIds": ["/talker"]} in update["publishedTopics"]

    def wait_for(*subscribers: str) -> None:
        row = {"name": "/chatter", "subscriberIds": [*subscribers]}
        while row not in client.next("connectionGraphUpdate")["subscribedTopics"]:
            pass

    listener = make_node("listener").subscribe("/chatter", String, print)
    wait_for("/listener")
    listener.unregister()
    wait_for()
    client.send("unsubscribeConnectionGraph")


def test_simulated_time_is_sent(make_node: MakeNode) -> None:
    clock = make_node("simulator").advertise("/clock", Clock)
    bridge = make_node("bridge")
    bridge.use_simulated_time()
    with serving(bridge) as address, connected(address) as client:
        assert "time" in client.next("serverInfo")["capabilities"]
        wait_until(lambda: clock.connection_count == 1)
        message = Clock()
        message.clock.secs, message.clock.nsecs = 12, 34
        wait_until(lambda: clock.publish(message) or bridge.clock.now_ns())
        assert client.next_binary(2) == struct.pack("<Q", 12 * 10**9 + 34)


def test_assets_come_from_packages_only(master: Master, tmp_path: Path) -> None:
    package = tmp_path / "src" / "my_robot"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_robot</name></package>")
    (package / "meshes" / "arm.stl").write_bytes(b"solid" * 100_000)
    environment = Environment(master_uri=master.uri, package_path=(tmp_path / "src",))
    with (
        Node("bridge", environment=environment) as node,
        serving(node) as address,
        connected(address) as client,
    ):
        for number in range(3):
            client.send("fetchAsset", uri="package://my_robot/meshes/arm.stl", requestId=number)
        found = [client.next_binary(4) for _ in range(3)]
        assert sorted(each[:4] for each in found) == [struct.pack("<I", number) for number in range(3)]
        assert all(each[4:] == b"\0\0\0\0\0" + b"solid" * 100_000 for each in found)
        client.send("fetchAsset", uri="package://my_robot/../../secret.stl", requestId=9)
        failed = client.next_binary(4)
        assert failed[:5] == struct.pack("<IB", 9, 1)
        assert b"secret.stl" in failed


def test_a_read_only_server_changes_nothing(make_node: MakeNode) -> None:
    make_node("server").serve("/switch", SetBool, lambda _: SetBool._response_class())
    channel = {"id": 1, "topic": "/a", "encoding": "json", "schemaName": "std_msgs/String"}
    bridge = make_node("bridge")
    with serving(bridge, Rules(max_poll_s=0.2)) as address, connected(address) as client:
        assert not {"clientPublish", "services"} & set(client.next("serverInfo")["capabilities"])
        client.send("advertise", channels=[channel])
        assert "read-only" in client.next("status", level=2)["message"]
        client.socket.send(b"\1\0\0\0\0")
        assert "read-only" in client.next("status", level=2)["message"]
        client.send("setParameters", parameters=[{"name": "/x", "value": 1}], id="x")
        assert "read-only" in client.next("status", level=2)["message"]
        client.socket.send(struct.pack("<BIII", 2, 1, 7, 4) + b"ros1\1")
        assert "read-only" in client.next("serviceCallFailure", callId=7)["message"]
        assert not bridge.params.has("/x")
        assert client.services == {}


def test_whitelists_hide_names(make_node: MakeNode) -> None:
    node = make_node("talker")
    node.params.set("/open/x", 1)
    node.params.set("/hidden", 1)
    for topic in ("/open/a", "/hidden"):
        node.advertise(topic, String)
        node.serve(f"{topic}_service", SetBool, lambda _: SetBool._response_class())
    allowed = only("/open/.*")
    rules = Rules(allowed, allowed, allowed, has_control=True, max_poll_s=0.2)
    with serving(make_node("bridge"), rules) as address, connected(address) as client:
        client.until(lambda: client.channels and client.services)
        client.send("subscribeConnectionGraph")
        graph = client.next("connectionGraphUpdate")
        assert [each["name"] for each in graph["publishedTopics"]] == ["/open/a"]
        assert (list(client.channels), list(client.services)) == (["/open/a"], ["/open/a_service"])
        client.send("getParameters", parameterNames=[], id="all")
        assert [each["name"] for each in client.next("parameterValues")["parameters"]] == ["/open/x"]
        client.send("setParameters", parameters=[{"name": "hidden", "value": 2}])
        assert "whitelist" in client.next("status", level=2)["message"]
        channel = {"id": 1, "topic": "hidden", "encoding": "json", "schemaName": "std_msgs/String"}
        client.send("advertise", channels=[channel])
        assert "whitelist" in client.next("status", level=2)["message"]
        assert node.params.get("/hidden") == 1


def test_a_capability_that_is_not_offered_is_refused(make_node: MakeNode) -> None:
    rules = Rules(has_control=True, capabilities=["services"])
    with serving(make_node("bridge"), rules) as address, connected(address) as client:
        assert client.next("serverInfo")["capabilities"] == ["services"]
        client.send("getParameters", parameterNames=[])
        text = client.next("status", level=2)["message"]
        assert text == "this server does not offer the capability parameters"


def test_it_continues_after_the_master_was_unavailable(make_node: MakeNode, master: Master) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    with serving(make_node("bridge"), CONTROL) as address, connected(address) as client:
        client.subscribe(1, "/chatter")
        wait_until(lambda: publisher.connection_count == 1)
        master.stop()
        publisher.publish(String("alone"))
        assert text_of(client.next_message()[2]) == "alone"
        client.send("getParameters", parameterNames=[])
        assert "master" in client.next("status", level=2)["message"]


def test_bad_requests_are_answered_with_a_status(client: Client) -> None:
    for data in ("{", "[]", '{"op": "fly"}', b"", b"\1", b"\x09", '{"op": "subscribe"}', "[" * 100_000):
        client.socket.send(data)
        assert client.next("status")["level"] == 2
    client.send("subscribe", subscriptions=[{"id": 1, "channelId": 99}])
    assert client.next("status", level=1)["message"] == "channel 99 does not exist"
    client.send("unsubscribe", subscriptionIds=[4])
    assert client.next("status", level=1)["message"] == "subscription 4 does not exist"
