"""Recognise the addresses, names and callers of this machine."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from pipros.net import this_machine
from pipros.net.address import ANY
from pipros.net.lookup import Lookups
from pipros.net.this_machine import (
    ThisMachineCaller,
    addresses_of,
    has_address,
    is_this_machine,
    knows_users,
    user_listening,
)
from tests.support.constants import Constants
from tests.support.lacks import system
from tests.support.network import LoneNetwork, needs_network
from tests.support.users import STRANGER, needs_other_users
from tests.support.waiting import wait_until

# The callers that a server sees for connections from its own addresses.
LOOK = """
import socket, sys
from pipros.net.this_machine import ThisMachineCaller, has_address
for host in sys.argv[1:]:
    with socket.create_server(("0.0.0.0", 0)) as server:
        with socket.create_connection((host, server.getsockname()[1])) as client:
            accepted, peer = server.accept()
            caller = ThisMachineCaller.from_names(peer, accepted.getsockname())
            print(host, caller.host, caller.is_here, has_address(host))
            accepted.close()
"""


@contextmanager
def connected(
    listen: str = "127.0.0.1", connect: str = "127.0.0.1"
) -> Iterator[tuple[ThisMachineCaller, socket.socket]]:
    """Yield a caller as seen by a server, and the socket of the caller."""
    family = socket.AF_INET6 if ":" in listen else socket.AF_INET
    with socket.create_server((listen, 0), family=family, dualstack_ipv6=listen == "::") as server:
        client = socket.create_connection((connect, server.getsockname()[1]), 10)
        accepted, peer = server.accept()
        with accepted, closing(client):
            yield ThisMachineCaller.from_names(peer, accepted.getsockname()), client


def test_own_addresses_are_distinguished_from_others() -> None:
    for host in ("127.0.0.1", "127.0.1.1", "::1"):
        assert has_address(host)
    for host in ("192.0.2.1", "198.51.100.7", "2001:db8::5", "nonsense", ""):
        assert not has_address(host)


def test_binding_proves_nothing_if_every_address_can_be_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(this_machine, "_can_bind", lambda *_: True)  # as with net.ipv4.ip_nonlocal_bind=1
    assert not has_address("198.51.100.7")
    assert has_address("127.0.0.1")


@pytest.mark.parametrize(
    ("listen", "connect"), [("127.0.0.1", "127.0.0.1"), (ANY, "127.0.1.1"), ("::", "127.0.0.1")]
)
def test_callers_on_loopback_are_local_and_their_user_is_known(listen: str, connect: str) -> None:
    with connected(listen, connect) as (caller, _):
        assert caller.is_here
        assert knows_users() == (system() == "linux")
        if knows_users():
            assert caller.user_id() == os.geteuid()


def test_callers_by_ipv6_are_local() -> None:
    with connected("::1", "::1") as (caller, _):
        assert caller.is_here
        if knows_users():
            assert caller.user_id() == os.geteuid()


def test_a_caller_from_another_machine_is_not_local() -> None:
    caller = ThisMachineCaller("198.51.100.7", 4711, "10.0.0.1", 11311)
    assert not caller.is_here
    assert caller.user_id() is None


def test_a_closed_connection_has_no_caller() -> None:
    caller = ThisMachineCaller.from_names(None, ("127.0.0.1", 1))
    assert caller == ThisMachineCaller()
    assert not caller.is_here


def test_a_connection_closed_by_the_caller_has_no_owner() -> None:
    with connected() as (caller, client):
        client.close()  # Linux attributes the closed connection to root
        assert caller.user_id() is None


@needs_other_users
@pytest.mark.needs("/proc")
def test_connections_of_another_user_are_attributed_to_that_user() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        program = (
            f"import os, socket, sys; os.setgid({STRANGER}); os.setuid({STRANGER}); "
            f"s = socket.socket(); s.connect(('127.0.0.1', {port})); sys.stdin.read()"
        )
        other = subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE)
        accepted, peer = server.accept()
        with accepted:
            caller = ThisMachineCaller.from_names(peer, accepted.getsockname())
            assert caller.user_id() == STRANGER
            assert caller.is_here
            assert user_listening("127.0.0.1", port) == 0
            assert caller._replace(port=1).user_id() is None
        other.communicate(timeout=60)


def test_a_free_port_has_no_listener() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        if knows_users():
            assert user_listening("127.0.0.1", port) == os.geteuid()
    assert user_listening("127.0.0.1", port) is None


@needs_network
def test_every_address_of_a_machine_with_several_is_its_own(tmp_path: Path) -> None:
    network = LoneNetwork("127.0.0.1 localhost\n", addresses=("10.98.0.1/24", "10.98.0.2/24", "10.98.7.7/32"))
    try:
        program = [sys.executable, "-c", LOOK, "10.98.0.1", "10.98.0.2", "10.98.7.7", "127.0.1.1"]
        ran = subprocess.run(
            network.command(*program), capture_output=True, text=True, check=True, timeout=60
        )
    finally:
        network.close()
    assert ran.stdout.splitlines() == [
        "10.98.0.1 10.98.0.1 True True",
        "10.98.0.2 10.98.0.1 True True",  # from the first address of the interface
        "10.98.7.7 10.98.7.7 True True",
        "127.0.1.1 127.0.0.1 True True",
    ]


def test_names_are_looked_up_as_configured() -> None:
    assert is_this_machine("localhost")
    assert is_this_machine("127.0.0.2")
    assert is_this_machine(socket.gethostname()) == any(map(has_address, addresses_of(socket.gethostname())))
    assert not is_this_machine("192.0.2.1")
    assert not is_this_machine("nowhere.invalid")
    assert addresses_of("127.0.1.1") == ("127.0.1.1",)


def test_a_hung_lookup_is_neither_awaited_nor_repeated(constants: Constants) -> None:
    released, threads = threading.Event(), []

    def hang(*_: object, **__: object) -> list[object]:
        threads.append(threading.current_thread())
        released.wait(30)
        return []

    lookups = Lookups(4, resolve=hang)
    for _ in range(2):
        constants(LOOKUP_S=0.05)
        assert addresses_of("hangs.example", lookups) == ()
    [thread] = wait_until(lambda: threads)
    assert thread.daemon  # the process does not wait for it at its end
    released.set()
