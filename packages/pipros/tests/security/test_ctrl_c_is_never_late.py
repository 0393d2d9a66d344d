"""Ctrl-C ends a node at once, whatever it waits for: silent peers, unknown host names."""

import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.network import LoneNetwork, needs_network
from tests.support.ports import ClaimedPort
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until

AT_ONCE_S = 9.0
"""Half a second is promised; this test looks for waits of ten seconds and more."""

SILENT_NAMES = """
import os, socket, time
known = socket.getaddrinfo
def getaddrinfo(host, *args, **options):
    name = os.fsdecode(host or '')
    if name.endswith('.silent') and not options.get('flags', 0) & socket.AI_NUMERICHOST:
        print('looking up', name, flush=True)
        time.sleep(60)
    return known(host, *args, **options)
socket.getaddrinfo = getaddrinfo
"""
"""The answers for such names never come."""

HEAD = f"""
{SILENT_NAMES}
import threading, sys
import rospy
from std_msgs.msg import String
from std_srvs.srv import Empty
def init():
    rospy.init_node('node')
    print('ready', flush=True)
"""

CALL = "init()\nrospy.ServiceProxy('/mute', Empty)()"
PERSISTENT_CALL = "init()\nrospy.ServiceProxy('/mute', Empty, persistent=True)()"
WAIT = "init()\nrospy.wait_for_service('/mute')"
SUBSCRIBE = "init()\nrospy.Subscriber('/mute', String)\nrospy.spin()"
LISTENER = """
class Listener(rospy.SubscribeListener):
    def peer_subscribe(self, *_):
        print('blocked', flush=True)
        time.sleep(60)
init()
publisher = rospy.Publisher('/chat', String, subscriber_listener=Listener(), queue_size=1)
rospy.Subscriber('/chat', String)
rospy.spin()
"""
HOOK = """
init()
worker = threading.Thread(target=lambda: rospy.ServiceProxy('/mute', Empty)())
worker.start()
rospy.on_shutdown(worker.join)
rospy.spin()
"""
ASYNC_CALL = """
import asyncio
from pipros.node import Node
async def main():
    async with Node('node') as node:
        print('ready', flush=True)
        await node.call('/mute', Empty, Empty._request_class())
asyncio.run(main())
"""


@pytest.fixture
def mute() -> Iterator[socket.socket]:
    """A server that never accepts: peers connect, and receive nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(60)
        yield server


@pytest.fixture
def full(mute: socket.socket) -> Iterator[socket.socket]:
    """A server with a full backlog: further connection attempts get no answer."""
    mute.listen(0)
    waiting = [socket.socket() for _ in range(8)]
    for sock in waiting:
        sock.setblocking(False)
        sock.connect_ex(mute.getsockname())
    yield mute
    for sock in waiting:
        sock.close()


def port_of(server: socket.socket) -> int:
    return int(server.getsockname()[1])


Start = Callable[..., Process]


@pytest.fixture
def start(processes: Processes, master: Master) -> Start:
    def start(code: str, ready: str, uri: str = master.uri) -> Process:
        process = processes.start(sys.executable, "-c", code, environment={"ROS_MASTER_URI": uri})
        process.wait_for(ready)
        return process

    return start


def assert_ends_at_once(process: Process) -> None:
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    process.wait(30)
    assert time.monotonic() - began < AT_ONCE_S, process.output


def offer(master: Master, uri: str) -> None:
    """Register a service or publisher at an address."""
    with closing(MasterClient(master.uri, "/mute_node")) as client:
        if uri.startswith("rosrpc"):
            client.register_service("/mute", uri, "http://127.0.0.1:9/")
        else:
            client.register_publisher("/mute", "std_msgs/String", uri)


@pytest.mark.parametrize("body", [CALL, PERSISTENT_CALL, WAIT, HOOK, ASYNC_CALL])
def test_with_a_service_that_accepts_and_never_answers(start, master, mute: socket.socket, body: str) -> None:
    offer(master, f"rosrpc://127.0.0.1:{port_of(mute)}")
    node = start(HEAD + body, "ready")
    with mute.accept()[0] as connection:
        connection.recv(1024)
        assert_ends_at_once(node)


@pytest.mark.parametrize("body", [CALL, WAIT, ASYNC_CALL])
def test_with_a_service_that_does_not_even_accept(start: Start, master: Master, full, body: str) -> None:
    offer(master, f"rosrpc://127.0.0.1:{port_of(full)}")
    node = start(HEAD + body, "ready")
    wait_until(lambda: "SYN_SENT" in states_of_connections_to(port_of(full), node.pid))
    assert_ends_at_once(node)


@pytest.mark.parametrize("body", [CALL, PERSISTENT_CALL, WAIT, ASYNC_CALL])
def test_with_a_service_at_an_unknown_host(start: Start, master: Master, body: str) -> None:
    offer(master, "rosrpc://host.silent:1234")
    assert_ends_at_once(start(HEAD + body, "looking up host.silent"))


def test_with_a_publisher_at_an_unknown_host(start: Start, master: Master) -> None:
    offer(master, "http://host.silent:1234/")
    assert_ends_at_once(start(HEAD + SUBSCRIBE, "looking up host.silent"))


def test_with_a_publisher_that_accepts_and_never_answers(start: Start, master: Master, mute) -> None:
    offer(master, f"http://127.0.0.1:{port_of(mute)}/")
    node = start(HEAD + SUBSCRIBE, "ready")
    # Others may connect, too: nodes of tests before, whose peer had this port.
    with mute.accept()[0]:
        assert_ends_at_once(node)


TOOL = f"{SILENT_NAMES}\nfrom pipros_tools.cli.rostopic import main\nmain(['list'])"


@pytest.mark.parametrize("code", [HEAD + "init()", TOOL], ids=["node", "tool"])
def test_with_a_master_at_an_unknown_host(start: Start, code: str) -> None:
    assert_ends_at_once(start(code, "looking up host.silent", "http://host.silent:11311"))


@pytest.mark.parametrize("server", ["mute", "full"])
def test_with_a_silent_master(start: Start, server: str, request: pytest.FixtureRequest) -> None:
    port = port_of(request.getfixturevalue(server))
    node = start(HEAD + "print('start', flush=True)\ninit()", "start", f"http://127.0.0.1:{port}")
    wait_until(lambda: states_of_connections_to(port, node.pid))
    assert_ends_at_once(node)


def test_with_a_master_that_has_stopped(start: Start, processes: Processes, claimed_port) -> None:
    code = "import sys\nfrom pipros_tools.cli.rosmaster import main\nmain(['--core', '-p', sys.argv[1]])"
    master = processes.start(sys.executable, "-c", code, str(claimed_port.number))
    node = start(HEAD + "init()\nrospy.spin()", "ready", claimed_port.uri)
    master.send_signal(signal.SIGSTOP)
    try:
        assert_ends_at_once(node)
    finally:
        master.send_signal(signal.SIGCONT)


def test_with_a_subscribe_listener_that_never_returns(start: Start) -> None:
    assert_ends_at_once(start(HEAD + LISTENER, "blocked"))


def test_a_master_that_looks_up_an_unknown_host(processes: Processes, claimed_port: ClaimedPort) -> None:
    uri, code = claimed_port.uri, f"{SILENT_NAMES}\nfrom pipros_tools.cli.rosmaster import main\n"
    code += f"raise SystemExit(main(['--core', '-p', '{claimed_port.number}']))"
    process = processes.start(sys.executable, "-c", code, environment={"ROS_MASTER_URI": uri})
    with closing(MasterClient(uri, "/mute_node")) as client:
        wait_until(lambda: answers(client))
        client.register_subscriber("/chat", "std_msgs/String", "http://host.silent:1234/")
        client.register_publisher("/chat", "std_msgs/String", "http://127.0.0.1:9/")
        process.wait_for("looking up host.silent")
    assert_ends_at_once(process)


def answers(client: MasterClient) -> bool:
    try:
        client.get_pid()
    except ConnectionError:
        return False
    return True


def states_of_connections_to(port: int, pid: int) -> list[str]:
    """Return the states of a process's TCP connections to a port of this machine, as Linux reports them."""
    names = {"01": "ESTABLISHED", "02": "SYN_SENT"}
    files = []
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # closed meanwhile
            files.append(str(descriptor.readlink()))
    lines = [line.split() for line in Path(f"/proc/{pid}/net/tcp").read_text().splitlines()[1:]]
    ours = [line for line in lines if f"socket:[{line[9]}]" in files and line[2] == f"0100007F:{port:04X}"]
    return [names.get(line[3], line[3]) for line in ours]


@needs_network
def test_with_name_servers_that_never_answer(processes: Processes) -> None:
    network = LoneNetwork("127.0.0.1 localhost\n", nameserver="192.0.2.1")
    try:
        code = "print('start', flush=True)\nimport rospy\nrospy.init_node('node')\n"
        variables = {"ROS_MASTER_URI": "http://host.example:11311"}
        node = processes.start(*network.command(sys.executable, "-c", code), environment=variables)
        node.wait_for("start")
        wait_until(lambda: ":0035 " in Path(f"/proc/{node.pid}/net/udp").read_text(), what="a question")
        assert_ends_at_once(node)
    finally:
        network.close()
