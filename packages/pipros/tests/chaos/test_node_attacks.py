"""During attacks on a node, others are served, and it recovers when the attackers leave.

The node runs in its own process with 256 descriptors, which every attack exceeds. Responses may be slow on
a machine with other load; a locked-up node does not respond at all.
"""

import contextlib
import socket
import struct
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.wire.header import HeaderReader, encode_header
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.processes import Processes
from tests.support.waiting import wait_until

ANSWER_S = 20.0
MANY = 400
DESCRIPTORS = 256
VICTIM = f"""
import resource, time
resource.setrlimit(resource.RLIMIT_NOFILE, ({DESCRIPTORS}, {DESCRIPTORS}))
import rospy
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolResponse

rospy.init_node("victim")
back = rospy.Publisher("back", String, queue_size=10)
rospy.Subscriber("forth", String, back.publish)
rospy.Subscriber("listed", String, lambda _: None)
rospy.Service("quick", SetBool, lambda _: SetBoolResponse(True, ""))
rospy.Service("large", SetBool, lambda _: SetBoolResponse(True, "x" * 5_000_000))
rospy.spin()
"""


class Victim:
    """The address of the attacked node, and the connections of the attacker."""

    def __init__(self, master: Master, pid: int) -> None:
        self.client = MasterClient(master.uri, "/attacker")
        wait_until(lambda: any(name == "/large" for name, _ in self.client.get_system_state()[2]))
        self.uri = self.client.lookup_node("/victim")
        self.pid = pid
        self.api_port = int(self.uri.rpartition(":")[2].strip("/"))
        self.port = int(self.client.lookup_service("/quick").rpartition(":")[2])
        self.held: list[socket.socket] = []

    def connect(self, port: int = 0, data: bytes = b"") -> socket.socket:
        peer = socket.create_connection(("127.0.0.1", port or self.port), ANSWER_S)
        self.held.append(peer)
        with contextlib.suppress(OSError):
            peer.sendall(data)
        return peer

    def greet(self, fields: dict[str, str], data: bytes = b"") -> None:
        peer = self.connect(data=encode_header({"md5sum": "*", "callerid": "/attacker", **fields}))
        reader = HeaderReader()
        with contextlib.suppress(OSError):
            while (answer := peer.recv(1)) and reader.feed(answer) is None:
                pass
            peer.sendall(data)

    def descriptors(self) -> int:
        return len(list(Path(f"/proc/{self.pid}/fd").iterdir()))

    def threads(self) -> int:
        return len(list(Path(f"/proc/{self.pid}/task").iterdir()))

    def leave(self) -> None:
        for peer in self.held:
            peer.close()
        self.held.clear()
        self.client.close()


def connections_without_a_header(victim: Victim) -> None:
    for _ in range(MANY):
        victim.connect()


def half_headers(victim: Victim) -> None:
    for _ in range(MANY):
        victim.connect(data=b"\xff\xff\x00\x00\x10\x00")


def headers_byte_by_byte(victim: Victim) -> None:
    peers = [victim.connect() for _ in range(20)]
    for byte in encode_header({"topic": "/back", "md5sum": "*", "callerid": "/slow"}):
        for peer in peers:
            with contextlib.suppress(OSError):
                peer.sendall(bytes([byte]))


def garbage(victim: Victim) -> None:
    for seed in range(MANY):
        victim.connect(data=bytes((seed * 7 + at * at) % 256 for at in range(1000)))


def idle_service_clients(victim: Victim) -> None:
    for _ in range(MANY):
        victim.greet({"service": "/quick"})


def idle_persistent_clients(victim: Victim) -> None:
    for _ in range(MANY):
        victim.greet({"service": "/quick", "persistent": "1"})


def half_requests(victim: Victim) -> None:
    for _ in range(MANY):
        victim.greet({"service": "/quick"}, struct.pack("<IB", 1000, 0))


def responses_not_read(victim: Victim) -> None:
    for _ in range(20):
        victim.greet({"service": "/large"}, struct.pack("<IB", 1, 1))


def topic_links(victim: Victim) -> None:
    for _ in range(MANY):
        victim.greet({"topic": "/back"})


def idle_connections_to_the_slave_api(victim: Victim) -> None:
    for _ in range(MANY):
        victim.connect(victim.api_port)


def half_requests_to_the_slave_api(victim: Victim) -> None:
    for _ in range(MANY):
        victim.connect(victim.api_port, b"POST / HTTP/1.1\r\nContent-Length: 100\r\n\r\n<")


def large_bodies(victim: Victim) -> None:
    for _ in range(20):
        victim.connect(
            victim.api_port, b"POST / HTTP/1.1\r\nContent-Length: 16000000\r\n\r\n" + bytes(15_000_000)
        )


def dead_publishers(victim: Victim) -> None:
    with RpcClient(victim.uri, timeout_s=ANSWER_S) as api:
        uris = [f"http://127.0.0.1:1/{number}" for number in range(5_000)]
        api.call("publisherUpdate", "/master", "/listed", uris)


def silent_publishers(victim: Victim) -> None:
    listener = socket.create_server(("127.0.0.1", 0), backlog=1000)
    victim.held.append(listener)
    with RpcClient(victim.uri, timeout_s=ANSWER_S) as api:
        uris = [f"http://127.0.0.1:{listener.getsockname()[1]}/{number}" for number in range(500)]
        api.call("publisherUpdate", "/master", "/listed", uris)


ATTACKS = (
    *(connections_without_a_header, half_headers, headers_byte_by_byte, garbage, idle_service_clients),
    *(
        idle_persistent_clients, half_requests, responses_not_read, topic_links,
        idle_connections_to_the_slave_api,
    ),
    *(half_requests_to_the_slave_api, large_bodies, dead_publishers, silent_publishers),
)  # fmt: skip


@pytest.fixture
def victim(master: Master, processes: Processes) -> Iterator[Victim]:
    process = processes.start(sys.executable, "-c", VICTIM, environment={"ROS_MASTER_URI": master.uri})
    found = Victim(master, process.pid)
    yield found
    found.leave()


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__.replace("_", " "))
def test_an_attacked_node_continues_to_serve_others(victim, make_node, attack) -> None:
    friend, inbox = make_node("friend"), Inbox()
    publisher = friend.advertise("forth", String)
    wait_until_connected(friend.subscribe("back", String, inbox))
    wait_until_connected(publisher)
    call, request = friend.client("quick", SetBool), SetBool._request_class(data=True)
    api = RpcClient(victim.uri, timeout_s=ANSWER_S)
    before, rounds, is_over, failures = victim.descriptors(), [0], threading.Event(), []

    def look_on() -> None:
        """Check that every call gets a response, and that the links are still the same."""
        try:
            while not is_over.is_set() or rounds[0] < 3:
                count = len(inbox.messages)
                publisher.publish(String("hello"))
                wait_until(lambda: len(inbox.messages) > count, ANSWER_S)  # noqa: B023
                assert api.call("getPid", "/friend")[0] == 1
                assert call.call(request, ANSWER_S).success
                rounds[0] += 1
        except Exception as error:
            failures.append(error)

    bystander = threading.Thread(target=look_on)
    bystander.start()
    try:
        attack(victim)
        late = make_node("late").subscribe("back", String, Inbox())
        wait_until(lambda: late.connection_count or failures, ANSWER_S)
        assert victim.threads() < 60
        assert victim.descriptors() < DESCRIPTORS
    finally:
        is_over.set()
        bystander.join(4 * ANSWER_S)
    assert not failures, failures
    assert inbox.messages
    victim.leave()
    with contextlib.suppress(OSError):
        api.call("publisherUpdate", "/master", "/listed", [])
    wait_until(lambda: victim.descriptors() <= before + 5, ANSWER_S)
    api.close()
