"""Hostile clients of rosbridge and publishers: refused or limited, without effect on other clients."""

import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import chain, repeat
from typing import Any

import bson
import pytest
from websockets.exceptions import ConnectionClosed, InvalidMessage

from pipros.basics.limits import Limits
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.rosbridge.authentication import Authenticator
from pipros_bridges.rosbridge.server import ServerOptions
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.stream_servers import TcpServer
from pipros_bridges.rosbridge.udp_server import UdpServer
from tests.graph.running import running
from tests.support.constants import Constants
from tests.support.memory import memory_of
from tests.support.node_fixtures import make_node as make_node
from tests.support.node_fixtures import master as master
from tests.support.nodes import MakeNode
from tests.support.ros import RosSystem
from tests.support.rosbridge import RosbridgeClient, rosbridge_server
from tests.support.waiting import wait_until

STRING: Any = load_message_class("std_msgs/String")
LIMITS = Limits(tables=(BridgeLimits(bridge_message_bytes=10_000, bridge_queue_bytes=100_000),))


@pytest.fixture
def robot(make_node: MakeNode) -> Node:
    robot = make_node("robot")
    robot.advertise("/state", STRING, latch=True).publish(STRING("well"))
    return robot


@pytest.fixture
def url(make_node: MakeNode, robot: Node, constants: Constants) -> Iterator[str]:
    constants(BRIDGE_TOPICS=20)
    with rosbridge_server(make_node("bridge", limits=LIMITS)) as found:
        yield found


def is_served(url: str) -> None:
    """Assert that another client gets a message, once the server has noticed that the attacker has left."""
    with RosbridgeClient(url) as other:

        def answer() -> Any:
            other.send("subscribe", topic="/state")
            return other.receive().get("msg")

        wait_until(lambda: answer() == {"data": "well"}, 60)


def test_an_oversized_message_ends_its_client_only(url: str) -> None:
    with RosbridgeClient(url) as client:
        client.socket.send(json.dumps({"op": "publish", "topic": "/x", "msg": "x" * 20_000}))
        with pytest.raises(ConnectionClosed):
            client.receive()
    is_served(url)


class Hostile(AnyMsg):
    """A type whose definition is an attack."""

    _type = "hostile/Type"
    _md5sum = "0" * 32
    _full_text = "".join(f"Type{number}[1000] a{number}\n" for number in range(500))


class Lying(AnyMsg):
    """Bytes that do not fit their type."""

    _type = STRING._type
    _md5sum = STRING._md5sum
    _full_text = STRING._full_text


@pytest.mark.parametrize("message", [Hostile(b"\0" * 100), Lying(b"\xff\xff\xff\x7fx")])
def test_hostile_messages_of_a_publisher_are_reported(url: str, robot: Node, message: AnyMsg) -> None:
    publisher = robot.advertise("/hostile", type(message))
    with RosbridgeClient(url) as client:
        client.send("subscribe", topic="/hostile")
        end = threading.Event()

        def publish() -> None:
            while not end.wait(0.05):
                publisher.publish(message)

        thread = threading.Thread(target=publish, daemon=True)
        thread.start()
        text = client.wait_for("status")["msg"]
        end.set()
        thread.join()
        assert text.startswith("[/hostile]: ")
    is_served(url)


def test_the_topics_of_clients_that_come_and_go_are_limited(url: str) -> None:
    for number in range(3):
        with RosbridgeClient(url) as client:
            for each in range(15):
                client.send("advertise", topic=f"/t{number}_{each}", type="std_msgs/String")
            assert client.call("/none")["result"] is False
    with RosbridgeClient(url) as client:
        for each in range(30):
            client.send("subscribe", topic=f"/s{each}")
        assert "too many topics: this client has 18" in client.wait_for("status")["msg"]
    is_served(url)


def test_the_open_calls_of_a_client_are_limited(url: str, robot: Node) -> None:
    empty: Any = load_service_class("std_srvs/Empty")
    release = threading.Event()

    def wait(_: Any) -> Any:
        release.wait(30)
        return empty._response_class()

    robot.serve("/slow", empty, wait)
    wait_until(lambda: _is_offered(robot, "/slow"))
    with RosbridgeClient(url) as client:
        for number in range(300):
            client.send("call_service", service="/slow", id=number)
        refused = client.wait_for("service_response")
        assert (refused["result"], "calls from this client are pending" in refused["values"]) == (False, True)
        is_served(url)
        release.set()


def _is_offered(robot: Node, service: str) -> bool:
    try:
        robot.master.lookup_service(service)
    except Exception:
        return False
    return True


def test_a_client_that_asks_without_reading_is_disconnected(url: str) -> None:
    with RosbridgeClient(url, max_queue=1) as client:

        def ask_for_ever() -> None:
            while True:
                client.send("call_service", service="x" * 3000 + " ")

        with pytest.raises(ConnectionClosed):
            ask_for_ever()
    is_served(url)


@pytest.mark.parametrize("program", ["rosbridge_websocket", "rosbridge_tcp"])
def test_silent_connections_beyond_the_descriptors_leave_room_for_clients(
    ros: RosSystem, program: str
) -> None:
    ros.serve_master()
    server = ros.pipros.start(
        *("sh", "-c", 'ulimit -n 128; exec "$@"', "sh"), *("rosrun", "rosbridge_server", program, "_port:=0")
    )
    port = int(server.wait_for(r"server started on port (\d+)", 60)[1])
    request = {"op": "call_service", "service": "/none"}
    with ExitStack() as silent:
        for _ in range(256):
            connection = silent.enter_context(socket.socket())
            connection.setblocking(False)
            connection.connect_ex(("127.0.0.1", port))

        def answer() -> bytes | str:
            try:
                if program == "rosbridge_tcp":
                    with socket.create_connection(("127.0.0.1", port), 20) as client:
                        client.sendall(json.dumps(request).encode())
                        return client.recv(1000)
                with RosbridgeClient(f"ws://127.0.0.1:{port}") as client:
                    return json.dumps(client.call("/none"))
            except (OSError, EOFError, InvalidMessage, ConnectionClosed):
                # The server closes unused clients for newer connections, which may come before the request.
                return ""

        wait_until(lambda: "service_response" in str(answer()), 60)


@pytest.mark.parametrize("is_bson", [False, True])
@pytest.mark.parametrize("is_trickling", [False, True])
def test_tcp_clients_that_do_not_log_in_keep_little_and_not_for_long(
    make_node: MakeNode, is_bson: bool, is_trickling: bool, constants: Constants
) -> None:
    constants(LOGIN_BYTES=10000)
    node = make_node("bridge", limits=Limits()._replace(login_s=0.5))
    settings = RosbridgeSettings(authenticator=Authenticator("0123456789abcdef", time.time), is_bson=is_bson)
    server = TcpServer(node, ServerOptions(port=0, settings=settings))
    port = server.start()
    start = (5_000_000).to_bytes(4, "little") + b"\2op\0" if is_bson else b'{"op": "'
    part = b"x" if is_trickling else b"x" * 100_000
    try:
        with socket.create_connection(("127.0.0.1", port), 20) as client:
            client.sendall(start)
            sent = 0

            def is_ended() -> bool:
                nonlocal sent
                try:
                    sent += client.send(part, socket.MSG_DONTWAIT)
                    return client.recv(1, socket.MSG_DONTWAIT) == b""
                except BlockingIOError:
                    return False
                except OSError:
                    return True

            wait_until(is_ended, 20)
    finally:
        server.close()
    assert server.shares.memory.used == 0
    assert server.shares.memory.peak <= 100_000


def test_a_tcp_message_must_end_in_time(make_node: MakeNode, constants: Constants) -> None:
    for is_bson, start in ((False, b'{"op": "'), (True, (1000).to_bytes(4, "little"))):
        constants(WHOLE_REQUEST_S=0.3)
        node = make_node(f"bridge{is_bson}", limits=Limits())
        server = TcpServer(node, ServerOptions(port=0, settings=RosbridgeSettings(is_bson=is_bson)))
        with running(server) as port, socket.create_connection(("127.0.0.1", port), 20) as client:
            client.sendall(start)
            assert client.recv(1) == b""


def test_udp_addresses_that_say_nothing_sensible_leave_room_for_clients(
    make_node: MakeNode, robot: Node
) -> None:
    server = UdpServer(
        make_node("bridge", limits=Limits(tables=(BridgeLimits(bridge_clients=5),))), ServerOptions(port=0)
    )
    with running(server) as port:
        address = "127.0.0.1", port
        with ExitStack() as sockets_of_attacker:
            for number in range(60):
                attacker = sockets_of_attacker.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
                attacker.sendto([b"hello", b'{"op": "x', b'{"op": "x"}'][number % 3], address)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
                client.settimeout(20)
                client.sendto(b'{"op": "subscribe", ', address)
                client.sendto(b'"topic": "/state"}', address)
                assert json.loads(client.recv(10_000))["msg"] == {"data": "well"}
    wait_until(lambda: server.shares.memory.used == 0)


def test_a_udp_stranger_takes_little_memory_and_time(make_node: MakeNode) -> None:
    server = UdpServer(make_node("bridge"), ServerOptions(port=0))
    begin_s = time.process_time()
    with memory_of(5_000_000):
        for data in chain([b'{"op": '], repeat(b"", 1_000_000), repeat(b"x" + b"{}" * 32_000, 50)):
            server.take(data, "stranger")
    assert time.process_time() - begin_s < 2.5


def test_udp_clients_may_use_bson(make_node: MakeNode, robot: Node) -> None:
    server = UdpServer(make_node("bridge"), ServerOptions(port=0, settings=RosbridgeSettings(is_bson=True)))
    with running(server) as port:
        address = "127.0.0.1", port
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(20)
            client.sendto(b"not BSON", address)
            client.sendto(bson.encode({"op": "subscribe", "topic": "/state"}), address)
            assert bson.decode(client.recv(10_000))["msg"] == {"data": "well"}


def test_a_reader_that_subscribes_again_and_again_does_not_delay_the_others(
    make_node: MakeNode, robot: Node
) -> None:
    node = make_node("bridge")
    with (
        rosbridge_server(node, settings=RosbridgeSettings(has_control=False)) as url,
        RosbridgeClient(url) as reader,
    ):
        for number in range(3000):
            options = {"queue_length": number, "topic": f"/s{number % 400}", "type": "std_msgs/String"}
            reader.send("subscribe", **options)
        is_served(url)
        assert reader.call("/rosapi/topic_type#1")["op"] == "service_response"
        types = [topic for topic, _ in robot.master.get_topic_types()]
        # A client that may only read does not decide which types others see.
        assert [topic for topic in types if topic.startswith("/s")] == ["/state"]
