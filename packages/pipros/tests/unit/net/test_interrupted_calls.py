"""Calls over XML-RPC that are interrupted: at once, or after the time that a server needs to respond."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event, Thread
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from pipros.basics.errors import Interrupted
from pipros.net.rpc_client import RpcClient


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
