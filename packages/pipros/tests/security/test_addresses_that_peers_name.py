"""A peer registers the address of a server that is not its node: nothing there is changed or ended."""

from __future__ import annotations

import contextlib
import re
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from xmlrpc.client import Fault, dumps, loads

import pytest

from pipros.master.master import Master
from pipros.net.identify import identification
from pipros.net.master_client import MasterClient
from pipros_tools.graph.nodes import kill
from tests.support.environments import REPOSITORY
from tests.support.network import FarNetwork, needs_network
from tests.support.ros import RosSystem
from tests.support.slaves import FakeSlave
from tests.support.waiting import wait_until

NOWHERE = "http://127.0.0.1:1/"
QUERIES = {"getName", "getPublications", "getPid", "getSystemState"}
"""The only calls that a server receives without being the node."""

# Names of the methods that a server has, with their values. It refuses to know any others.
ROSCPP_NODE = {"getPid": 7, "getPublications": []}
SERVERS = {
    "another node": {"getName": "/other", "getPid": 7, "getPublications": []},
    "a master": {"getPid": 7, "getUri": "http://robot:11311/", "getSystemState": [[], [], []]},
    "a launch server": {"get_pid": 7, "list_processes": []},
    "no part of the graph": {"add": 2},
    "no XML-RPC": None,
}


class Server:
    """A server on loopback that records the calls, also of methods that it does not know.

    Attributes:
        called: the names of the methods, in order.
    """

    def __init__(self, methods: dict[str, Any] | None) -> None:
        called: list[str] = []

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                _, name = loads(body.decode())
                called.append(str(name))
                if methods is None:
                    self.send_error(404)
                    return
                known = name in methods
                answer: Any = ([1, "", methods[name]],) if known else Fault(1, f"no method {name}")
                text = dumps(answer, methodresponse=True).encode()
                self.send_response(200)
                self.send_header("Content-Length", str(len(text)))
                self.end_headers()
                self.wfile.write(text)

            def log_message(self, *_: object) -> None:
                pass

        self.called = called
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.02,))
        self._thread.start()
        self.api = f"http://127.0.0.1:{self._server.server_address[1]}/"

    def stop(self) -> None:
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


@pytest.fixture
def master() -> Iterator[Master]:
    with Master(port=0) as running:
        yield running


@contextlib.contextmanager
def serving(methods: dict[str, Any] | None) -> Iterator[Server]:
    server = Server(methods)
    yield server
    server.stop()


def provoke_all_notices(master: Master, api: str) -> None:
    """Register `api` under the name /node, and cause each kind of notice to it."""
    node, other = MasterClient(master.uri, "/node"), MasterClient(master.uri, "/talker")
    node.call("registerSubscriber", "/chat", "std_msgs/String", api)
    node.call("subscribeParam", api, "/level")
    other.call("registerPublisher", "/chat", "std_msgs/String", NOWHERE)
    other.call("setParam", "/level", 25)
    wait_until_delivered(master)
    node.call("registerSubscriber", "/chat", "std_msgs/String", NOWHERE)
    wait_until_delivered(master)


def wait_until_delivered(master: Master) -> None:
    client = MasterClient(master.uri, "/test", timeout_s=30)
    wait_until(lambda: client.call("pipros.getStatistics")["notices_waiting"] == 0)


@pytest.mark.parametrize("methods", SERVERS.values(), ids=SERVERS)
def test_a_server_that_is_not_the_node_receives_queries_only(
    master: Master, methods: dict[str, Any] | None
) -> None:
    with serving(methods) as server:
        provoke_all_notices(master, server.api)
        MasterClient(master.uri, "/node").register_publisher("/t", "std_msgs/String", server.api)
        killed, failed = kill(MasterClient(master.uri, "/test"), ["/node"])
        assert server.called
        assert set(server.called) <= QUERIES
        if methods is not None:  # otherwise it counts as a node that is gone
            assert (killed, list(failed)) == ([], ["/node"])
            assert "not this node, and is left alone" in failed["/node"]


def test_a_node_that_does_not_report_its_name_receives_all_notices(master: Master) -> None:
    with serving({**ROSCPP_NODE, "publisherUpdate": 0, "paramUpdate": 0, "shutdown": 0}) as server:
        provoke_all_notices(master, server.api)
        assert {"publisherUpdate", "paramUpdate", "shutdown"} <= set(server.called)
        assert "getSystemState" not in server.called


def test_a_node_is_identified_once_and_not_for_each_notice(master: Master) -> None:
    slave, talker = FakeSlave(name="/node"), MasterClient(master.uri, "/talker")
    MasterClient(master.uri, "/node").register_subscriber("/chat", "std_msgs/String", slave.api)
    for number in range(5):
        talker.register_publisher("/chat", "std_msgs/String", f"http://127.0.0.1:{number + 1}/")
        wait_until_delivered(master)
    assert slave.named == 1
    assert len(slave.publishers()) >= 4
    slave.stop()


def test_a_master_calls_neither_itself_nor_ends_another_one(master: Master) -> None:
    with Master(port=0) as other:
        for port in (master.port, other.port):
            for host in ("127.0.0.1", "localhost", "127.0.0.2"):
                provoke_all_notices(master, f"http://{host}:{port}/")
        calls = master._server.rpc.calls
        assert not any(calls[name] for name in ("getPid", "getSystemState", "shutdown"))
        for running in (master, other):
            assert MasterClient(running.uri, "/test", timeout_s=30).get_pid() > 0
        assert kill(MasterClient(master.uri, "/test"), ["/node"])[0] == ["/node"]  # nothing is at its address
        register = MasterClient(master.uri, "/node").register_publisher
        register("/t", "std_msgs/String", other.uri)
        assert kill(MasterClient(master.uri, "/test"), ["/node"])[0] == []
        assert MasterClient(other.uri, "/test", timeout_s=30).get_pid() > 0


@pytest.mark.parametrize(
    ("answers", "is_node"),
    [
        ({"getName": "/node"}, True),
        ({"getName": "/other", "getPublications": []}, False),
        ({"getName": "", "getPublications": []}, True),
        ({"getPublications": [], "getPid": 7}, True),
        ({"getPid": 7}, True),
        ({"getPid": 7, "getSystemState": [[], [], []]}, False),
        ({}, False),
    ],
)
def test_a_server_is_a_node_by_its_answers(answers: dict[str, Any], is_node: bool) -> None:
    queries = identification("/node")
    method = next(queries)
    try:
        while True:
            method = queries.send(answers.get(method))
    except StopIteration as ended:
        assert ended.value is is_node  # noqa: PT017 - the value of a generator


CALL = re.compile(r'(?:\.call|call_async)\(\s*(?:[\w.]+,\s*)?"(\w+)"')
OWN_ADDRESSES = {
    "pipros_tools/launch/child.py": "on the command line of a launch child",
    "pipros_tools/launch/server.py": "its own",
    "pipros/net/master_client.py": "the master's, which the user sets",
    "pipros/net/rpc_client.py": "an example",
    "pipros_tools/testing/faults/ros_proxy.py": "on the command line of a test",
}


def test_no_other_code_calls_more_than_the_documented_methods() -> None:
    table = (
        (REPOSITORY / "docs" / "reference" / "security.md")
        .read_text()
        .partition("## Addresses that peers name")[2]
    )
    rows = [row.split("|")[3:5] for row in table.partition("\n## ")[0].splitlines() if row.startswith("| ")]
    before, after = (set(re.findall(r"`(\w+)`", "".join(cells))) for cells in zip(*rows, strict=True))
    calls = {
        (place, method)
        for folder in ("packages", "plugins")
        for file in REPOSITORY.glob(f"{folder}/*/src/**/*.py")
        if (place := file.as_posix().partition("/src/")[2]) not in OWN_ADDRESSES
        and re.search(r"\b(RpcClient|call_async|node_clients)\b", text := file.read_text())
        for method in CALL.findall(text)
    }
    assert {place for place, method in calls if method in after} == {"pipros_tools/graph/nodes.py"}
    assert {method for _, method in calls} - after <= before
    assert before >= QUERIES | {"requestTopic"}


REGISTER = """
import sys, time
from xmlrpc.client import ServerProxy
master = ServerProxy(sys.argv[1])
for api in sys.argv[2:]:
    for each in (api, "http://127.0.0.1:1/"):
        assert master.registerPublisher("/e", "/u", "std_msgs/String", each)[0] == 1
print("refused:", master.shutdown("/e", "mine")[0])
while master.pipros.getStatistics("/e")[2]["notices_waiting"]:
    time.sleep(0.01)
print("alive:", master.getPid("/e")[0])
"""


@needs_network
@pytest.mark.timeout(300)
def test_a_peer_on_another_machine_cannot_end_roscore(ros: RosSystem) -> None:
    network = FarNetwork()
    with contextlib.closing(network):
        places = {"ROS_IP": network.near, "ROS_HOSTNAME": ""}
        core = ros.pipros.start("roscore", "-p", str(ros.port), **places)
        core.wait_for(r"started core service \[/rosout\]")
        uris = [f"http://{host}:{ros.port}/" for host in (network.near, "127.0.0.1", "localhost")]
        peer = ros.pipros.start(*network.command("python", "-c", REGISTER, *uris[:1], *uris))
        assert peer.wait(120) == 0, peer.output
        assert peer.stdout == ["refused: -1", "alive: 1"]
        assert core.is_running, core.output
