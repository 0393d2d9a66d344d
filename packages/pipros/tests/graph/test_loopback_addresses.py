"""Loopback addresses besides 127.0.0.1: advertised addresses and hosts in URIs are reachable."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import Any

import pytest

import rosgraph.network
from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.net import this_machine
from pipros.net.address import split_uri
from pipros.net.lookup import Lookups
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.node import Node
from tests.support.names import hosts
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem

String: Any = load_message_class("std_msgs/String")
SetBool: Any = load_service_class("std_srvs/SetBool")

DEBIANS = "127.0.1.1"
"""What Debian's installer lets the name of the machine mean."""


@pytest.fixture
def master() -> Iterator[Master]:
    with Master(port=0, environment=Environment(ip=DEBIANS)) as running:
        yield running


def test_a_master_is_found_at_its_uri_and_at_localhost(master: Master) -> None:
    assert master.uri == f"http://{DEBIANS}:{master.port}/"
    assert master.binding == "listens on 127.0.1.1 and 127.0.0.1, for this computer only"
    for host in (DEBIANS, "localhost", "127.0.0.1"):
        assert MasterClient(f"http://{host}:{master.port}", "/test", timeout_s=10).get_uri() == master.uri


def test_nodes_and_services_are_found_at_their_addresses(master: Master) -> None:
    environment = Environment(master_uri=f"http://localhost:{master.port}", ip=DEBIANS)
    inbox = Inbox()
    with Node("one", environment=environment) as one, Node("two", environment=environment) as two:
        two.subscribe("chat", String, inbox)
        one.advertise("chat", String, latch=True).publish(String("hello"))
        assert [message.data for message in inbox.wait()] == ["hello"]
        one.serve("answer", SetBool, lambda request: SetBool._response_class(request.data, "done"))
        assert two.client("answer", SetBool).call(SetBool._request_class(data=True)).message == "done"
        assert split_uri(one.master.lookup_service("/answer"), ["rosrpc"])[0] == DEBIANS
        assert split_uri(one.uri)[0] == DEBIANS
        with RpcClient(one.uri, timeout_s=10) as slave:
            assert slave.call("getName", "/test") == [1, "", "/one"]


def test_a_master_is_found_by_names_that_mean_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    lookups = Lookups(4, resolve=hosts({"laptop": DEBIANS, "alias": "127.0.0.7"}))
    monkeypatch.setattr(this_machine, "process_lookups", lambda: lookups)
    environment = Environment(ip="127.0.0.1", master_uri="http://laptop:11311")
    with Master(port=0, environment=environment, known_as=["alias"]) as master:
        for host in ("127.0.0.1", DEBIANS, "127.0.0.7"):
            assert MasterClient(f"http://{host}:{master.port}", "/test", timeout_s=10).get_pid()


def test_a_master_with_one_bind_address_listens_only_there() -> None:
    only = Master(port=0, host="127.0.0.1", environment=Environment(ip=DEBIANS))
    with only as master, pytest.raises(ConnectionRefusedError):
        socket.create_connection((DEBIANS, master.port), 10)


@pytest.mark.parametrize(
    ("variables", "announced"),
    [
        ({"ROS_IP": DEBIANS}, DEBIANS),
        ({"ROS_MASTER_URI": f"http://{DEBIANS}:{{port}}"}, "127.0.0.1"),
        ({"ROS_IP": DEBIANS, "ROS_MASTER_URI": "http://127.0.0.9:{port}"}, DEBIANS),
    ],
)
def test_roscore_is_found_where_the_variables_lead(
    ros: RosSystem, variables: dict[str, str], announced: str
) -> None:
    variables = {name: value.format(port=ros.port) for name, value in variables.items()}
    core = ros.pipros.start("roscore", "-p", str(ros.port), **variables)
    core.wait_for(rf"ROS_MASTER_URI=http://{announced}:{ros.port}/")
    core.wait_for(r"started core service \[/rosout\]")
    assert ros.pipros.run("rosnode", "list", **variables).stdout == ["/rosout"]
    assert ros.pipros.run("rosservice", "list", **variables).returncode == 0
    core.press_ctrl_c()
    assert core.wait() == 0


@pytest.mark.parametrize(
    ("address", "bound"),
    [
        (DEBIANS, DEBIANS),
        ("127.0.0.1", "127.0.0.1"),
        ("localhost", "127.0.0.1"),
        ("192.0.2.1", "0.0.0.0"),  # noqa: S104
    ],
)
def test_the_bind_address_includes_the_advertised_one(address: str, bound: str) -> None:
    assert rosgraph.network.get_bind_address(address) == bound
