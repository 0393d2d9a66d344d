"""Peers that open connections and abandon them: others can connect, and no resource grows."""

import os
import signal
import socket
import struct
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

from pipros.basics.limits import Limits
from pipros.net.rpc_client import RpcClient
from pipros.node import Node
from pipros.node.service_link import ServiceFailed
from pipros.wire.header import HeaderReader, encode_header
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode, connected, listening_log, wait_until_connected
from tests.support.slaves import Served
from tests.support.waiting import wait_until

ON = SetBool._request_class(data=True)
REQUEST = struct.pack("<IB", 1, 1)
SERVICE = {"service": "/set", "md5sum": "*", "callerid": "/attacker"}
TOPIC = {"topic": "/chat", "md5sum": "*", "callerid": "/attacker"}
FEW = Limits(tcpros_connections=40)  # 10 of them for handshakes


class Attacker:
    """Opens connections to a node, and closes them after the test."""

    def __init__(self) -> None:
        self.peers = ExitStack()

    def connect(self, node: Node, header: dict[str, str], *, source: str = "127.0.0.1") -> socket.socket:
        """A connection whose header the node has answered."""
        peer = socket.create_connection(("127.0.0.1", node.endpoints.port), 30, source_address=(source, 0))
        self.peers.enter_context(peer)
        peer.sendall(encode_header(header))
        read_header(peer)
        return peer

    def hang(self, node: Node, header: dict[str, str], count: int) -> list[socket.socket]:
        return [self.connect(node, header) for _ in range(count)]


@pytest.fixture
def attacker() -> Iterator[Attacker]:
    found = Attacker()
    yield found
    found.peers.close()


def read_header(peer: socket.socket) -> None:
    reader = HeaderReader()
    while (data := peer.recv(1)) and reader.feed(data) is None:
        pass


def is_closed(peer: socket.socket) -> bool:
    peer.settimeout(0)
    try:
        return peer.recv(1) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


def answer(_: Any) -> Any:
    return SetBool._response_class(success=True, message="done")


def serving(make_node: MakeNode, **options: Any) -> Node:
    node = make_node("node", **options)
    node.serve("set", SetBool, answer)
    return node


def service_threads() -> int:
    return sum(thread.name.startswith("service of") for thread in threading.enumerate())


@pytest.mark.parametrize("fields", [SERVICE, {**SERVICE, "persistent": "1"}], ids=["one call", "persistent"])
def test_idle_service_clients_need_no_thread_and_do_not_block_others(make_node, attacker, fields) -> None:
    log, lines = listening_log()
    node, friend = make_node("node", log=log, limits=FEW), make_node("friend")
    node.serve("set", SetBool, answer)
    publisher, inbox = node.advertise("chat", String), Inbox()
    friend.subscribe("chat", String, inbox)
    wait_until_connected(publisher)

    idle = attacker.hang(node, fields, 100)

    assert friend.client("set", SetBool).call(ON, 30).message == "done"
    late = make_node("late").subscribe("chat", String, Inbox())
    wait_until_connected(late)
    publisher.publish(String("still here"))
    assert inbox.wait()[0].data == "still here"
    with RpcClient(node.uri, timeout_s=30) as peer:
        assert peer.call("getPid", "/friend")[0] == 1
    wait_until(lambda: sum(map(is_closed, idle)) >= 60)
    wait_until(lambda: service_threads() <= 4 + 8)
    refusals = [line for line in lines if "refused 127.0.0.1: too many connections" in line]
    assert len(refusals) == 1


def test_a_node_recovers_after_an_attack(make_node: MakeNode, attacker: Attacker) -> None:
    node = serving(make_node, limits=FEW)
    node.advertise("chat", String)
    attacker.hang(node, SERVICE, 50)
    attacker.hang(node, TOPIC, 50)
    attacker.peers.close()

    wait_until(lambda: len(node.connections) == 0)
    subscriber = make_node("friend").subscribe("chat", String, Inbox())
    wait_until_connected(subscriber)


def test_a_flood_of_links_keeps_old_ones_and_admits_new_ones(make_node: MakeNode, attacker: Attacker) -> None:
    node, inbox, late_inbox = make_node("node", limits=FEW), Inbox(), Inbox()
    publisher = connected(node, make_node("friend"), "chat", String, inbox)

    attacker.hang(node, TOPIC, 100)

    late = make_node("late").subscribe("chat", String, late_inbox)
    wait_until_connected(late)
    publisher.publish(String("all"))
    assert inbox.wait()[0].data == late_inbox.wait()[0].data == "all"
    assert publisher.connection_count <= 40


def test_no_address_exceeds_its_share(make_node: MakeNode, attacker: Attacker, constants: Constants) -> None:
    constants(HANDSHAKES=8, TCPROS_CONNECTIONS_PER_PEER=5)
    node = serving(make_node, limits=Limits(tcpros_connections=40))
    others = [attacker.connect(node, SERVICE, source="127.0.0.3") for _ in range(5)]

    greedy = [attacker.connect(node, SERVICE, source="127.0.0.2") for _ in range(20)]

    wait_until(lambda: sum(map(is_closed, greedy)) == 15)
    assert not any(map(is_closed, others))


def test_half_a_request_is_waited_for_up_to_its_deadline(make_node, attacker, constants) -> None:
    constants(WHOLE_REQUEST_S=0.3)
    node = serving(make_node)
    silent = attacker.connect(node, SERVICE)
    half = attacker.connect(node, {**SERVICE, "persistent": "1"})
    half.sendall(REQUEST[:3])
    for peer in (silent, half):
        assert peer.recv(1) == b""


def test_a_persistent_client_may_be_idle_for_longer_than_a_request_may_take(
    make_node: MakeNode, attacker: Attacker, constants: Constants
) -> None:
    constants(WHOLE_REQUEST_S=0.2)
    node = serving(make_node)
    patient = attacker.connect(node, {**SERVICE, "persistent": "1"})
    hasty = attacker.connect(node, SERVICE)
    assert hasty.recv(1) == b""  # it times out
    for _ in range(2):
        patient.sendall(REQUEST)
        assert patient.recv(14, socket.MSG_WAITALL).endswith(b"done")


def test_a_request_in_many_pieces_is_answered(make_node: MakeNode, attacker: Attacker) -> None:
    node = serving(make_node)
    slow = attacker.connect(node, SERVICE)
    slow.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    pause = threading.Event()
    for byte in REQUEST:
        pause.wait(0.06)  # longer than a thread waits for it
        slow.sendall(bytes([byte]))
    assert slow.recv(1) == b"\x01"


def test_pipelined_requests_are_answered_in_order(make_node: MakeNode, attacker: Attacker) -> None:
    node = serving(make_node)
    hasty = attacker.connect(node, {**SERVICE, "persistent": "1"})
    hasty.sendall(REQUEST * 100)
    received = b""
    while len(received) < 100 * 14:
        received += hasty.recv(65536)
    assert received.count(b"done") == 100


class LargeAnswers:
    """A service with replies of several MB."""

    def __init__(self, node: Node) -> None:
        self.answered = 0
        node.serve("set", SetBool, self.answer)

    def answer(self, _: Any) -> Any:
        self.answered += 1
        return SetBool._response_class(success=True, message="x" * 20_000_000)


def test_an_unread_reply_holds_no_thread_and_is_dropped_at_its_deadline(
    make_node: MakeNode, attacker: Attacker, constants: Constants
) -> None:
    constants(WHOLE_REQUEST_S=1.0)
    node = make_node("node", limits=Limits(service_threads=2))
    service = LargeAnswers(node)
    deaf = [attacker.connect(node, {**SERVICE, "persistent": "1"}) for _ in range(4)]  # may be idle before
    for peer in deaf:
        peer.sendall(REQUEST)
    wait_until(lambda: service.answered == 4)  # with two threads
    wait_until(lambda: len(node.connections) == 0)


def test_unread_replies_have_a_total_limit(make_node, attacker: Attacker, constants: Constants) -> None:
    constants(BODIES_BYTES=50000000)
    node = make_node("node")
    service = LargeAnswers(node)
    deaf = [attacker.connect(node, SERVICE) for _ in range(10)]
    for number, peer in enumerate(deaf, 1):
        peer.sendall(REQUEST)
        wait_until(lambda: service.answered == number)  # noqa: B023
    wait_until(lambda: len(node.connections) <= 3)  # 20 MB each, minus the bytes in socket buffers


def test_incomplete_requests_have_a_total_limit(make_node: MakeNode, attacker: Attacker) -> None:
    node = serving(make_node, limits=Limits(frame_bytes=5_000_000))
    half = struct.pack("<I", 4_000_000) + b"x" * 2_000_000
    peers = attacker.hang(node, SERVICE, 8)
    for peer in peers:
        peer.sendall(half)
    wait_until(lambda: sum(map(is_closed, peers)) >= 6)  # two fit

    client = attacker.connect(node, SERVICE)
    client.sendall(REQUEST)
    client.settimeout(30)
    assert client.recv(1) == b"\1"
    assert not all(map(is_closed, peers))


def test_incomplete_messages_have_a_total_limit(make_node: MakeNode, attacker: Attacker) -> None:
    listener, talker = make_node("listener", limits=Limits(frame_bytes=5_000_000)), make_node("talker")
    inbox = Inbox()
    publisher = connected(talker, listener, "chat", String, inbox)
    server = attacker.peers.enter_context(socket.create_server(("127.0.0.1", 0)))
    here = [1, "", ["TCPROS", "127.0.0.1", server.getsockname()[1]]]
    slave = attacker.peers.enter_context(Served({"requestTopic": lambda *_: here}))
    liars = [f"{slave.api}{number}" for number in range(8)]
    with RpcClient(listener.uri, timeout_s=30) as peer:
        peer.call("publisherUpdate", "/master", "/chat", [talker.uri, *liars])
    answer = encode_header({"type": String._type, "md5sum": String._md5sum, "callerid": "/liar"})
    links = [attacker.peers.enter_context(server.accept()[0]) for _ in liars]
    for each in links:
        read_header(each)
        each.sendall(answer + struct.pack("<I", 4_000_000) + b"x" * 2_000_000)
    wait_until(lambda: sum(map(is_closed, links)) >= 4)  # four buffers fit

    publisher.publish(String(data="hello"))
    assert inbox.wait(1) == [String(data="hello")]
    assert publisher.connection_count == 1


def test_malformed_requests_do_not_fill_the_log(make_node: MakeNode, attacker: Attacker) -> None:
    log, lines = listening_log()
    node = make_node("node", log=log)
    node.serve("set", SetBool, answer)
    for _ in range(40):
        peer = attacker.connect(node, SERVICE)
        peer.sendall(struct.pack("<I", 0))
        wait_until(lambda: is_closed(peer))  # noqa: B023
    wait_until(lambda: any("service [/set]: cannot read a request" in line for line in lines))
    assert sum("cannot read" in line for line in lines) < 20


def test_a_reply_that_is_read_slowly_arrives(make_node: MakeNode, attacker: Attacker) -> None:
    node = make_node("node")
    LargeAnswers(node)
    slow = attacker.connect(node, SERVICE)
    slow.sendall(REQUEST)
    pause, received = threading.Event(), 0
    pause.wait(0.2)
    while data := slow.recv(1_000_000):
        received += len(data)
        pause.wait(0.01)
    assert received == 20_000_000 + 10


def test_calls_beyond_the_threads_wait_for_their_turn(make_node: MakeNode) -> None:
    node, client = make_node("node", limits=Limits(service_threads=2)), make_node("client")
    gate, entered, most = threading.Event(), [], []

    def handle(_: Any) -> Any:
        entered.append(1)
        most.append(len(entered))
        gate.wait(60)
        entered.pop()
        return SetBool._response_class(success=True)

    node.serve("set", SetBool, handle)
    replies: list[bool] = []
    callers = [
        threading.Thread(target=lambda: replies.append(client.client("set", SetBool).call(ON, 60).success))
        for _ in range(10)
    ]
    for caller in callers:
        caller.start()
    wait_until(lambda: len(entered) == 2)
    with RpcClient(node.uri, timeout_s=30) as peer:
        assert peer.call("getPid", "/friend")[0] == 1
    gate.set()
    for caller in callers:
        caller.join(60)
    assert replies == [True] * 10
    assert max(most) == 2


def test_a_large_reply_is_refused_by_the_client(make_node: MakeNode) -> None:
    node, client = make_node("node"), make_node("client", limits=Limits(frame_bytes=1_000_000))
    LargeAnswers(node)
    with pytest.raises(ServiceFailed, match=r"reply of 200000\d\d bytes was announced; the limit is 1000000"):
        client.client("set", SetBool).call(ON, 30)


@pytest.mark.parametrize("text", ["a file \udcff", "\x00\x1b"])
def test_a_handler_may_fail_with_any_text(make_node: MakeNode, text: str) -> None:
    def handle(_: Any) -> Any:
        raise OSError(text)

    node = make_node("node")
    node.serve("set", SetBool, handle)
    with pytest.raises(ServiceFailed, match="responded with an error: b'error processing request: "):
        make_node("client").client("set", SetBool).call(ON, 30)


def test_a_failing_error_handler_does_not_hide_the_error(make_node: MakeNode) -> None:
    def fail(_: Any) -> Any:
        raise ValueError("on purpose")

    log, lines = listening_log()
    node = make_node("node", log=log)
    node.serve("set", SetBool, fail, on_error=fail)
    with pytest.raises(ServiceFailed, match="error processing request: on purpose"):
        make_node("client").client("set", SetBool).call(ON, 30)
    assert lines == ["the error handler of service [/set] failed"]


def test_a_name_that_is_invalid_in_xml_does_not_hide_others(make_node: MakeNode, attacker: Attacker) -> None:
    node = make_node("node")
    publisher = node.advertise("chat", String)
    attacker.connect(node, {**TOPIC, "callerid": "/evil\x01\ufffe"})
    make_node("friend").subscribe("chat", String, Inbox())
    wait_until_connected(publisher, 2)
    with RpcClient(node.uri, timeout_s=30) as peer:
        code, _, links = peer.call("getBusInfo", "/friend")
    assert code == 1
    assert sorted(link[1] for link in links) == ["/evil\\x01\\ufffe", "/friend"]


def is_refused(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 10).close()
    except ConnectionRefusedError:
        return True
    return False


def test_a_forked_child_does_not_keep_the_ports_of_a_node_open(make_node: MakeNode) -> None:
    node = make_node("node")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads are available: this is what is tested
        child = os.fork()
    if not child:
        while True:
            time.sleep(10)
    try:
        ports = node.endpoints.port, int(node.uri.rpartition(":")[2].strip("/"))
        node.shutdown("the end")
        for port in ports:  # the child may not have run yet; it closes them first
            wait_until(lambda port=port: is_refused(port), 30.0, f"port {port} to be closed")
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def test_unfinished_requests_to_the_slave_api_have_a_total_limit(make_node, attacker, constants) -> None:
    constants(BODIES_BYTES=1000000)
    node = make_node("node")
    port = int(node.uri.rpartition(":")[2].strip("/"))
    half = b"POST / HTTP/1.1\r\nContent-Length: 400000\r\n\r\n" + b"x" * 300_000
    peers = []
    for _ in range(8):
        peer = socket.create_connection(("127.0.0.1", port), 10)
        attacker.peers.enter_context(peer)
        peer.sendall(half)
        peers.append(peer)
    wait_until(lambda: sum(map(is_closed, peers)) == 5)
    assert is_closed(peers[0])
    with RpcClient(node.uri, timeout_s=30) as peer:
        assert peer.call("getPid", "/friend")[0] == 1
