"""Peers of a master: what they register and set, addresses they name, and the run id."""

import contextlib
import re
import socket
import threading
from collections.abc import Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any
from xmlrpc.client import Fault, dumps, loads

import pytest

from pipros.basics.errors import LimitExceeded, Refused
from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.net.identify import identification
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros_tools.graph.nodes import kill
from pipros_tools.health.gather_publisher import CALLER_ID
from pipros_tools.health.gather_system import AT_ONCE, gather_system
from pipros_tools.launch.run_id import is_run_id, new_run_id
from tests.support.constants import Constants
from tests.support.environments import REPOSITORY
from tests.support.network import FarNetwork, needs_network
from tests.support.node_fixtures import master as master
from tests.support.ros import RosSystem
from tests.support.slaves import FakeSlave
from tests.support.waiting import wait_until

# Peers that keep registering and setting: the master's memory and responses, and the effect on others.


API = "http://127.0.0.1:9/"


def resident_mb(pid: int) -> float:
    [line] = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if "VmRSS" in line]
    return int(line.split()[1]) / 1024


def test_removed_names_leave_no_memory_behind(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    with RpcClient(ros.master_uri) as client:
        before = 0.0
        for number in range(3000):
            if number == 1000:  # by now, buffers have the size for names of 16 kB
                before = resident_mb(core.pid)
            topic = f"/{number:05}" + "x" * 16_000
            assert client.call("registerPublisher", "/hoarder", topic, "std_msgs/String", API)[0] == 1
            assert client.call("unregisterPublisher", "/hoarder", topic, API)[2] == 1
        assert resident_mb(core.pid) - before < 10  # of 32 MB
        assert len(client.call("getTopicTypes", "/me")[2]) < 100
    assert ros.pipros.run("rostopic", "list").stdout == ["/rosout", "/rosout_agg"]
    assert ros.pipros.run("rostopic", "info", "/rosout").stdout[0] == "Type: rosgraph_msgs/Log"


def test_discarded_types_are_not_restored(tmp_path: Path, constants: Constants) -> None:
    constants(TOPIC_TYPES=2)
    limits = Limits()
    for _ in range(2):
        with Master(port=0, store=tmp_path / "store", limits=limits) as master:
            client = MasterClient(master.uri, "/n")
            for topic in ("/a", "/b", "/c"):
                client.register_publisher(topic, "x/Y", API)
                client.unregister_publisher(topic, API)
            client.close()
    with Master(port=0, store=tmp_path / "store") as master:
        client = MasterClient(master.uri, "/n")
        assert client.get_topic_types() == [["/b", "x/Y"], ["/c", "x/Y"]]
        client.close()


@pytest.mark.timeout(300)  # 18 MB of YAML take ten seconds of a processor that may be shared
def test_all_accepted_parameters_can_be_read(ros: RosSystem) -> None:
    ros.pipros.start_master()
    client = MasterClient(ros.master_uri, "/honest")
    for number in range(18):
        client.set_param(f"/map{number}", "x" * 1_000_000)
    client.close()
    ended = ros.pipros.run("rosparam", "dump", "all.yaml", timeout_s=240)
    assert ended.returncode == 0, ended.output
    assert (ros.home / "all.yaml").stat().st_size > 18_000_000


def test_parameters_have_a_total_limit_and_deletions_make_room() -> None:
    with Master(port=0, limits=Limits(parameter_bytes=1_000_000)) as master:
        client = MasterClient(master.uri, "/n")
        client.set_param("/list", list(range(20_000)))  # 640,000 bytes, measured in a thread
        with pytest.raises(Refused, match=r"/other would bring the parameters to .* the limit is 1000000"):
            client.set_param("/other", list(range(20_000)))
        assert client.get_param_names() == ["/list"]
        client.set_param("/list", list(range(25_000)))
        client.delete_param("/list")
        client.set_param("/other", list(range(20_000)))
        client.set_param("/other", 0)
        client.set_param("/text", "x" * 900_000)
        client.close()


def test_rosparam_says_which_limit_a_parameter_is_above(ros: RosSystem) -> None:
    ros.pipros.environment["PIPROS_LIMITS"] = "parameter_bytes=2000"
    ros.pipros.start_master()
    ended = ros.pipros.run("rosparam", "set", "/big", "x" * 2000)
    assert ended.returncode == 1
    assert ended.output.startswith("ERROR: cannot set parameter [/big]: Error: invalid arguments: /big would")


def test_registrations_have_a_total_limit(constants: Constants) -> None:
    constants(REGISTRATIONS_BYTES=100000)
    with Master(port=0) as master:
        client = MasterClient(master.uri, "/n")
        answers = [client.call_raw("registerSubscriber", f"/t{number}", "x/Y", API) for number in range(400)]
        code, text, _ = answers[-1]
        assert code == -1
        assert "would bring the master's registrations to" in text
        assert "the limit is 100000" in text
        registered = [topic for topic, _ in client.get_system_state()[1]]
        assert 200 < len(registered) < 400
        for topic in registered:
            client.unregister_subscriber(topic, API)
        client.register_service("/s", "rosrpc://a:1", API)
        client.close()


def test_an_answer_above_the_limit_is_an_error_that_names_it() -> None:
    with Master(port=0) as master, RpcClient(master.uri, answer_limit_bytes=10_000) as client:
        assert client.call("setParam", "/n", "/text", "x" * 20_000)[0] == 1
        with pytest.raises(LimitExceeded, match=r"the response from .* is too large: .* the limit is 10000"):
            client.call("getParam", "/n", "/text")
        assert client.call("hasParam", "/n", "/text")[2] is True


def test_a_large_parameter_that_is_replaced_again_and_again_is_counted_right() -> None:
    with Master(port=0, limits=Limits(parameter_bytes=500_000)) as master:
        clients = [MasterClient(master.uri, f"/n{number}") for number in range(4)]

        def hammer(client: MasterClient) -> None:
            for number in range(20):
                client.set_param("/shared", [number] * 3_000)
                client.set_param("/shared/below", [number] * 3_000)

        threads = [Thread(target=hammer, args=(client,)) for client in clients]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        clients[0].delete_param("/shared")
        clients[0].set_param("/all", "x" * 499_000)
        with pytest.raises(Refused):
            clients[0].set_param("/more", "x" * 1000)
        for client in clients:
            client.close()


# A peer registers the address of a server that is not its node: nothing there is changed or ended.


NOWHERE = "http://127.0.0.1:1/"
QUERIES = {"getName", "getPublications", "getPid", "getSystemState"}
"""The only calls that a server receives without being the node."""

# Names of the methods that a server has, with their values. It refuses to know any others.
ROSCPP_NODE = {"getPid": 7, "getPublications": []}
SERVERS = {
    "another node": {"getName": "/other", "getPid": 7, "getPublications": []},
    "a master": {"getPid": 7, "getUri": "http://robot:11311/", "getSystemState": [[], [], []]},
    "a launch server": {"get_pid": 7, "list_processes": []}, "no part of the graph": {"add": 2},
    "no XML-RPC": None,
}  # fmt: skip


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
def test_a_server_that_is_no_node_receives_queries_only(master, methods: dict[str, Any] | None) -> None:
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


@pytest.mark.parametrize(("answers", "is_node"), [
    ({"getName": "/node"}, True), ({"getName": "/other", "getPublications": []}, False),
    ({"getName": "", "getPublications": []}, True), ({"getPublications": [], "getPid": 7}, True),
    ({"getPid": 7}, True), ({"getPid": 7, "getSystemState": [[], [], []]}, False), ({}, False),
])  # fmt: skip
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


# Any peer may set `/run_id`, which names the folder of log files: paths and line breaks are refused.


HOSTILE = ["../../stolen", "a/b", "..", "latest", "x" * 65, "line\nbreak", "\x1b[31m", "", "run\n"]


@pytest.fixture
def run_client(ros: RosSystem) -> Iterator[MasterClient]:
    with Master(host="127.0.0.1", port=ros.port) as master:
        client = MasterClient(master.uri, "/a_peer")
        yield client
        client.close()


def launch_nothing(ros: RosSystem, *options: str) -> tuple[int, str]:
    file = ros.home / "empty.launch"
    file.write_text("<launch><param name='a' value='1'/></launch>")
    run = ros.pipros.run("roslaunch", *options, file)
    return run.returncode or 0, run.output


@pytest.mark.parametrize("value", HOSTILE)
def test_an_invalid_folder_name_is_not_a_run_id(value: str) -> None:
    assert not is_run_id(value)


def test_ids_of_noetic_and_of_pipros_name_runs() -> None:
    assert is_run_id("0fb2803c-e4ea-11f1-916a-02fc00000001")
    assert is_run_id(new_run_id())


@pytest.mark.parametrize("value", ["../../stolen", "x" * 300, "line\nbreak"], ids=repr)
def test_roslaunch_logs_to_a_new_folder_if_the_run_id_is_unsafe(ros, run_client, value: str) -> None:
    run_client.set_param("/run_id", value)

    code, output = launch_nothing(ros)

    assert code == 0, output
    assert "WARNING: /run_id on the parameter server must be up to 64 letters" in output
    logs = Path(ros.pipros.environment["ROS_HOME"]) / "log"
    [folder] = (entry for entry in logs.iterdir() if not entry.is_symlink())
    assert is_run_id(folder.name)
    assert list(ros.home.rglob("stolen")) == []


def test_roslaunch_logs_does_not_print_an_unsafe_run_id(ros: RosSystem, run_client: MasterClient) -> None:
    run_client.set_param("/run_id", "../\u009b31m")

    run = ros.pipros.run("roslaunch-logs")

    assert (run.returncode, run.stdout) == (1, [])
    assert "\u009b" not in run.output


def test_a_run_id_on_the_command_line_is_checked_as_well(ros: RosSystem) -> None:
    code, output = launch_nothing(ros, "--run_id", "../up")

    assert code == 1
    assert "--run_id must be up to 64 letters, digits, _ and -, got [../up]" in output


# Peers that register many names at an address that accepts connections and never answers.


NODES = 3 * AT_ONCE


def test_a_silent_address_is_examined_once_by_each_thread_whatever_registers_there(master: Master) -> None:
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
        silent.setblocking(False)
        api = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        for number in range(NODES):
            client = MasterClient(master.uri, f"/silent{number}")
            client.register_publisher("/topic", "std_msgs/String", api)
            client.close()
        found = gather_system(master.uri, timeout_s=0.3)
        called = 0
        with suppress(BlockingIOError):
            while True:
                connection, _ = silent.accept()
                with connection:  # the master calls the address, too
                    called += CALLER_ID.encode() in connection.recv(65_536)
    assert all(found.nodes[f"/silent{number}"].failure for number in range(NODES))
    assert 1 <= called <= AT_ONCE
