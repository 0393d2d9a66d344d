"""Names are looked up, and connections are made, with limits on the time."""

import os
import socket
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.errors import Interrupted
from pipros.net.connect import Connector
from pipros.net.lookup import FAILED_S, FOUND_S, Lookups
from tests.support.waiting import wait_until


class Resolver:
    """A resolver with a table of names; lookups of other names block until the test ends."""

    def __init__(self, **known: str) -> None:
        self.known = known
        self.asked: list[str] = []
        self.end = threading.Event()

    def __call__(self, host: str, _port: None, **_wanted: int) -> list[Any]:
        self.asked.append(host)
        if host == "unknown":
            raise socket.gaierror(socket.EAI_NONAME, "not known")
        if host not in self.known:
            self.end.wait(60)
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (self.known.get(host, "127.0.0.9"), 0))]


@pytest.fixture
def resolver() -> Any:
    resolver = Resolver(robot="127.0.0.2", arm="127.0.0.3")
    yield resolver
    resolver.end.set()
    wait_until(lambda: not any(thread.name == "lookup" for thread in threading.enumerate()))


def addresses(found: list[Any]) -> list[Any]:
    return [where for *_, where in found]


def test_a_name_is_resolved_with_the_requested_port(resolver: Resolver) -> None:
    lookups = Lookups(2, resolve=resolver)

    assert addresses(lookups.find("robot", 80)) == [("127.0.0.2", 80)]
    assert addresses(lookups.find("robot", 81)) == [("127.0.0.2", 81)]
    assert resolver.asked == ["robot"]


@pytest.mark.parametrize("address", ["127.0.0.1", "::1", "fe80::1"])
def test_a_numeric_address_is_not_resolved(resolver: Resolver, address: str) -> None:
    found = Lookups(2, resolve=resolver).find(address, 80, type=socket.SOCK_STREAM)

    assert found == socket.getaddrinfo(address, 80, type=socket.SOCK_STREAM)
    assert resolver.asked == []


@pytest.mark.parametrize("host", ["unknown", "a" * 70 + ".b", "\udcff"])
def test_an_unknown_name_raises(host: str) -> None:
    def resolve(host: str, _port: None, **_wanted: int) -> list[Any]:
        host.encode("idna")
        raise socket.gaierror(socket.EAI_NONAME, "not known")

    with pytest.raises(socket.gaierror):
        Lookups(2, resolve=resolve).find(host, 80)


def test_found_and_unknown_names_are_cached_for_a_while(resolver: Resolver) -> None:
    now = [0.0]
    lookups = Lookups(2, resolve=resolver, now=lambda: now[0])

    def look_up_both() -> None:
        lookups.find("robot", 1)
        with pytest.raises(socket.gaierror, match="not known"):
            lookups.find("unknown", 1)

    look_up_both()
    look_up_both()
    assert resolver.asked == ["robot", "unknown"]
    now[0] = FAILED_S
    look_up_both()
    assert resolver.asked == ["robot", "unknown", "unknown"]
    now[0] = FOUND_S
    look_up_both()
    assert resolver.asked == ["robot", "unknown", "unknown", "robot", "unknown"]


def test_a_lookup_without_an_answer_times_out(resolver: Resolver) -> None:
    lookups = Lookups(1, resolve=resolver)

    with pytest.raises(TimeoutError):
        lookups.find("silent", 1, deadline=time.monotonic() + 0.01)
    with pytest.raises(Interrupted):
        lookups.find("silent", 1, is_cancelled=lambda: True)
    wait_until(lambda: resolver.asked)  # in its thread
    assert resolver.asked == ["silent"]  # a second caller joins the running lookup


def test_concurrent_lookups_are_limited_and_the_next_follow(resolver: Resolver) -> None:
    lookups = Lookups(2, resolve=resolver)
    answers = [lookups.ask(f"silent{number}") for number in range(5)]
    wait_until(lambda: len(resolver.asked) == 2)
    assert addresses(lookups.find("robot", 1)) == [("127.0.0.2", 1)]  # a blocking call does not wait for them

    resolver.end.set()

    assert all(answer.wait(30) for answer in answers)
    assert sorted(resolver.asked) == ["robot", *(f"silent{number}" for number in range(5))]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_a_forked_child_does_not_wait_for_the_lookups_of_its_parent(resolver: Resolver) -> None:
    lookups = Lookups(1, resolve=resolver)
    lookups.ask("late", urgent=True)
    wait_until(lambda: resolver.asked == ["late"])
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        resolver.known["late"] = "127.0.0.4"
        os.write(writing, lookups.find("late", 1)[0][4][0].encode())
        os._exit(0)
    os.close(writing)
    with open(reading, "rb") as answer:
        assert answer.read() == b"127.0.0.4"
    os.waitpid(child, 0)


# Connect


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
