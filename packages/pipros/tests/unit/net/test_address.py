"""Addresses to bind and to advertise."""

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.net import address, this_machine
from pipros.net.address import (
    ANY,
    ANY_IPV6,
    LOOPBACK,
    LOOPBACK_IPV6,
    advertised_host,
    bind_host,
    is_loopback,
    problem_of,
    uri,
)
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

MASTER_FAR = "http://robot:11311"


def names_mean(monkeypatch: pytest.MonkeyPatch, resolve: Callable[..., Any]) -> None:
    """Replace name resolution with `resolve`."""
    monkeypatch.setattr(address, "process_lookups", lambda: Lookups(1, resolve=resolve))


@pytest.mark.parametrize(("variables", "bound", "advertised"), [
    ({}, LOOPBACK, LOOPBACK), ({"ROS_MASTER_URI": "http://127.0.0.1:11311"}, LOOPBACK, LOOPBACK),
    ({"ROS_MASTER_URI": "nonsense"}, LOOPBACK, LOOPBACK), ({"ROS_IP": "10.0.0.5"}, ANY, "10.0.0.5"),
    ({"ROS_HOSTNAME": "robot"}, ANY, "robot"),
    ({"ROS_HOSTNAME": "robot", "ROS_IP": "127.0.0.1"}, ANY, "robot"),
    ({"ROS_HOSTNAME": "localhost", "ROS_MASTER_URI": MASTER_FAR}, LOOPBACK, "localhost"),
    ({"ROS_IP": "127.0.1.1"}, "127.0.1.1", "127.0.1.1"), ({"ROS_IP": "::1"}, "::1", "::1"),
    ({"ROS_IP": "fd00::7"}, ANY_IPV6, "fd00::7"),
])  # fmt: skip
def test_only_loopback_is_bound_until_the_environment_opens_it(
    variables: dict[str, str], bound: str, advertised: str
) -> None:
    environment = Environment.from_os(variables)
    assert (bind_host(environment), advertised_host(environment)) == (bound, advertised)


@pytest.mark.parametrize(("variables", "bound", "advertised"), [
    ({}, LOOPBACK_IPV6, "localhost"), ({"ROS_MASTER_URI": "http://[::1]:11311"}, LOOPBACK_IPV6, "localhost"),
    ({"ROS_HOSTNAME": "localhost"}, LOOPBACK_IPV6, "localhost"),
    ({"ROS_IP": "127.0.0.1"}, LOOPBACK, "127.0.0.1"), ({"ROS_IP": "::1"}, LOOPBACK_IPV6, "::1"),
    ({"ROS_IP": "10.0.0.5"}, ANY_IPV6, "10.0.0.5"), ({"ROS_HOSTNAME": "robot"}, ANY_IPV6, "robot"),
    ({"ROS_MASTER_URI": MASTER_FAR}, ANY_IPV6, "laptop"),
])  # fmt: skip
def test_ipv6_is_bound_on_demand_with_names_that_genuine_nodes_understand(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], bound: str, advertised: str
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "laptop")
    names_mean(monkeypatch, lambda *_, **__: [(socket.AF_INET6, 1, 6, "", ("::1", 0, 0, 0))])
    environment = Environment.from_os({"ROS_IPV6": "on", **variables})
    assert (bind_host(environment), advertised_host(environment)) == (bound, advertised)


@pytest.mark.parametrize(("variables", "bound", "advertised"), [
    ({}, LOOPBACK_IPV6, "::1"), ({"ROS_HOSTNAME": "localhost"}, LOOPBACK, "localhost"),
    ({"ROS_IPV6": "yes"}, LOOPBACK, LOOPBACK),
])  # fmt: skip
def test_localhost_without_an_ipv6_address_is_not_used_for_ipv6(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], bound: str, advertised: str
) -> None:
    def unknown(*_: object, **__: object) -> Any:
        raise socket.gaierror(socket.EAI_NONAME, "not known")

    names_mean(monkeypatch, unknown)
    environment = Environment.from_os({"ROS_IPV6": "on", **variables})
    assert (bind_host(environment), advertised_host(environment)) == (bound, advertised)


def test_with_a_remote_master_this_machine_advertises_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = Environment(master_uri=MASTER_FAR)
    assert bind_host(environment) == ANY
    monkeypatch.setattr(socket, "gethostname", lambda: "laptop")
    assert advertised_host(environment) == "laptop"


def test_a_machine_without_a_name_advertises_its_address_towards_the_master(monkeypatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "localhost")
    assert advertised_host(Environment(master_uri="http://no.such.host.invalid:1")) == LOOPBACK


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST", "127.0.0.1", "127.9.9.9", "::1", "[::1]", "a.localhost"]
)
def test_loopback_is_recognised_by_its_spelling(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize(
    "host", ["", "robot", "10.0.0.1", "128.0.0.1", "127.0.0", "127.evil.example.com", "::2"]
)
def test_other_hosts_are_not_loopback(host: str) -> None:
    assert not is_loopback(host)


def test_uris_are_written_as_ros_writes_them() -> None:
    assert (uri("robot", 1), uri("fd00::7", 1, "rosrpc")) == ("http://robot:1/", "rosrpc://[fd00::7]:1")


@pytest.mark.parametrize(("configured", "is_address", "problem"), [
    ("", True, "an empty string"), ("http://robot", False, "protocol should not be included"),
    ("10.0.0.5:1", True, "port should not be included"),
    ("robot", True, "must be a valid IPv4 or IPv6 address"), ("robot:1", False, None),
    ("10.0.0.5", True, None), ("fd00::7", True, None),
])  # fmt: skip
def test_malformed_addresses_are_explained(configured: str, is_address: bool, problem: str | None) -> None:
    assert problem_of(configured, is_address=is_address) == problem


# Recognise the addresses, names and callers of this machine.


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
