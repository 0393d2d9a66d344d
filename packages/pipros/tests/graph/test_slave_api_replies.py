"""Replies of the slave API to invalid requests, and its description of the links."""

from __future__ import annotations

import re
import socket
import struct
from xmlrpc.client import ServerProxy

from pipros.msg import load_message_class
from pipros.wire.header import encode_header
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until

String = load_message_class("std_msgs/String")


def answer_to(node: object, data: bytes) -> bytes:
    """Return the bytes that the node sends after this beginning of a connection, until it closes."""
    with ServerProxy(node.uri) as slave:
        _, _, (_, host, port) = slave.requestTopic("/me", "/chat", [["TCPROS"]])
    with socket.create_connection((host, port), timeout=30) as connection:
        connection.sendall(data)
        return connection.recv(4096)


def test_a_node_returns_its_uri_and_refuses_publishers_without_one(make_node: MakeNode) -> None:
    node = make_node("told")
    with ServerProxy(node.uri) as slave:
        assert slave.getUri("/me") == [1, "", node.uri]
        assert slave.getUri() == [-1, "missing required caller_id parameter", ""]
        assert slave.publisherUpdate("/master", "/chat", ["http://127.0.0.1:1/"])[0] == 1
        for publishers in ("http://h:1", [5], ["x"], ["http://h:1", "y"], [""]):
            assert slave.publisherUpdate("/master", "/chat", publishers)[::2] == [-1, -1]


def test_a_refused_subscriber_is_sent_the_list_of_topics(make_node: MakeNode) -> None:
    node = make_node("refusing")
    node.advertise("/chat", String)
    header = {"topic": "/none", "md5sum": String._md5sum, "callerid": "/me", "type": "std_msgs/String"}
    refusal = answer_to(node, encode_header(header)).decode()
    assert "[/refusing] is not a publisher of [/none]. Topics are [['/chat', 'std_msgs/String']]" in refusal


def test_an_empty_header_closes_the_connection_silently(make_node: MakeNode) -> None:
    node = make_node("silent")
    node.advertise("/chat", String)
    assert answer_to(node, struct.pack("<I", 0)) == b""


def test_both_ends_of_a_link_name_transport_port_and_socket(make_node: MakeNode, transport: str) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("/chat", String)
    subscriber = listener.subscribe("/chat", String, lambda message: None)
    wait_until(lambda: publisher.connection_count == subscriber.connection_count == 1)
    pattern = re.compile(transport + r" connection on port (\d+) to \[(.*) on socket (\d+)\]")
    remarks = []
    for node in (talker, listener):
        with ServerProxy(node.uri) as slave:
            (link,) = slave.getBusInfo("/me")[2]
        assert link[3] == transport
        found = pattern.fullmatch(link[6])
        assert found is not None, link
        remarks.append(found)
    end = f":{remarks[1][1]}" if transport == "TCPROS" else "this machine"
    assert remarks[0][2].endswith(end)
