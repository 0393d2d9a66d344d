"""Hostile, silent, dying and broken peers of a node: it serves all others, and nothing is left."""

import random
import socket
import struct
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.service_link import ServiceFailed
from pipros.wire.header import HeaderReader, encode_header
from tests.chaos.counting import count, wait_until_back
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.waiting import wait_until

# Hostile, silent and broken peers of a node: it continues to serve all others.


def assert_serves(node: Node, make_node: MakeNode, name: str = "friend") -> None:
    """Check that a new subscriber gets a message on the node's topic `chat`."""
    inbox, friend = Inbox(), make_node(name)
    friend.subscribe("chat", String, inbox)
    publication = node.endpoints.publication("/chat")
    wait_until(lambda: [peer for peer in publication.links if peer.caller_id == f"/{name}"])
    publication.publish(String("hello"))
    assert inbox.wait()[0].data == "hello"


def test_silent_peers_beyond_the_limit_lock_nobody_out(make_node: MakeNode, constants: Constants) -> None:
    constants(HANDSHAKES=8)
    node = make_node("talker")
    node.advertise("chat", String)
    silent = [socket.create_connection(("127.0.0.1", node.endpoints.port), 10) for _ in range(30)]
    assert_serves(node, make_node)
    for peer in silent[:20]:
        assert peer.recv(1) == b""  # the link that had waited longest was closed
    for peer in silent:
        peer.close()


def test_a_silent_peer_is_closed_in_time(make_node: MakeNode, constants: Constants) -> None:
    constants(HANDSHAKE_S=0.05)
    node = make_node("talker")
    with socket.create_connection(("127.0.0.1", node.endpoints.port), 10) as silent:
        silent.sendall(b"\x10")
        assert silent.recv(1) == b""


class FakePublisher:
    """A peer registered as a publisher, which sends the bytes of a test."""

    def __init__(self, master: Master, body: bytes) -> None:
        from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

        class Quiet(SimpleXMLRPCRequestHandler):
            def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
                pass

        self.body = body
        self.links = 0
        self.data = socket.create_server(("127.0.0.1", 0))
        self.api = SimpleXMLRPCServer(("127.0.0.1", 0), Quiet)
        port = self.data.getsockname()[1]
        self.api.register_function(lambda *_: [1, "", ["TCPROS", "127.0.0.1", port]], "requestTopic")
        self.threads = [
            threading.Thread(target=self.api.serve_forever, kwargs={"poll_interval": 0.01}),
            threading.Thread(target=self.serve, daemon=True),
        ]
        for thread in self.threads:
            thread.start()
        self.client = MasterClient(master.uri, "/fake")
        uri = f"http://127.0.0.1:{self.api.server_address[1]}/"
        self.client.register_publisher("/chat", "std_msgs/String", uri)

    def serve(self) -> None:
        while True:
            try:
                peer, _ = self.data.accept()
            except OSError:
                return
            with peer:
                read_header(peer)
                header = {"md5sum": String._md5sum, "type": "std_msgs/String", "callerid": "/fake"}
                peer.sendall(encode_header({**header, "topic": "/chat", "latching": "0"}) + self.body)
                self.links += 1

    def close(self) -> None:
        self.api.shutdown()
        self.api.server_close()
        self.data.shutdown(socket.SHUT_RDWR)
        self.data.close()
        for thread in self.threads:
            thread.join(10)
        self.client.close()


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        (struct.pack("<II", 4, 100), "cannot decode 4 bytes as std_msgs/String"),
        (struct.pack("<I", 0xFFFFFFFF), "message of 4294967295 bytes was announced; the limit is"),
    ],
    ids=["no message", "too large"],
)
def test_a_publisher_that_sends_garbage_is_disconnected_and_logged(
    make_node: MakeNode, master: Master, body: bytes, complaint: str
) -> None:
    fake = FakePublisher(master, body)
    log, lines = listening_log()
    listener, inbox = make_node("listener", log=log), Inbox()
    listener.subscribe("chat", String, inbox)
    wait_until(lambda: lines)
    assert complaint in lines[0]
    fake.close()
    publisher = make_node("talker").advertise("chat", String)
    wait_until_connected(publisher)
    publisher.publish(String("good"))
    assert inbox.wait()[0].data == "good"


def test_a_publisher_that_stops_mid_message_is_reconnected(make_node: MakeNode, master: Master) -> None:
    fake = FakePublisher(master, struct.pack("<II", 14, 10) + b"half")
    inbox, listener = Inbox(), make_node("listener")
    listener.subscribe("chat", String, inbox)
    wait_until(lambda: fake.links >= 3)
    fake.body = struct.pack("<II", 8, 4) + b"full"
    assert inbox.wait()[0].data == "full"
    fake.close()


def test_a_master_that_hangs_does_not_keep_a_node_from_ending() -> None:
    with socket.create_server(("127.0.0.1", 0)) as hung:
        uri = f"http://127.0.0.1:{hung.getsockname()[1]}/"
        node = Node("node", environment=Environment(master_uri=uri))
        node.start()
        advertising = threading.Thread(target=node.advertise, args=("chat", String))
        advertising.start()
        peer, _ = hung.accept()
        with peer:
            while b"registerPublisher" not in peer.recv(65536):
                pass
            node.shutdown("the end")
            advertising.join(10)
            assert not advertising.is_alive()


# Peers that die in the middle of a message, or send garbage, leave no resources behind.


needs_dying = pytest.mark.skipif(sys.platform != "linux", reason="counts descriptors in /proc")


SUBSCRIBE = encode_header({"topic": "/chat", "md5sum": "*", "callerid": "/mayfly"})
CALL = encode_header({"service": "/set", "md5sum": SetBool._md5sum, "callerid": "/mayfly"})


def connect(node: Node) -> socket.socket:
    return socket.create_connection(("127.0.0.1", node.endpoints.port), 30)


def read_header(sock: socket.socket) -> None:
    reader = HeaderReader()
    while reader.feed(sock.recv(4096)) is None:
        pass


def nonsense(seed: int) -> bytes:
    """Bytes that no peer should send: noise, wrong lengths, and incomplete headers."""
    chance = random.Random(seed)  # noqa: S311 - repeatable, not secret
    noise = chance.randbytes(chance.randrange(1, 200))
    length = struct.pack("<I", chance.choice([0, 1, 3, len(noise), 2**31 - 1, 2**32 - 1]))
    return chance.choice(
        [
            noise, length, length + noise, SUBSCRIBE[: chance.randrange(len(SUBSCRIBE))],
            b"GET / HTTP/1.1\r\n\r\n",
        ]
    )  # fmt: skip


def assert_all_goes_on(make_node: MakeNode, publisher: Any) -> None:
    inbox, listener = Inbox(), make_node("friend")
    listener.subscribe("chat", String, inbox)
    # The link of a dead peer may appear late.
    wait_until(lambda: any(peer.caller_id == "/friend" for peer in publisher.publication.links))
    publisher.publish(String("hello"))
    assert inbox.wait()[0].data == "hello"
    assert listener.client("set", SetBool).call(SetBool._request_class(data=True), 30).success


@pytest.fixture
def node(make_node: MakeNode) -> Node:
    node = make_node("node")
    node.advertise("chat", String)
    node.serve("set", SetBool, lambda request: SetBool._response_class(success=request.data))
    return node


def subscribe_and_leave(node: Node) -> None:
    with connect(node) as peer:
        peer.sendall(SUBSCRIBE)
        read_header(peer)


def die_within_the_header(node: Node) -> None:
    with connect(node) as peer:
        peer.sendall(SUBSCRIBE[:10])


def die_between_header_and_request(node: Node) -> None:
    with connect(node) as peer:
        peer.sendall(CALL)
        read_header(peer)


def die_within_the_request(node: Node) -> None:
    with connect(node) as peer:
        peer.sendall(CALL + struct.pack("<I", 1000) + b"half")
        read_header(peer)


def announce_4_gigabytes(node: Node) -> None:
    with connect(node) as peer:
        peer.sendall(CALL + struct.pack("<I", 0xFFFFFFFF))
        read_header(peer)
        assert peer.recv(1) == b""


def die_without_reading_the_answer(node: Node) -> None:
    with connect(node) as peer:
        peer.setsockopt(
            socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0)
        )  # closing resets the connection
        peer.sendall(CALL + struct.pack("<IB", 1, 1))


def send_nonsense(node: Node) -> None:
    for seed in range(20):
        with connect(node) as peer:
            peer.sendall(nonsense(seed))


@needs_dying
@pytest.mark.parametrize("die", [
    subscribe_and_leave, die_within_the_header, die_between_header_and_request, die_within_the_request,
    announce_4_gigabytes, die_without_reading_the_answer, send_nonsense,
])  # fmt: skip
def test_crashed_peers_leave_nothing(make_node: MakeNode, node: Node, die: Callable[[Node], None]) -> None:
    publication = node.endpoints.publication("/chat")
    die(node)
    wait_until(lambda: not publication.links)
    before = count()
    for _ in range(20):
        die(node)
    wait_until(lambda: not publication.links)
    wait_until_back(before)
    assert_all_goes_on(make_node, node.advertise("chat", String))


@needs_dying
def test_a_thousand_former_subscribers_leave_no_resources_behind(make_node: MakeNode, node: Node) -> None:
    publisher = node.advertise("chat", String)
    publication = publisher.publication

    def come_and_go(times: int) -> None:
        for _ in range(times):
            subscribe_and_leave(node)
            publisher.publish(String("x" * 1000))
        wait_until(lambda: not publication.links)

    come_and_go(100)
    before = count()
    come_and_go(1000)
    wait_until_back(before)
    assert_all_goes_on(make_node, publisher)


@needs_dying
def test_a_thousand_calls_leave_no_resources_behind(node: Node, make_node: MakeNode) -> None:
    client = make_node("client").client("set", SetBool)
    request = SetBool._request_class(data=True)
    client.call(request, 30)
    before = count()
    for _ in range(1000):
        assert client.call(request, 30).success
    wait_until_back(before)


@needs_dying
@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        (b"", "unable to receive data from sender"), (b"\x01", "unable to receive data from sender"),
        (b"\x01" + struct.pack("<I", 1000) + b"half", "unable to receive data from sender"),
        (b"\x00" + struct.pack("<I", 4), "unable to receive data from sender"),
        (b"\x01" + struct.pack("<I", 0xFFFFFFFF), "4294967295 bytes was announced; the limit is"),
    ],
    ids=["silence", "within the answer", "within the body", "within the error", "4 GB announced"],
)  # fmt: skip
def test_a_call_ends_with_an_error_when_the_server_dies(make_node, master, answer, complaint: str) -> None:
    node = make_node("client")
    client = node.client("set", SetBool)
    node.master.get_pid()  # the node keeps a connection to its master
    before = count()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            peer, _ = server.accept()
            with peer:
                read_header(peer)
                header = {"md5sum": SetBool._md5sum, "type": "std_srvs/SetBool", "callerid": "/fake"}
                peer.sendall(encode_header(header))
                peer.recv(4096)
                peer.sendall(answer)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        register = MasterClient(master.uri, "/fake")
        register.register_service(
            "/set", f"rosrpc://127.0.0.1:{server.getsockname()[1]}", "http://127.0.0.1:1/"
        )
        register.close()
        with pytest.raises(ServiceFailed, match=complaint):
            client.call(SetBool._request_class(data=True), 30)
        thread.join(10)
    wait_until_back(before)
