"""Calls over XML-RPC to the master and others, and advice about those that cannot be reached."""

import asyncio
import socket
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event, Thread
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from pipros.basics.errors import Interrupted, ProtocolError, Unreachable
from pipros.basics.limits import Limits
from pipros.basics.uri import host_of
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.net.server_proxy import server_proxy
from pipros.net.unreachable import explain


@pytest.mark.parametrize(("host", "names_own_computer"), [("localhost", False), ("203.0.113.5", True)])
def test_a_master_on_another_computer_may_listen_on_its_own_only(
    monkeypatch: pytest.MonkeyPatch, host: str, names_own_computer: bool
) -> None:
    def refuse(*_: object, **__: object) -> object:
        raise Unreachable(f"http://{host}:11311/", "Connection refused")

    monkeypatch.setattr("pipros.net.master_client.RpcClient.call", refuse)
    with pytest.raises(Unreachable, match="Is roscore running there") as raised:
        MasterClient(f"http://{host}:11311/", "/me").call("getPid")
    assert ("accepts connections only from its own computer" in str(raised.value)) == names_own_computer


def test_a_request_that_the_master_refuses_while_it_arrives_gets_the_reason(monkeypatch) -> None:
    """A broken pipe is not the reason: it only shows that the master reads no further."""

    def refused(sock: socket.socket, data: bytes) -> None:
        sock.send(data[:300])
        raise BrokenPipeError(32, "Broken pipe")

    with Master(port=0, limits=Limits(body_bytes=1000)) as master:
        client = MasterClient(master.uri, "/me")
        monkeypatch.setattr(socket.socket, "sendall", refused)
        with pytest.raises(ProtocolError, match=r"413 Content Too Large: .*the limit is 1000"):
            client.set_param("/a", "x" * 10_000)
        client.close()


# Calls over XML-RPC that are interrupted: at once, or after the time that a server needs to respond.


class Server:
    """An XML-RPC server with one method, which responds once `may_respond` is set."""

    def __init__(self) -> None:
        self.is_called = Event()
        self.may_respond = Event()
        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self._server.register_function(self._answer, "answer")
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}/"
        self._thread = Thread(target=self._server.serve_forever)
        self._thread.start()

    def _answer(self) -> int:
        self.is_called.set()
        self.may_respond.wait(30)
        return 42

    def close(self) -> None:
        self.may_respond.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    yield server
    server.close()


def running_call(client: RpcClient, server: Server, pool: ThreadPoolExecutor) -> Future[object]:
    call = pool.submit(client.call, "answer")
    assert server.is_called.wait(30)
    return call


def test_a_call_whose_response_comes_within_the_grace_is_not_interrupted(server: Server) -> None:
    with ThreadPoolExecutor() as pool, RpcClient(server.uri) as client:
        call = running_call(client, server, pool)
        interruption = pool.submit(client.interrupt, 1.0, grace_s=30.0)
        server.may_respond.set()

        assert call.result(30) == 42
        interruption.result(10)  # it does not wait longer than the call


@pytest.mark.parametrize("grace_s", [0.0, 0.05])
def test_a_call_without_a_response_is_interrupted_after_the_grace(server: Server, grace_s: float) -> None:
    with ThreadPoolExecutor() as pool, RpcClient(server.uri) as client:
        call = running_call(client, server, pool)
        client.interrupt(1.0, grace_s)

        with pytest.raises(Interrupted):
            call.result(30)


# XML-RPC proxies with a time limit.


def test_calls_to_silent_servers_end_at_the_time_limit() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        proxy = server_proxy(f"http://127.0.0.1:{silent.getsockname()[1]}/", timeout_s=0.1)
        with pytest.raises(TimeoutError):
            proxy.getPid("/test")


def test_other_schemes_are_refused() -> None:
    with pytest.raises(OSError, match="must start with http://, got ftp://robot:1/"):
        server_proxy("ftp://robot:1/")


# The advice about an unreachable peer depends on the likely reason.


@pytest.mark.parametrize(("peer", "advice"), [
    ("http://no-such-robot.invalid:1234/", "cannot resolve the name [no-such-robot.invalid]: set ROS_IP"),
    ("http://localhost:1/", "is local: the node has ended"), ("203.0.113.5:1", "a firewall blocks it"),
])  # fmt: skip
def test_advice_fits_the_address(peer: str, advice: str) -> None:
    assert advice in asyncio.run(explain(peer))


def test_a_host_is_recognised_in_every_form() -> None:
    peers = ("http://robot:123/", "10.0.0.1:5", "http://[::1]:80/", "rosrpc://a:1")
    assert [host_of(peer) for peer in peers] == ["robot", "10.0.0.1", "::1", "a"]
