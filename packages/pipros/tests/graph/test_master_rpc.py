"""The XML-RPC server and its clients, over real sockets."""

import asyncio
import fcntl
import socket
import sys
import termios
import threading
import xmlrpc.client
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from pipros.basics.errors import ProtocolError, Unreachable
from pipros.basics.limits import Limits
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_async_client import AsyncRpcClient, call_async
from pipros.net.rpc_client import RpcClient
from pipros.net.rpc_server import RpcServer, current_caller
from pipros.wire.http import build_request
from pipros.wire.xmlrpc import Fault, encode_call
from tests.support.constants import Constants
from tests.support.waiting import wait_until


class Serving:
    """A server on its own loop, with a few methods."""

    def __init__(self, **options: Any) -> None:
        self.loop = BackgroundLoop("rpc test")
        self.loop.start()
        self.gate = asyncio.Event()
        self.noted: list[str] = []
        self.is_held = threading.Event()
        self.may_go_on = threading.Event()
        methods = {
            "echo": lambda value: value, "add": lambda a, b=1: a + b, "fail": self.fail, "wait": self.wait,
            "caller": lambda: current_caller.get().host, "note": lambda text: self.noted.append(text) or 0,
            "hold": self.hold, "nothing": lambda: None,
        }  # fmt: skip
        self.server = RpcServer(methods, **options)
        self.loop.run(self.server.start())
        self.uri = f"http://127.0.0.1:{self.server.port}/"

    @staticmethod
    def fail() -> None:
        raise ValueError("on purpose")

    async def wait(self) -> str:
        await self.gate.wait()
        return "waited"

    def hold(self) -> bool:
        """Block the event loop, so that it afterwards receives all requests at once."""
        self.is_held.set()
        return self.may_go_on.wait(60)

    def open_gate(self) -> None:
        self.loop.call(self.gate.set)

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.server.port), 60)

    def __enter__(self) -> "Serving":
        return self

    def __exit__(self, *_: object) -> None:
        self.loop.run(self.server.stop())
        self.loop.stop()


@pytest.fixture
def serving() -> Iterator[Serving]:
    with Serving() as found:
        yield found


def request(method: str, *params: Any) -> bytes:
    return build_request("h", "/", encode_call(method, params))


def has_arrived(peer: socket.socket) -> bool:
    """Return whether the system has passed all that was sent to the other end, read there or not."""
    left = fcntl.ioctl(peer, termios.TIOCOUTQ, bytes(4))
    return not int.from_bytes(left, sys.byteorder)


def read_to_end(peer: socket.socket) -> bytes:
    received = b""
    while data := peer.recv(65536):
        received += data
    return received


def test_methods_are_called_and_answered(serving: Serving) -> None:
    with RpcClient(serving.uri, timeout_s=10) as client:
        assert client.call("echo", {"a": [1, 2.5, True, "ü"]}) == {"a": [1, 2.5, True, "ü"]}
        assert (client.call("add", 1), client.call("caller")) == (2, "127.0.0.1")
    assert serving.server.calls["add"] == 1


def test_python_clients_of_genuine_ros_are_served(serving: Serving) -> None:
    with xmlrpc.client.ServerProxy(serving.uri) as proxy:
        assert proxy.add(2, 3) == 5
        multi = xmlrpc.client.MultiCall(proxy)
        multi.add(1)
        multi.echo("x")
        assert list(multi()) == [2, "x"]


@pytest.mark.parametrize(
    ("method", "text"),
    [
        ("nosuch", "<class 'Exception'>:method \"nosuch\" is not supported"),
        ("__init__", "<class 'Exception'>:method \"__init__\" is not supported"),
        ("fail", "<class 'ValueError'>:on purpose"),
        ("nothing", "<class 'TypeError'>:cannot marshal None unless allow_none is enabled"),
    ],
)
def test_a_failed_call_is_a_fault_with_pythons_text(serving: Serving, method: str, text: str) -> None:
    with RpcClient(serving.uri) as client, pytest.raises(Fault) as caught:
        client.call(method)
    assert (caught.value.code, caught.value.text) == (1, text)


def test_a_wrong_number_of_arguments_is_a_ros_error_response(serving: Serving) -> None:
    with RpcClient(serving.uri) as client:
        for params in ((), (1, 2, 3)):
            assert client.call("add", *params) == [-1, "Error: bad call arity", 0]


def test_pipelined_calls_are_answered_in_order_also_behind_one_that_waits(serving: Serving) -> None:
    with serving.connect() as peer:
        peer.sendall(request("echo", "first") + request("wait") + request("echo", "last"))
        serving.open_gate()
        peer.shutdown(socket.SHUT_WR)
        answers = read_to_end(peer)
    assert answers.index(b"first") < answers.index(b"waited") < answers.index(b"last")


def test_pipelined_calls_and_those_of_others_take_turns(serving: Serving) -> None:
    with serving.connect() as hasty, serving.connect() as other:
        for peer in (hasty, other):
            peer.sendall(request("echo", "hello"))
            assert b"hello" in peer.recv(65536)
        hasty.sendall(request("hold"))
        assert serving.is_held.wait(60)
        hasty.sendall(request("note", "hasty") * 100)
        other.sendall(request("note", "other") * 2)
        for peer in (hasty, other):
            wait_until(lambda peer=peer: has_arrived(peer))  # type: ignore[misc]
        serving.may_go_on.set()
        for peer in (hasty, other):
            peer.shutdown(socket.SHUT_WR)
            read_to_end(peer)
    assert (len(serving.noted), serving.noted[:4].count("other")) == (102, 2)


def test_pipelined_calls_are_answered_in_order(serving: Serving) -> None:
    sent = [str(number) for number in range(2_000)]
    with serving.connect() as peer:
        sending = threading.Thread(
            target=lambda: (peer.sendall(b"".join(map(note, sent))), peer.shutdown(socket.SHUT_WR))
        )
        sending.start()
        answers = read_to_end(peer)
        sending.join()
    assert serving.noted == sent
    assert answers.count(b"<methodResponse>") == len(sent)


def note(text: str) -> bytes:
    return request("note", text)


@pytest.mark.parametrize("ending", [b"", b"Connection: close\r\n"])
def test_a_peer_that_reads_slowly_gets_large_responses_complete(serving: Serving, ending: bytes) -> None:
    large = "x" * 3_000_000
    call = request("echo", large)
    with serving.connect() as peer:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        peer.sendall(call + call.replace(b"\r\n", b"\r\n" + ending, 1) + request("note", "behind"))
        if not ending:
            peer.shutdown(socket.SHUT_WR)
        answers = read_to_end(peer)
    assert answers.count(large.encode()) == 2
    assert serving.noted == ([] if ending else ["behind"])


def test_a_waiting_call_delays_only_its_own_connection(serving: Serving) -> None:
    with RpcClient(serving.uri, timeout_s=10) as client:
        answer: list[Any] = []
        waiting = threading.Thread(target=lambda: answer.append(client.call("wait")))
        waiting.start()
        wait_until(lambda: serving.server.calls["wait"])
        assert client.call("echo", 1) == 1
        assert not answer
        serving.open_gate()
        waiting.join(60)
        assert answer == ["waited"]


def test_small_calls_overtake_large_values_in_both_directions(serving: Serving) -> None:
    value = {f"key_{number}": [number, "x" * 50] for number in range(20_000)}
    with RpcClient(serving.uri, timeout_s=30) as client:
        assert client.call("echo", value) == value


def test_http_1_0_clients_are_served_and_closed(serving: Serving) -> None:
    body = encode_call("echo", ("old",))
    with serving.connect() as peer:
        peer.sendall(b"POST / HTTP/1.0\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
        answer = read_to_end(peer)
    assert b"old" in answer
    assert b"Connection: close" in answer


def test_a_client_that_expects_100_continue_gets_it(serving: Serving) -> None:
    body = encode_call("echo", ("x",))
    with serving.connect() as peer:
        head = b"POST / HTTP/1.1\r\nExpect: 100-continue\r\nConnection: close\r\nContent-Length: %d\r\n\r\n"
        peer.sendall(head % len(body))
        assert peer.recv(100) == b"HTTP/1.1 100 Continue\r\n\r\n"
        peer.sendall(body)
        assert b"200 OK" in read_to_end(peer)


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", b"405"), (b"\x00\x01garbage\r\n\r\n", b"400"),
        (b"POST / HTTP/1.1\r\nContent-Length: 1000000000\r\n\r\n", b"413"),
        (b"POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Encoding: gzip\r\n\r\n", b"415"),
        (b"POST / HTTP/1.1\r\nX: " + b"y" * 20_000, b"431"),
    ],
)  # fmt: skip
def test_an_invalid_request_is_refused_by_status_counted_and_closed(serving, sent, status, caplog) -> None:
    for _ in range(2):
        with serving.connect() as peer:
            peer.sendall(sent)
            assert read_to_end(peer).startswith(b"HTTP/1.1 " + status)
    assert serving.server.refusals.by_peer() == {"127.0.0.1": 2}
    assert caplog.text.count("refused 127.0.0.1") == 1


def test_a_client_that_sends_too_much_can_read_the_reason() -> None:
    with (
        Serving(limits=Limits(body_bytes=1_000_000)) as serving,
        RpcClient(serving.uri, timeout_s=20) as client,
    ):
        with pytest.raises(ProtocolError, match=r"413 .* the limit is 1000000 \(body_bytes in PIPROS_LIMITS"):
            client.call("echo", "x" * 20_000_000)
        assert client.call("echo", 1) == 1


def test_the_asyncio_client_reads_the_reason_too_and_sends_large_values() -> None:
    async def calls(uri: str) -> None:
        client = AsyncRpcClient(uri)
        with pytest.raises(ProtocolError, match=r"responded with 413"):
            await client.call("echo", "x" * 20_000_000, timeout_s=20)
        large = "x" * 900_000
        for _ in range(2):
            assert await client.call("echo", large, timeout_s=20) == large
        client.close()

    with Serving(limits=Limits(body_bytes=1_000_000)) as serving:
        asyncio.run(calls(serving.uri))


def test_the_asyncio_client_gives_up_in_time_when_a_large_value_is_not_read() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        uri = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        with pytest.raises(Unreachable, match="no response in time"):
            asyncio.run(call_async(uri, "echo", "x" * 20_000_000, timeout_s=0.3))


def test_a_client_that_continues_sending_after_a_refusal_is_closed(serving: Serving) -> None:
    with serving.connect() as peer:
        peer.sendall(b"\x00garbage")
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            peer.sendall(bytes(1_000_000_000))


def test_requests_before_garbage_are_answered_before_the_garbage_is_refused(serving: Serving) -> None:
    with serving.connect() as peer:
        peer.sendall(request("wait") + request("echo", "second") + b"\x00garbage")
        serving.open_gate()
        answers = read_to_end(peer)
    assert answers.index(b"waited") < answers.index(b"second") < answers.index(b"400 Bad Request")


def test_a_peer_with_a_slow_request_is_closed(constants: Constants) -> None:
    constants(WHOLE_REQUEST_S=0.1)
    with Serving(limits=Limits()) as serving, serving.connect() as slow, serving.connect() as idle:
        slow.sendall(b"POST / HTT")
        assert read_to_end(slow) == b""
        idle.sendall(request("echo", "still here"))
        assert b"still here" in idle.recv(65536)


def test_a_peer_that_does_not_read_its_answers_is_closed(constants: Constants) -> None:
    constants(WHOLE_REQUEST_S=0.3)
    with Serving(limits=Limits()) as serving, serving.connect() as deaf:
        deaf.settimeout(30)
        call = request("echo", "x" * 60_000)

        def talk() -> None:
            while True:
                deaf.sendall(call)

        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            talk()


def test_the_connection_idle_longest_is_closed_for_a_new_one() -> None:
    with Serving(limits=Limits(rpc_connections=3)) as serving, ExitStack() as closing:
        peers = [closing.enter_context(serving.connect()) for _ in range(3)]
        wait_until(lambda: len(serving.server.connections) == 3)
        for peer in (peers[0], peers[2]):
            peer.sendall(request("echo", "used"))
            assert b"used" in peer.recv(65536)
        late = closing.enter_context(serving.connect())
        late.sendall(request("echo", "in"))
        assert b"in" in late.recv(65536)
        assert peers[1].recv(1) == b""


def test_idle_connections_are_closed_without_affecting_clients(serving, constants: Constants) -> None:
    usual = serving.server.limits
    with RpcClient(serving.uri, timeout_s=10) as client:
        assert client.call("echo", 1) == 1
        constants(IDLE_S=0.05)
        serving.server.limits = Limits()
        wait_until(lambda: len(serving.server.connections) == 0)
        serving.server.limits = usual
        assert client.call("echo", 2) == 2


def test_peers_that_are_not_admitted_are_closed_and_counted() -> None:
    with Serving(admits=lambda _: False) as serving, RpcClient(serving.uri, timeout_s=10) as client:
        with pytest.raises(Unreachable):
            client.call("echo", 1)
        assert serving.server.refusals.total >= 1


def test_many_threads_share_a_client(serving: Serving) -> None:
    with RpcClient(serving.uri, timeout_s=30) as client:
        answers: list[int] = []

        def work(start: int) -> None:
            for number in range(start, start + 50):
                assert client.call("echo", number) == number
                answers.append(number)

        threads = [threading.Thread(target=work, args=(start * 50,)) for start in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert sorted(answers) == list(range(400))


def test_an_unreachable_server_raises_with_the_reason() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # nothing listens there
        with pytest.raises(Unreachable) as caught:
            RpcClient(f"http://127.0.0.1:{taken.getsockname()[1]}/").call("echo")
    assert caught.value.reason == "Connection refused"
    assert isinstance(caught.value.__cause__, ConnectionRefusedError)


def test_a_silent_server_is_unreachable_after_the_timeout() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        uri = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        with pytest.raises(Unreachable, match="no response in time"):
            RpcClient(uri, timeout_s=0.1).call("echo")
        with pytest.raises(Unreachable, match="no response in time"):
            asyncio.run(call_async(uri, "echo", timeout_s=0.1))


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (b"SSH-2.0-OpenSSH_9\r\n\r\n", ProtocolError),
        (b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", ProtocolError),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhello", ProtocolError),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 500\r\n\r\nhello", Unreachable), (b"", Unreachable),
    ],
)  # fmt: skip
def test_a_server_that_speaks_no_xml_rpc_has_its_own_error(answer: bytes, error: type[Exception]) -> None:
    def serve(listener: socket.socket) -> None:
        for _ in range(2):
            peer, _ = listener.accept()
            peer.recv(65536)
            peer.sendall(answer)
            peer.close()

    with socket.create_server(("127.0.0.1", 0)) as listener:
        uri = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        thread = threading.Thread(target=serve, args=(listener,))
        thread.start()
        with pytest.raises(error):
            RpcClient(uri, timeout_s=10).call("echo")
        with pytest.raises(error):
            asyncio.run(call_async(uri, "echo", timeout_s=10))
        thread.join()


def test_the_asyncio_client_keeps_its_connection_and_replaces_a_closed_one(serving: Serving) -> None:
    async def calls() -> list[Any]:
        client = AsyncRpcClient(serving.uri)
        answers = [await client.call("echo", number, timeout_s=10) for number in range(3)]
        assert serving.server.connections.accepted == 1
        serving.loop.call(serving.server.connections.close_all)
        answers.append(await client.call("echo", 3, timeout_s=10))
        client.close()
        return answers

    assert asyncio.run(calls()) == [0, 1, 2, 3]
    assert serving.server.connections.accepted == 2


def test_a_multicall_with_too_large_responses_is_truncated(constants: Constants) -> None:
    constants(MULTICALL_ANSWER_BYTES=10000)
    with Serving(limits=Limits()) as serving, RpcClient(serving.uri, timeout_s=10) as client:
        call = {"methodName": "echo", "params": ["x" * 4000]}
        *good, bad = client.call("system.multicall", [call] * 3)
    assert good == [["x" * 4000]] * 2
    assert "the combined responses to a system.multicall are too large" in bad["faultString"]
