"""Hostile, silent and broken peers of a node: it continues to serve all others."""

from __future__ import annotations

import socket
import struct
import threading
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.wire.header import HeaderReader, encode_header
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")


def assert_serves(node: Node, make_node: MakeNode, name: str = "friend") -> None:
    """Check that a new subscriber gets a message on the node's topic `chat`."""
    inbox, friend = Inbox(), make_node(name)
    friend.subscribe("chat", String, inbox)
    publication = node.endpoints.publication("/chat")
    assert publication is not None
    wait_until(lambda: [peer for peer in publication.links if peer.caller_id == f"/{name}"])
    publication.publish(String("hello"))
    assert inbox.wait()[0].data == "hello"


def test_silent_peers_beyond_the_handshake_limit_do_not_lock_others_out(
    make_node: MakeNode, constants: Constants
) -> None:
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


def test_a_header_sent_byte_by_byte_is_a_header(make_node: MakeNode) -> None:
    node = make_node("talker")
    node.advertise("chat", String)
    with socket.create_connection(("127.0.0.1", node.endpoints.port), 10) as slow:
        slow.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in encode_header({"topic": "/chat", "md5sum": "*", "callerid": "/slow"}):
            slow.sendall(bytes([byte]))
        reader = HeaderReader()
        while (answer := reader.feed(slow.recv(4096))) is None:
            pass
        assert answer["type"] == "std_msgs/String"


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
                reader = HeaderReader()
                while reader.feed(peer.recv(4096)) is None:
                    pass
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


def test_an_invalid_publisher_list_is_harmless(make_node: MakeNode, master: Master) -> None:
    from pipros.net.rpc_client import RpcClient

    listener, inbox = make_node("listener"), Inbox()
    listener.subscribe("chat", String, inbox)
    with RpcClient(listener.uri) as peer:
        refused = peer.call("publisherUpdate", "/master", "/chat", ["not a URI", 7, "http://127.0.0.1:1/"])
        answer = peer.call("publisherUpdate", "/master", "/chat", ["http://127.0.0.1:1/"])
    assert refused[0] == -1
    assert answer == [1, "", 0]
    publisher = make_node("talker").advertise("chat", String)
    wait_until_connected(publisher)
    publisher.publish(String("good"))
    assert inbox.wait()[0].data == "good"


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
