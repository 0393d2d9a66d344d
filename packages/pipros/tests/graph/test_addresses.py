"""Addresses and ports of nodes: ranges, advertised addresses, loopback, IPv6, other users and networks."""

import contextlib
import os
import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

import rosgraph.network
from pipros.basics.env import Environment, InvalidEnvironment
from pipros.basics.ports import PortRange
from pipros.master.master import Master
from pipros.net import address, this_machine
from pipros.net.address import address_here, split_uri
from pipros.net.lookup import Lookups
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.net.rpc_server import current_caller
from pipros.net.sockets import NoFreePort
from pipros.node import Node
from pipros.wire.header import encode_header
from pipros.wire.http import build_request
from pipros.wire.xmlrpc import encode_call
from tests.support.constants import Constants
from tests.support.names import hosts
from tests.support.network import FarNetwork, needs_network
from tests.support.nodes import Inbox, MakeNode, connected
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.slaves import Served
from tests.support.users import NOBODY, STRANGER, needs_nobody, needs_other_users

# Nodes with ports from a range, and with an advertised address that differs from the bound one.


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


def test_peers_are_told_the_advertised_address_and_the_node_recognises_it(monkeypatch, port: int) -> None:
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
            [data], [data[:2], data[2:3], data[3:]], [data[at : at + 1] for at in range(len(data))],
        ):  # fmt: skip
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


def test_silent_connections_of_the_slave_api_end(make_node: MakeNode, constants: Constants) -> None:
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
    running.press_ctrl_c(code=0)
    refused = ros.pipros.run("roslaunch", str(file), "--ports", "5-1")
    assert "InvalidEnvironment: --ports [5-1] must be a range within 1 to 65535" in refused.output
    ports.release()


# Loopback addresses besides 127.0.0.1: advertised addresses and hosts in URIs are reachable.


DEBIANS = "127.0.1.1"
"""What Debian's installer lets the name of the machine mean."""


@pytest.fixture
def loopback_master() -> Iterator[Master]:
    with Master(port=0, environment=Environment(ip=DEBIANS)) as running:
        yield running


def test_a_master_is_found_at_its_uri_and_at_localhost(loopback_master: Master) -> None:
    assert loopback_master.uri == f"http://{DEBIANS}:{loopback_master.port}/"
    assert loopback_master.binding == "listens on 127.0.1.1 and 127.0.0.1, for this computer only"
    for host in (DEBIANS, "localhost", "127.0.0.1"):
        assert (
            MasterClient(f"http://{host}:{loopback_master.port}", "/test", timeout_s=10).get_uri()
            == loopback_master.uri
        )


def test_nodes_and_services_are_found_at_their_addresses(loopback_master: Master) -> None:
    environment = Environment(master_uri=f"http://localhost:{loopback_master.port}", ip=DEBIANS)
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
        ({"ROS_IP": DEBIANS}, DEBIANS), ({"ROS_MASTER_URI": f"http://{DEBIANS}:{{port}}"}, "127.0.0.1"),
        ({"ROS_IP": DEBIANS, "ROS_MASTER_URI": "http://127.0.0.9:{port}"}, DEBIANS),
    ],
)  # fmt: skip
def test_roscore_is_found_by_its_variables(ros: RosSystem, variables: dict[str, str], announced: str) -> None:
    variables = {name: value.format(port=ros.port) for name, value in variables.items()}
    core = ros.pipros.start("roscore", "-p", str(ros.port), **variables)
    core.wait_for(rf"ROS_MASTER_URI=http://{announced}:{ros.port}/")
    core.wait_for(r"started core service \[/rosout\]")
    assert ros.pipros.run("rosnode", "list", **variables).stdout == ["/rosout"]
    assert ros.pipros.run("rosservice", "list", **variables).returncode == 0
    core.press_ctrl_c(code=0)


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


# ROS_IPV6=on: master, nodes, topics and services over ::1.


@pytest.fixture
def ipv6_master(monkeypatch: pytest.MonkeyPatch) -> Iterator[Master]:
    # as on a machine whose /etc/hosts has only an IPv4 address for localhost
    monkeypatch.setattr(address, "_means_ipv6_loopback", lambda _name: False)
    with Master(port=0, environment=Environment(ipv6=True)) as running:
        yield running


@pytest.fixture
def nodes(ipv6_master: Master) -> Iterator[tuple[Node, Node]]:
    environment = Environment(master_uri=ipv6_master.uri, ipv6=True)
    with Node("one", environment=environment) as one, Node("two", environment=environment) as two:
        yield one, two


def test_the_master_is_found_at_both_loopback_addresses(ipv6_master: Master) -> None:
    assert ipv6_master.uri == f"http://[::1]:{ipv6_master.port}/"
    assert ipv6_master.binding == "listens on ::1 and 127.0.0.1, for this computer only"
    for host in ("[::1]", "127.0.0.1"):
        assert (
            MasterClient(f"http://{host}:{ipv6_master.port}", "/test", timeout_s=10).get_uri()
            == ipv6_master.uri
        )


def test_topics_services_and_parameters(nodes: tuple[Node, Node], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIPROS_LOCAL", "off")
    one, two = nodes
    inbox = Inbox()
    publisher = connected(one, two, "chat", String, inbox)
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
    with Served({"caller": lambda: current_caller.get().host}, host="::") as server:
        for host in ("[::1]", "127.0.0.1"):
            with RpcClient(f"http://{host}:{server.port}", timeout_s=10) as client:
                assert client.call("caller") == host.strip("[]")


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


# Unix streams connect nodes of one user and network, whatever their other namespaces; others use TCP.


# Another user may not be able to read pipros. Before the process gives up its rights, a node that hears
# itself has therefore imported everything that a publisher and a subscriber import as they need it.
NODE = """
import encodings.idna, os, sys, threading, time
from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
uri, name, user, role, host = sys.argv[1:]
Image = load_message_class("sensor_msgs/Image")
environment = Environment(master_uri=uri, ip=host or None)
with Node(name + "_first", environment=environment) as first:
    heard = threading.Event()
    first.advertise("unused_" + name, Image, latch=True).publish(Image(data=bytes(300_000)))
    first.subscribe("unused_" + name, Image, lambda message: heard.set())
    assert heard.wait(60)
if int(user):
    os.setgid(int(user))
    os.setuid(int(user))
node = Node(name, environment=environment)
node.start()
if role == "publish":
    publisher = node.advertise("images", Image, queue_size=10)
    print("ready", flush=True)
    while True:
        publisher.publish(Image(data=bytes(300_000)))
        time.sleep(0.05)
else:
    def show(message):
        links = node.endpoints.subscription("/images").links
        print(len(message.data), *(peer.link.transport for peer in links), flush=True)
    node.subscribe("images", Image, show)
    time.sleep(1000)
"""


class Programs:
    """Nodes in processes of their own."""

    def __init__(self, uri: str) -> None:
        self.uri = uri
        self._started: list[subprocess.Popen[str]] = []

    def start(self, name: str, role: str, user: int = 0, prefix: tuple[str, ...] = (), host: str = "") -> str:
        """Start a node, and return the first line that it prints."""
        command = [*prefix, sys.executable, "-c", NODE, self.uri, name, str(user), role, host]
        environment = {**os.environ, "PIPROS_LOCAL": "on"}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        self._started.append(process)
        return process.stdout.readline().strip()

    def close(self) -> None:
        for process in self._started:
            process.kill()
            process.communicate()


@pytest.fixture
def programs(master: Master) -> Iterator[Programs]:
    started = Programs(master.uri)
    yield started
    started.close()


@needs_other_users
def test_two_ordinary_users_use_tcp_and_each_of_them_streams(programs: Programs) -> None:
    assert programs.start("talker", "publish", STRANGER) == "ready"
    assert programs.start("same", "subscribe", STRANGER) == "300000 PIPROSLOCAL"
    assert programs.start("other", "subscribe", STRANGER + 1) == "300000 TCPROS"


@needs_other_users
@pytest.mark.skipif(shutil.which("unshare") is None, reason="needs unshare")
def test_other_mount_process_and_ipc_namespaces_make_no_difference(programs: Programs) -> None:
    unshare = (
        str(shutil.which("unshare")),
        "--mount",
        "--propagation=unchanged",  # the root of a chroot is not a mount point
        "--pid",
        "--ipc",
        "--fork",
        "--kill-child",
        "--mount-proc",
    )
    assert programs.start("talker", "publish") == "ready"
    assert programs.start("contained", "subscribe", prefix=unshare) == "300000 PIPROSLOCAL"


@needs_network
def test_another_network_namespace_uses_tcp() -> None:
    far = FarNetwork()
    try:
        with Master(host="0.0.0.0", port=0, allow=["10.0.0.0/8"]) as master:  # noqa: S104
            programs = Programs(f"http://{far.near}:{master.port}")
            try:
                assert programs.start("talker", "publish", host=far.near) == "ready"
                prefix = tuple(far.command())
                line = programs.start("far", "subscribe", prefix=prefix, host=far.far)
                assert line == "300000 TCPROS"
            finally:
                programs.close()
    finally:
        far.close()
