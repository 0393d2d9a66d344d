"""Sockets of a tab: what nodes, asyncio and XML-RPC use of Python's sockets."""

import errno
import os
import select
import selectors
import socket
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from pipros_tab import sockets
from pipros_tab.network import WINDOW_BYTES, Network
from pipros_tab.sockets import TabPoll, TabSelector, getaddrinfo, read, socketpair, wait_for_any
from pipros_tab.tab_socket import HERE, TabSocket
from tests.support.tab_hub import MemoryPort, Switch


@pytest.fixture(autouse=True)
def network(monkeypatch: pytest.MonkeyPatch) -> Network:
    """The network of this process, whose connections lead back to it."""
    network = Network(MemoryPort(Switch()))
    monkeypatch.setattr(TabSocket, "network", network, raising=False)
    monkeypatch.setattr(TabSocket, "wait", staticmethod(network.wait), raising=False)
    monkeypatch.setattr(TabSocket, "by_descriptor", {})
    return network


@pytest.fixture
def pair() -> Iterator[tuple[TabSocket, TabSocket]]:
    first, second = socketpair()
    with first, second:
        yield first, second


Pair = tuple[TabSocket, TabSocket]


def test_a_blocking_socket_waits_for_bytes(pair: Pair) -> None:
    first, second = pair
    first.sendall(b"hello")
    assert second.recv(100) == b"hello"
    first.sendmsg([b"a", memoryview(b"b")])
    buffer = bytearray(4)
    assert [second.recv_into(buffer, 1), second.recv(4), bytes(buffer)] == [1, b"b", b"a\0\0\0"]


def test_a_socket_with_a_timeout_gives_up(pair: Pair) -> None:
    pair[0].settimeout(0.01)
    assert pair[0].gettimeout() == 0.01
    with pytest.raises(TimeoutError):
        pair[0].recv(1)


def test_a_non_blocking_socket_does_not_wait(network: Network, pair: Pair) -> None:
    first, second = pair
    first.setblocking(False)
    assert not first.getblocking()
    with pytest.raises(BlockingIOError):
        first.recv(1)
    assert first.send(bytes(WINDOW_BYTES + 1)) == WINDOW_BYTES
    with pytest.raises(BlockingIOError):
        first.send(b"x")
    network.receive(0.0)
    while second.is_readable:
        second.recv(WINDOW_BYTES)
    network.receive(0.0)
    assert first.send(b"x") == 1


def test_sendall_waits_for_a_reader(network: Network, pair: Pair) -> None:
    first, second = pair
    received = bytearray()
    wait = network.wait

    def wait_and_read(is_over: object, timeout_s: float | None) -> bool:
        received.extend(second.recv(WINDOW_BYTES))
        return wait(is_over, timeout_s)  # type: ignore[arg-type]

    first.sendall(bytes(WINDOW_BYTES))
    wait(lambda: second.is_readable, 1.0)
    TabSocket.wait = staticmethod(wait_and_read)
    first.sendall(b"more")
    TabSocket.wait = staticmethod(wait)
    assert len(received) >= WINDOW_BYTES // 4


def test_connecting_to_no_listener_is_refused() -> None:
    with TabSocket() as sock, pytest.raises(ConnectionRefusedError):
        sock.connect((HERE, 9))


def test_a_non_blocking_connect_ends_with_the_error_of_the_connection(network: Network) -> None:
    with TabSocket() as sock:
        sock.setblocking(False)
        with pytest.raises(BlockingIOError) as error:
            sock.connect((HERE, 9))
        assert error.value.errno == errno.EINPROGRESS
        network.receive(0.0)
        assert sock.is_writable
        assert sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) == errno.ECONNREFUSED


def test_sockets_have_names_and_no_options(pair: Pair) -> None:
    first, second = pair
    assert first.getpeername() == second.getsockname()
    assert first.getpeername()[0] == HERE
    first.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    first.set_inheritable(False)
    assert first.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) == 0
    with pytest.raises(OSError, match="not available"):
        first.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 232)


def test_a_socket_of_another_class_takes_over_a_detached_connection(pair: Pair) -> None:
    class Counted(TabSocket):
        pass

    first, second = pair
    first.send(b"before")
    taken = Counted(fileno=second.detach())
    assert TabSocket.by_descriptor[taken.fileno()] is taken
    assert taken.recv(10) == b"before"
    taken.close()
    assert (second.fileno(), first.recv(1)) == (-1, b"")


def test_shutdown_ends_the_directions(network: Network, pair: Pair) -> None:
    first, second = pair
    first.shutdown(socket.SHUT_WR)
    assert second.recv(1) == b""
    second.send(b"answer")
    assert first.recv(10) == b"answer"
    first.shutdown(socket.SHUT_RD)
    assert first.recv(1) == b""
    second.shutdown(socket.SHUT_RDWR)
    with pytest.raises(BrokenPipeError):
        second.send(b"x")


def test_a_closed_socket_has_no_descriptor(pair: Pair) -> None:
    pair[0].close()
    pair[0].close()
    assert pair[0].fileno() == -1
    with pytest.raises(OSError, match="Bad file descriptor"):
        pair[0].recv(1)
    assert pair[1].recv(1) == b""


def test_a_socket_without_a_connection_cannot_send_or_accept() -> None:
    with TabSocket() as sock:
        with pytest.raises(OSError, match="not connected"):
            sock.send(b"x")
        with pytest.raises(OSError, match="Invalid argument"):
            sock.accept()
        assert not sock.is_readable
        assert not sock.is_writable


def test_only_tcp_streams_exist() -> None:
    with pytest.raises(OSError, match="only TCP streams"):
        TabSocket(socket.AF_INET, socket.SOCK_DGRAM)
    with pytest.raises(OSError, match="only TCP streams"):
        TabSocket(fileno=3)


@pytest.mark.parametrize("host", ["localhost", b"127.0.0.1", None, "", socket.gethostname()])
def test_names_of_this_machine_are_the_tab(host: str | bytes | None) -> None:
    assert getaddrinfo(host, 80) == [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (HERE, 80))]


def test_other_machines_cannot_be_reached() -> None:
    with pytest.raises(socket.gaierror, match=r"reaches only its own nodes, not \[robot\]"):
        getaddrinfo("robot", 80)
    with pytest.raises(socket.gaierror, match="only IPv4"):
        getaddrinfo("localhost", 80, socket.AF_INET6)


def test_a_selector_reports_what_is_ready(network: Network, pair: Pair) -> None:
    first, second = pair
    selector = TabSelector()
    selector.register(first, selectors.EVENT_READ)
    selector.register(second, selectors.EVENT_READ | selectors.EVENT_WRITE)
    assert [(key.fileobj, events) for key, events in selector.select(0)] == [(second, selectors.EVENT_WRITE)]
    second.send(b"x")
    selector.unregister(second)
    assert [(key.fileobj, events) for key, events in selector.select(1)] == [(first, selectors.EVENT_READ)]
    first.recv(1)
    assert selector.select(0.01) == []


def test_a_poll_reports_what_is_ready(network: Network, pair: Pair) -> None:
    first, second = pair
    poll = TabPoll()
    poll.register(first, select.POLLIN)
    assert poll.poll(0) == []
    second.send(b"x")
    assert poll.poll(1000) == [(first.fileno(), select.POLLIN)]
    number = first.fileno()
    first.close()
    assert poll.poll(0) == [(number, select.POLLNVAL)]


def test_select_reports_what_is_ready(network: Network, pair: Pair) -> None:
    first, second = pair
    assert wait_for_any([first], [second], [], 0.01) == ([], [second], [])
    second.send(b"x")
    assert wait_for_any([first], [], [], 1) == ([first], [], [])


@pytest.mark.parametrize("keyboard", [0, SimpleNamespace(fileno=lambda: 0)], ids=["number", "sys.stdin"])
def test_keys_are_read_one_by_one(network: Network, keyboard: Any) -> None:
    poll, selector = TabPoll(), TabSelector()
    poll.register(keyboard, select.POLLIN)
    selector.register(keyboard, selectors.EVENT_READ)
    for keys, ready in ((b"", []), (b"\033[A", [keyboard])):
        network.keys += keys
        assert wait_for_any([keyboard], [], [], 0.01) == (ready, [], [])
        assert [key.fileobj for key, _ in selector.select(0)] == ready
        assert poll.poll(0) == [(0, select.POLLIN) for _ in ready]
    assert [read(0, 1), read(0, 8)] == [b"\033", b"[A"]


def test_http_clients_read_a_file_of_the_socket(pair: Pair) -> None:
    first, second = pair
    first.sendall(b"status\nbody")
    first.close()
    with second.makefile("rb") as file:
        assert [file.readline(), file.read()] == [b"status\n", b"body"]


def test_installing_replaces_pythons_sockets(monkeypatch: pytest.MonkeyPatch, network: Network) -> None:
    for module, name in (
        *((socket, name) for name in ("socket", "SocketType", "socketpair", "getaddrinfo")),
        *((select, name) for name in ("select", "poll")),
        (selectors, "DefaultSelector"),
        (os, "read"),
    ):
        monkeypatch.setattr(module, name, getattr(module, name))
    monkeypatch.delattr(socket, "SO_REUSEADDR")
    sockets.install(network, network.wait)
    assert socket.socket is TabSocket
    assert selectors.DefaultSelector is TabSelector
    assert socket.SO_REUSEADDR == 2
