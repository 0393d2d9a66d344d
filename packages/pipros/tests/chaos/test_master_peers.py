"""Hostile, silent and broken peers of the master: it continues to serve all others.

The master runs in its own process, so that the test's own work is not counted. A bystander calls the
master during each attack; every response must arrive in time. A healthy master takes milliseconds
(`docs/internals/master.md` has the figures), a stuck master far longer than a pause of a busy machine.
"""

import resource
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from pipros.basics.errors import Refused, Unreachable
from pipros.net.master_client import MasterClient
from pipros.wire.http import build_request
from pipros.wire.xmlrpc import Fault, encode_call
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes
from tests.support.slaves import FakeSlave, SilentSlave
from tests.support.waiting import wait_until

ANSWER_S = 20.0
BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "aaaaaaaaaa">'
    + b"".join(b'<!ENTITY a%d "%s">' % (n, b"&a%s;" % (b"%d" % (n - 1) if n else b"") * 10) for n in range(9))
    + b"]><methodCall><methodName>&a8;</methodName></methodCall>"
)


class RunningMaster:
    def __init__(self, port: int) -> None:
        self.port = port
        self.client = MasterClient(f"http://127.0.0.1:{port}/", "/bystander", timeout_s=ANSWER_S)

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), 60)

    def is_up(self) -> bool:
        try:
            return self.client.get_pid() > 0
        except Unreachable:
            return False

    @contextmanager
    def answering_meanwhile(self) -> Iterator[None]:
        """Call the master continuously until the block ends; fail if a response was late."""
        end = threading.Event()
        failures: list[Exception] = []
        asked = threading.Semaphore(0)

        def ask() -> None:
            while not end.is_set():
                try:
                    self.client.set_param("/bystander", 1)
                    assert self.client.get_param("/bystander") == 1
                except Exception as error:
                    failures.append(error)
                    return
                finally:
                    asked.release()

        bystander = threading.Thread(target=ask)
        bystander.start()
        asked.acquire()
        try:
            yield
            for _ in range(3):  # answers after the attack count too
                asked.acquire(timeout=ANSWER_S)
        finally:
            end.set()
            bystander.join()
        assert not failures, failures


@pytest.fixture
def master(processes: Processes, claimed_port: ClaimedPort) -> RunningMaster:
    processes.start(
        sys.executable, "-m", "pipros_tools.cli.rosmaster", "--core", "-p", str(claimed_port.number)
    )
    running = RunningMaster(claimed_port.number)
    wait_until(running.is_up)
    return running


def read_to_end(peer: socket.socket) -> bytes:
    received = b""
    with suppress(ConnectionResetError):
        while data := peer.recv(65536):
            received += data
    return received


def send_until_refused(peer: socket.socket, piece: bytes, count: int) -> int:
    """Return the number of pieces sent before the master closed the connection."""
    for sent in range(count):
        try:
            peer.sendall(piece)
        except (ConnectionResetError, BrokenPipeError):
            return sent
    return count


def test_connections_that_stay_half_open(master: RunningMaster) -> None:
    pieces = [
        b"", b"POST", b"POST / HTTP/1.1\r\nContent-Length: 100\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\n<",
    ]  # fmt: skip
    with master.answering_meanwhile():
        peers = [master.connect() for _ in range(200)]
        for number, peer in enumerate(peers):
            peer.sendall(pieces[number % len(pieces)])
    for peer in peers:
        peer.close()


def test_a_request_sent_byte_by_byte_is_answered(master: RunningMaster) -> None:
    with master.answering_meanwhile(), master.connect() as peer:
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in build_request("h", "/", encode_call("getUri", ("/slow",))):
            peer.sendall(bytes([byte]))
        assert b"200 OK" in peer.recv(65536)


def test_thousands_of_idle_connections(master: RunningMaster) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 10_200
    if hard != resource.RLIM_INFINITY and hard < wanted:
        pytest.skip(f"only {hard} descriptors may be open here")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))
    peers = []
    try:
        with master.answering_meanwhile():
            peers += [master.connect() for _ in range(10_000)]
    finally:
        for peer in peers:
            peer.close()
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    with master.answering_meanwhile():
        pass


def test_a_body_of_a_gigabyte_sent_in_chunks_is_cut_off_at_the_limit(master: RunningMaster) -> None:
    megabyte = b"100000\r\n" + b"x" * 0x100000 + b"\r\n"
    with master.answering_meanwhile(), master.connect() as peer:
        peer.sendall(b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n")
        assert send_until_refused(peer, megabyte, 1000) < 100


def test_a_value_as_large_as_the_limit_allows(master: RunningMaster) -> None:
    large = MasterClient(f"http://127.0.0.1:{master.port}/", "/large", timeout_s=30)
    with master.answering_meanwhile():
        large.set_param("/large", [{"name": "x" * 10, "value": number} for number in range(60_000)])
        assert len(large.get_param("/large")) == 60_000
        large.delete_param("/large")


def test_a_text_as_long_as_the_limit_allows(master: RunningMaster) -> None:
    large = MasterClient(f"http://127.0.0.1:{master.port}/", "/large", timeout_s=30)
    text = "x\n" * 7_500_000
    with master.answering_meanwhile():
        large.set_param("/large", text)
        assert large.get_param("/large") == text
        large.delete_param("/large")


def test_a_large_parameter_of_many_subscribers(master: RunningMaster) -> None:
    deaf = [SilentSlave() for _ in range(20)]
    listening = FakeSlave()
    for number, api in enumerate([*(found.api for found in deaf), listening.api]):
        node = MasterClient(f"http://127.0.0.1:{master.port}/", f"/s{number}", timeout_s=ANSWER_S)
        node.subscribe_param(api, "/large")
    large = MasterClient(f"http://127.0.0.1:{master.port}/", "/large", timeout_s=30)
    value = [{"name": "x" * 10, "value": number} for number in range(60_000)]
    with master.answering_meanwhile():
        large.set_param("/large", value)
        wait_until(lambda: listening.told and listening.told[-1][3] == value, 60)
    for slave in [*deaf, listening]:
        slave.stop()


def test_names_of_thousands_of_parts(master: RunningMaster) -> None:
    far_down = MasterClient(f"http://127.0.0.1:{master.port}/", "/x" * 8_000, timeout_s=30)
    with master.answering_meanwhile():
        with pytest.raises(Refused, match="Cannot find parameter"):
            far_down.search_param("nowhere")
        with pytest.raises(Refused, match="the limit is 90"):
            far_down.set_param("~deep", 1)
        with pytest.raises(Refused, match="longer than 16384 characters"):
            far_down.get_param("/x" * 5_000_000)
        assert far_down.get_param("/bystander") == 1


def test_thousands_of_pipelined_calls(master: RunningMaster) -> None:
    calls = build_request("h", "/", encode_call("getUri", ("/hasty",))) * 5_000
    with master.answering_meanwhile(), master.connect() as peer:
        sending = threading.Thread(target=lambda: (peer.sendall(calls), peer.shutdown(socket.SHUT_WR)))
        sending.start()
        assert read_to_end(peer).count(b"</methodResponse>") == 5_000
        sending.join()


@pytest.mark.parametrize(
    ("stream", "answer"),
    [
        (b"\r\n" * 5_000_000 + build_request("h", "/", encode_call("getUri", ("/x",))), b"HTTP/1.1 200"),
        (
            b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n" + b"1\r\nx\r\n" * 1_000_000,
            b"HTTP/1.1 413",
        ),
    ],
    ids=["blank lines", "small chunks"],
)
def test_hostile_streams_do_not_block_it(master: RunningMaster, stream: bytes, answer: bytes) -> None:
    with master.answering_meanwhile(), master.connect() as peer:
        peer.sendall(stream)
        peer.shutdown(socket.SHUT_WR)
        assert read_to_end(peer).startswith(answer)


@pytest.mark.parametrize(
    "document",
    [
        lambda: BOMB,
        lambda: b"<methodCall><methodName>m</methodName><params><param>" + b"<value><array><data>" * 200_000,
        lambda: b"<methodCall>" + b" " * 1_000_000,
        lambda: (
            b"<methodCall><methodName>m</methodName><params><param><value>"
            + b"\n" * 5_000_000
            + b"<int>1</int>"
        ),
        lambda: b"<" * 1_000_000,
        lambda: b"\xff" * 1_000_000,
        lambda: encode_call(
            "system.multicall", ([{"methodName": "getSystemState", "params": ["/x"]}] * 20_000,)
        ),
        lambda: encode_call("system.multicall", ([{"methodName": "nosuch", "params": []}] * 50_000,)),
    ],
    ids=["entities", "depth", "blanks", "blanks in a value", "angles", "no text", "multicall", "faults"],
)
def test_expensive_documents_do_not_block_it(master: RunningMaster, document: Callable[[], bytes]) -> None:
    with master.answering_meanwhile(), master.connect() as peer:
        peer.sendall(build_request("h", "/", document()))
        peer.shutdown(socket.SHUT_WR)
        assert read_to_end(peer).startswith(b"HTTP/1.1 200")


def test_garbage(master: RunningMaster) -> None:
    with master.answering_meanwhile():
        for seed in range(100):
            with master.connect() as peer, suppress(OSError):
                peer.sendall(bytes((seed * 7 + at * at) % 256 for at in range(5000)))
                peer.shutdown(socket.SHUT_WR)
                read_to_end(peer)


def test_a_peer_that_asks_for_much_and_never_reads(master: RunningMaster) -> None:
    master.client.set_param("/much", "x" * 500_000)
    call = build_request("h", "/", encode_call("getParam", ("/deaf", "/much"))) * 100
    with master.answering_meanwhile(), master.connect() as peer:
        peer.settimeout(0.5)
        with suppress(TimeoutError, ConnectionError):
            for _ in range(1000):
                peer.sendall(call)


def told_after(master: RunningMaster, disturb: Callable[[], None]) -> None:
    """Check that a subscriber is notified of a new publisher during the attack."""
    slave = FakeSlave()
    try:
        subscriber = MasterClient(f"http://127.0.0.1:{master.port}/", "/s", timeout_s=ANSWER_S)
        subscriber.register_subscriber("/t", "x/Y", slave.api)
        disturb()
        subscriber.register_publisher("/t", "x/Y", slave.api)
        wait_until(lambda: slave.publishers() and slave.api in slave.publishers()[-1])
    finally:
        slave.stop()


def test_nodes_whose_api_hangs_or_is_not_an_api(master: RunningMaster) -> None:
    hanging = [SilentSlave() for _ in range(20)]
    odd = [
        "http://127.0.0.1:1/", "http://no.such.host.invalid:1/", "http://", "http://a..b:1/",
        "http://127.0.0.1:1/ HTTP/1.1\r\nX: y", f"http://127.0.0.1:{master.port}/",
    ]  # fmt: skip

    def register_them() -> None:
        for number, api in enumerate([*(found.api for found in hanging), *odd]):
            node = MasterClient(f"http://127.0.0.1:{master.port}/", f"/odd_{number}", timeout_s=ANSWER_S)
            node.register_subscriber("/t", "x/Y", api)

    with master.answering_meanwhile():
        told_after(master, register_them)
    for found in hanging:
        found.stop()


def test_only_methods_in_the_table_can_be_called(master: RunningMaster) -> None:
    for name in ("__class__", "_registry", "methods", "methods.__class__", "getUri.__globals__", ""):
        with pytest.raises(Fault, match="not supported"):
            master.client.call(name)
