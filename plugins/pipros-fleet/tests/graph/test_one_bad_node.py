"""One bad node among good ones closes only itself: in lists and pings, on the page, in bridges and fleets."""

import importlib
import io
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.net.master_client import MasterClient
from pipros_fleet.fleet_rules import FleetFile, FleetRule
from pipros_fleet.local_poller import LocalPoller
from pipros_page.views.processes import _Table
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.node_clients import NodeClients
from pipros_tools.graph.observer import SystemObserver
from pipros_tools.graph.services import services_of_type
from tests.support.foxglove import connected, serving
from tests.support.nodes import MakeNode
from tests.support.slaves import GarbageServer, SilentSlave
from tests.support.waiting import wait_until

STRING: Any = load_message_class("std_msgs/String")
TRIGGER: Any = load_service_class("std_srvs/Trigger")
GOOD = ("/b_good", "/d_good")
PLACES = {"first": "/a_bad", "middle": "/c_bad", "last": "/e_bad"}


def http(body: bytes, status: str = "200 OK") -> bytes:
    return (
        f"HTTP/1.1 {status}\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body
    )


def xml(value: str) -> bytes:
    return http(
        f"<methodResponse><params><param><value>{value}</value></param></params></methodResponse>".encode()
    )


REPLIES: Mapping[str, bytes] = {
    "not HTTP": b"\x00\x01garbage\r\n\r\n",
    "status 500": http(b"", "500 no"),
    "HTML": http(b"<html>hello</html>"),
    "too deep": xml("<array><data><value>" * 500 + "</value></data></array>" * 500),
    "a number": xml("<int>5</int>"),
    "no value": xml("<array><data><value><int>1</int></value></data></array>"),
}
URIS = [
    "http://127.0.0.1:1/", "http://[::1", "http://127.0.0.1:99999999/", "http:///", "rosrpc://127.0.0.1:3",
]  # fmt: skip
BAD = [*REPLIES, *URIS]


CASES = [(kind, "middle") for kind in BAD] + [
    (kind, place) for kind in ("HTML", "http://[::1") for place in ("first", "last")
]


@pytest.fixture(params=CASES, ids=lambda case: f"{case[1]}-{case[0]}")
def case(request: pytest.FixtureRequest) -> tuple[str, str]:
    """A kind of bad node, and its place among the names of the good ones."""
    found: tuple[str, str] = request.param
    return found


@pytest.fixture
def bad_api(case: tuple[str, str]) -> Iterator[str]:
    """The address of the bad node."""
    kind, _ = case
    if kind in URIS:
        yield kind
        return
    server = GarbageServer(REPLIES[kind])
    yield f"http://127.0.0.1:{server.port}/"
    server.stop()


@pytest.fixture
def bad_node(
    case: tuple[str, str], bad_api: str, master: Master, make_node: MakeNode, monkeypatch: pytest.MonkeyPatch
) -> str:
    """The name of the bad node, which is registered between good ones."""
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    name = PLACES[case[1]]
    for each in sorted((*GOOD, name)):
        if each == name:
            register(master, name, bad_api)
        else:
            make_node(each[1:]).serve(f"{each}/service", TRIGGER, lambda _: TRIGGER._response_class())
    return name


def register(master: Master, name: str, api: str) -> None:
    client = MasterClient(master.uri, name)
    client.register_publisher(f"{name}/topic", "std_msgs/String", api)
    client.register_service(f"{name}/service", f"rosrpc://{api.partition('://')[2]}", api)
    client.close()


def run(line: str) -> int:
    command, *arguments = line.split()
    code: int = importlib.import_module(f"pipros_tools.cli.{command}").main(arguments)
    return code


def test_a_ping_of_all_nodes_names_the_bad_one_and_goes_on(bad_node: str, bad_api: str, capsys) -> None:
    assert run("rosnode ping -a") == 0
    out, err = capsys.readouterr()
    assert [node for node in (*GOOD, bad_node) if f"pinging {node} with" in out] == [*GOOD, bad_node]
    assert out.count("xmlrpc reply from") == len(GOOD) + (bad_api not in URIS and not err)
    assert "Traceback" not in err
    assert all(good not in err for good in GOOD)


def test_a_cleanup_finds_the_bad_node(bad_node: str, bad_api: str, capsys, monkeypatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    run("rosnode ping -a")
    err = capsys.readouterr().err
    is_bad = bad_node in err or bad_api in err
    assert run("rosnode cleanup") == 0
    out, _ = capsys.readouterr()
    assert (f"Unregistering {bad_node}\ndone" in out) is is_bad
    assert all(f"Unregistering {good}" not in out for good in GOOD)


def test_the_information_of_several_nodes_leaves_out_the_bad_one_only(
    bad_node: str, bad_api: str, capsys: pytest.CaptureFixture[str]
) -> None:
    names = sorted((*GOOD, bad_node))
    assert run(f"rosnode info {' '.join(names)}") == 1
    out, err = capsys.readouterr()
    assert [line for line in out.splitlines() if line.startswith("Node [")] == [
        f"Node [{name}]" for name in names
    ]
    assert out.count("Pid: ") == len(GOOD)
    assert err == f"ERROR: Communication with node[{bad_api}] failed!\n"


def test_the_table_of_processes_shows_the_good_nodes(bad_node: str, master: Master) -> None:
    with GraphClient("page") as graph:
        clients = NodeClients(5.0)
        observation = SystemObserver(graph.master, clients=clients).poll()
        rows = {row["name"]: row for row in _Table(clients, "/page").rows(observation)}
        clients.keep_only(())
    assert sorted(rows) == sorted((*GOOD, bad_node))
    assert all(rows[good].get("pid") for good in GOOD)
    assert rows[bad_node]["error"]


@pytest.fixture
def hung(master: Master, make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> Iterator[MakeNode]:
    """Nodes that never answer, and for which clients wait forever, between good ones. Returns `make_node`."""
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    monkeypatch.setattr("pipros_tools.graph.definitions.HEADER_S", 3600.0)
    monkeypatch.setattr("pipros_tools.graph.services.PROBE_DEADLINE_S", 3600.0)
    slave = SilentSlave()

    def offer(name: str) -> None:
        node = make_node(name[1:])
        node.serve(f"{name}/service", TRIGGER, lambda _: TRIGGER._response_class())
        node.advertise(f"{name}/topic", STRING)

    offer(GOOD[0])
    for number in range(20):
        client = MasterClient(master.uri, f"/hung_{number}")
        client.register_publisher(f"/hung_{number}/topic", "nowhere_msgs/Unknown", slave.api)
        client.register_service(f"/hung_{number}/service", slave.api.replace("http", "rosrpc"), slave.api)
        client.close()
    offer(GOOD[1])
    yield make_node
    slave.stop()


def test_hung_nodes_delay_no_channel_and_no_service_of_others(hung: MakeNode) -> None:
    with serving(hung("bridge")) as address, connected(address) as client:
        client.until(lambda: {f"{good}/topic" for good in GOOD} <= client.channels.keys())
        assert not any("hung" in topic for topic in client.channels)
        client.until(lambda: {f"{good}/service" for good in GOOD} <= client.services.keys())
        hung("late").advertise("/late", STRING)
        client.until(lambda: "/late" in client.channels)
        assert not any("hung" in name for name in client.services)


def test_hung_nodes_do_not_keep_a_fleet_from_its_other_names(hung: MakeNode) -> None:
    everything = (FleetRule("/**"),)
    poller = LocalPoller(hung("agent"), "robot", FleetFile(accepted_services=everything))
    poller.start()

    def polled() -> tuple[list[str], set[str]]:
        graph = poller.poll([])
        assert graph is not None
        return [entry.name for entry in graph.services], {entry.name for entry in graph.shared}

    try:
        wait_until(lambda: polled()[0] == [f"{good}/service" for good in GOOD])
        assert {f"{good}/topic" for good in GOOD} <= polled()[1]
    finally:
        poller.close()


def test_a_search_for_services_asks_all_servers_at_once(
    master: Master, make_node: MakeNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of the first servers answers only when the last has been asked."""
    names = [f"/service_{number}" for number in range(8)]
    node = make_node("server")
    for name in names:
        node.serve(name, TRIGGER, lambda _: TRIGGER._response_class())
    together = threading.Barrier(len(names), timeout=30)
    ask: Callable[..., Any] = services_of_type.__globals__["type_of"]

    def type_of(*arguments: Any) -> Any:
        together.wait()
        return ask(*arguments)

    monkeypatch.setitem(services_of_type.__globals__, "type_of", type_of)
    client = MasterClient(master.uri, "/test")
    assert services_of_type(client, "std_srvs/Trigger") == names
    client.close()
