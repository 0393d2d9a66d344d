"""ROS_IPV6=on: master, nodes, topics and services over ::1."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.net.rpc_server import RpcServer, current_caller
from pipros.node import Node
from tests.support.nodes import Inbox, wait_until_connected

String: Any = load_message_class("std_msgs/String")
SetBool: Any = load_service_class("std_srvs/SetBool")


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[Master]:
    # as on a machine whose /etc/hosts has only an IPv4 address for localhost
    monkeypatch.setattr(address, "_means_ipv6_loopback", lambda _name: False)
    with Master(port=0, environment=Environment(ipv6=True)) as running:
        yield running


@pytest.fixture
def nodes(master: Master) -> Iterator[tuple[Node, Node]]:
    environment = Environment(master_uri=master.uri, ipv6=True)
    with Node("one", environment=environment) as one, Node("two", environment=environment) as two:
        yield one, two


def test_the_master_is_found_at_both_loopback_addresses(master: Master) -> None:
    assert master.uri == f"http://[::1]:{master.port}/"
    assert master.binding == "listens on ::1 and 127.0.0.1, for this computer only"
    for host in ("[::1]", "127.0.0.1"):
        assert MasterClient(f"http://{host}:{master.port}", "/test", timeout_s=10).get_uri() == master.uri


def test_topics_services_and_parameters(nodes: tuple[Node, Node], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIPROS_LOCAL", "off")
    one, two = nodes
    inbox = Inbox()
    two.subscribe("chat", String, inbox)
    publisher = one.advertise("chat", String)
    wait_until_connected(publisher)
    publisher.publish(String("hello"))
    assert [message.data for message in inbox.wait()] == ["hello"]

    with RpcClient(two.uri, timeout_s=10) as slave:
        [[_, peer, direction, *_, text]] = slave.call("getBusInfo", "/test")[2]
    assert (peer, direction) == (one.uri, "i")
    assert peer.startswith("http://[::1]:")
    assert "to [[::1]:" in text

    one.serve("answer", SetBool, lambda request: SetBool._response_class(request.data, "done"))
    for is_persistent in (False, True):
        client = two.client("answer", SetBool, persistent=is_persistent)
        assert client.call(SetBool._request_class(data=True)).message == "done"
        client.close()
    one.params.set("/level", 25)
    assert two.params.get("/level") == 25


def test_an_ipv6_server_accepts_ipv4_and_sees_the_ipv4_addresses_of_its_peers() -> None:
    loop = BackgroundLoop("ipv6 test")
    loop.start()
    server = RpcServer({"caller": lambda: current_caller.get().host}, host="::")
    loop.run(server.start())
    for host in ("[::1]", "127.0.0.1"):
        with RpcClient(f"http://{host}:{server.port}", timeout_s=10) as client:
            assert client.call("caller") == host.strip("[]")
    loop.run(server.stop())
    loop.stop()


def test_this_computer_is_admitted_by_ipv4_if_only_another_network_is_allowed() -> None:
    with Master(host="::", port=0, allow=["10.0.0.0/8"]) as master:
        assert MasterClient(f"http://127.0.0.1:{master.port}", "/test", timeout_s=10).get_pid()


def test_a_port_in_use_at_one_address_is_an_error_and_leaves_no_socket_open() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        master = Master(port=port, environment=Environment(ipv6=True))
        with pytest.raises(OSError, match="in use"):
            master.start()
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("::1", port), 10)
