from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.errors import Interrupted
from pipros.net.connect import Connector
from pipros.net.lookup import Lookups
from tests.support.waiting import wait_until


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        yield listening


def lookups_to(*addresses: str) -> Lookups:
    def resolve(_host: str, _port: None, **_wanted: int) -> list[Any]:
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, 0)) for address in addresses]

    return Lookups(1, resolve=resolve)


def test_it_connects_to_the_first_address_that_answers(server: socket.socket) -> None:
    port = server.getsockname()[1]
    with Connector(lookups_to("127.0.0.7", "127.0.0.1")).connect("robot", port) as sock:
        assert sock.getpeername() == ("127.0.0.1", port)
        assert sock.getblocking()


def test_a_refused_connection_and_an_unknown_name_raise_their_errors(server: socket.socket) -> None:
    port = server.getsockname()[1]
    with pytest.raises(ConnectionRefusedError):
        Connector(lookups_to("127.0.0.7")).connect("robot", port)
    with pytest.raises(OSError, match="the name robot has no address"):
        Connector(lookups_to()).connect("robot", port)


@pytest.fixture
def full(server: socket.socket) -> Iterator[int]:
    """A port with a full backlog: further connections wait for an answer."""
    server.listen(0)
    waiting = []
    for _ in range(8):
        sock = socket.socket()
        sock.setblocking(False)
        sock.connect_ex(server.getsockname())
        waiting.append(sock)
    yield server.getsockname()[1]
    for sock in waiting:
        sock.close()


def test_an_unanswered_connection_attempt_times_out(full: int) -> None:
    with pytest.raises(TimeoutError):
        Connector().connect("127.0.0.1", full, limit_s=0.05)


def test_an_unanswered_connection_attempt_can_be_interrupted(full: int) -> None:
    connector, ended = Connector(), []

    def connect() -> None:
        with pytest.raises(Interrupted):
            connector.connect("127.0.0.1", full)
        ended.append(True)

    thread = threading.Thread(target=connect, daemon=True)
    thread.start()
    connector.interrupt()
    wait_until(lambda: ended)
    thread.join()
