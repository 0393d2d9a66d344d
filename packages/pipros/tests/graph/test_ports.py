"""Nodes with ports from a range, and with an advertised address that differs from the bound one."""

from __future__ import annotations

import contextlib
import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment, InvalidEnvironment
from pipros.basics.ports import PortRange
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.net import address
from pipros.net.address import address_here, split_uri
from pipros.net.rpc_client import RpcClient
from pipros.net.sockets import NoFreePort
from pipros.node import Node
from pipros.wire.header import encode_header
from pipros.wire.http import build_request
from pipros.wire.xmlrpc import encode_call
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.users import NOBODY, needs_nobody

String: Any = load_message_class("std_msgs/String")
SetBool: Any = load_service_class("std_srvs/SetBool")

PORTS = "30000-32000"

NOWHERE = "192.0.2.7"
"""An address that leads nowhere (RFC 5737)."""


@pytest.fixture
def port() -> Iterator[int]:
    claimed = ClaimedPort()
    yield claimed.number
    claimed.release()


def ports_of(node: Node) -> set[int]:
    return {node.endpoints.port, split_uri(node.uri)[1]}


def test_nodes_take_their_ports_from_the_range(master: Master, port: int) -> None:
    with socket.socket() as taken, ExitStack() as running:
        taken.bind(("127.0.0.1", port))
        taken.listen()
        environment = Environment(master_uri=master.uri, ports=f"{port}-{port + 20}")
        nodes = [running.enter_context(Node(f"n{i}", environment=environment)) for i in range(3)]
        ports = [ports_of(node) for node in nodes]
        assert all(each in range(port + 1, port + 21) for found in ports for each in found)
        assert len(set.union(*ports)) == 3  # one port for each node


def test_an_exhausted_range_names_the_programs_that_hold_its_ports(master: Master, port: int) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", port))
        taken.listen()
        node = Node("full", environment=Environment(master_uri=master.uri), ports=f"{port}-{port}")
        with pytest.raises(NoFreePort, match=rf"no free port in {port} .*In use: {port} .*pid {os.getpid()}"):
            node.start()


def test_ports_exclude_single_ports_and_must_be_a_range(master: Master) -> None:
    environment = Environment(master_uri=master.uri)
    for options in ({"rpc_port": 5000}, {"tcpros_port": 5000}):
        with pytest.raises(ValueError, match="ports cannot be combined with rpc_port or tcpros_port"):
            Node("one", environment=environment, ports="5000-5010", **options)
    with pytest.raises(InvalidEnvironment, match=r"ports \[5010-5000\] must be"):
        Node("one", environment=environment, ports="5010-5000")


def test_peers_are_told_the_advertised_address_and_the_node_recognises_it(
    monkeypatch: pytest.MonkeyPatch, port: int
) -> None:
    ports = ClaimedPort()
    outside = f"{NOWHERE}:21311={port},31400-31405={ports.number}-{ports.number + 5}"
    monkeypatch.setenv("PIPROS_PORTS", f"{ports.number}-{ports.number + 5}")
    monkeypatch.setenv("PIPROS_ADVERTISE", outside)
    inbox = Inbox()
    with Master(port=port) as master:
        monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
        assert master.uri == f"http://{NOWHERE}:21311/"
        with Node("one") as one, Node("two") as two:
            for node in (one, two):
                host, number, _ = split_uri(node.uri)
                assert (host, number in range(31400, 31406)) == (NOWHERE, True)
            two.subscribe("chat", String, inbox)
            one.advertise("chat", String, latch=True).publish(String("hello"))
            assert [message.data for message in inbox.wait()] == ["hello"]
            with RpcClient(one.uri, timeout_s=10) as slave:
                _, _, [_, host, number] = slave.call("requestTopic", "/test", "/chat", [["TCPROS"]])
            assert (host, number in range(31400, 31406)) == (NOWHERE, True)
            one.serve("answer", SetBool, lambda request: SetBool._response_class(request.data, "done"))
            host, number, _ = split_uri(two.master.lookup_service("/answer"), ["rosrpc"])
            assert (host, number in range(31400, 31406)) == (NOWHERE, True)
            assert two.client("answer", SetBool).call(SetBool._request_class(data=True)).message == "done"
    ports.release()


def test_only_advertised_addresses_of_this_machine_lead_back_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIPROS_PORTS", "5000-5001")
    monkeypatch.setenv("ROS_MASTER_URI", f"http://{NOWHERE}:11311")
    monkeypatch.setenv("PIPROS_ADVERTISE", "Robot:31400-31401")
    assert address_here("robot", 31401) == ("127.0.0.1", 5001)
    assert address_here("robot", 5001) == ("robot", 5001)
    assert address_here("other", 31401) == ("other", 31401)
    monkeypatch.setenv("PIPROS_ADVERTISE", "robot")
    assert address_here("robot", 5001) == ("127.0.0.1", 5001)
    assert address_here("robot", 5002) == ("robot", 5002)
    monkeypatch.setenv("PIPROS_ADVERTISE", "robot:x")
    assert address_here("robot", 5001) == ("robot", 5001)


def test_an_advertised_address_opens_nothing() -> None:
    environment = Environment(advertise="robot.example")
    assert address.bind_host(environment) == "127.0.0.1"
    assert address.advertised_address(environment).outside(5000) == ("robot.example", 5000)


def test_a_port_answers_http_and_tcpros_even_in_single_bytes(make_node: MakeNode) -> None:
    node = make_node("one", ports=PORTS)
    node.advertise("chat", String, latch=True).publish(String("hello"))
    assert ports_of(node) == {node.endpoints.port}
    header = encode_header({"topic": "/chat", "md5sum": "*", "type": "*", "callerid": "/test"})
    request = build_request("h", "/", encode_call("getName", ("/test",)))
    for data, answer in ((header, b"topic=/chat"), (request, b"<string>/one</string>")):
        for pieces in (
            [data],
            [data[:2], data[2:3], data[3:]],
            [data[at : at + 1] for at in range(len(data))],
        ):
            with socket.create_connection(("127.0.0.1", node.endpoints.port), 10) as peer:
                for piece in pieces:
                    peer.sendall(piece)
                received = b""
                while answer not in received:
                    received += (more := peer.recv(1000))
                    assert more


def test_requests_that_arrive_at_once_are_answered_in_order(make_node: MakeNode) -> None:
    node = make_node("one", ports=PORTS)
    requests = [build_request("h", "/", encode_call(method, ("/t",))) for method in ("getName", "getUri")]
    with socket.create_connection(("127.0.0.1", node.endpoints.port), 10) as peer:
        peer.sendall(b"".join(requests * 3))
        received = b""
        while received.count(b"</methodResponse>") < 6:
            received += (more := peer.recv(1000))
            assert more
    assert received.count(b"/one<") == received.count(node.uri.encode()) == 3


def test_without_a_range_a_node_has_two_ports(make_node: MakeNode) -> None:
    claimed = ClaimedPort(), ClaimedPort()
    rpc_port, tcpros_port = (port.number for port in claimed)
    node = make_node("one", rpc_port=rpc_port, tcpros_port=tcpros_port)
    assert (split_uri(node.uri)[1], node.endpoints.port) == (rpc_port, tcpros_port)
    assert len(ports_of(make_node("two"))) == 2
    for port in claimed:
        port.release()


def test_a_silent_connection_of_the_slave_api_ends_with_the_handshake(
    make_node: MakeNode, constants: Constants
) -> None:
    constants(HANDSHAKE_S=0.2)
    node = make_node("one", ports=PORTS)
    with socket.create_connection(("127.0.0.1", node.endpoints.port), 10) as peer:
        peer.sendall(b"PO")
        with contextlib.suppress(ConnectionResetError):  # the limit may have passed before they were sent
            assert peer.recv(1) == b""


LISTEN_BELOW_1024 = """
from pipros.basics.ports import PortRange
from pipros.net.sockets import NoFreePort, listen
try:
    listen("127.0.0.1", PortRange(80, 82))
except NoFreePort as error:
    print(error)
"""


@needs_nobody
def test_a_privileged_range_is_named_as_such() -> None:
    command = [*NOBODY, sys.executable, "-c", LISTEN_BELOW_1024]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=30).stdout
    assert "no free port in 80-82 on 127.0.0.1; ports below 1024 need privileges" in printed


def test_roslaunch_gives_its_nodes_the_range_of_its_option(ros: RosSystem, tmp_path: Path) -> None:
    ports = ClaimedPort()
    wanted = f"{ports.number}-{ports.number + 20}"
    file = tmp_path / "x.launch"
    file.write_text('<launch><node pkg="composiv_tryouts" type="composiv_talker.py" name="talker"/></launch>')
    running = ros.pipros.start("roslaunch", str(file), "--ports", wanted)
    ros.wait_for_publisher("/battery_topic")
    info = "\n".join(ros.pipros.run("rosnode", "info", "talker").stdout)
    found = re.search(r"http://[^:]+:(\d+)/", info)
    assert found, info
    assert int(found.group(1)) in PortRange.parse(wanted)
    running.press_ctrl_c()
    assert running.wait() == 0
    refused = ros.pipros.run("roslaunch", str(file), "--ports", "5-1")
    assert "InvalidEnvironment: --ports [5-1] must be a range within 1 to 65535" in refused.output
    ports.release()
