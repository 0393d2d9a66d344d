"""Addresses to bind and to advertise."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.net import address
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

MASTER_FAR = "http://robot:11311"


def names_mean(monkeypatch: pytest.MonkeyPatch, resolve: Callable[..., Any]) -> None:
    """Replace name resolution with `resolve`."""
    monkeypatch.setattr(address, "process_lookups", lambda: Lookups(1, resolve=resolve))


@pytest.mark.parametrize(
    ("variables", "bound", "advertised"),
    [
        ({}, LOOPBACK, LOOPBACK),
        ({"ROS_MASTER_URI": "http://127.0.0.1:11311"}, LOOPBACK, LOOPBACK),
        ({"ROS_MASTER_URI": "nonsense"}, LOOPBACK, LOOPBACK),
        ({"ROS_IP": "10.0.0.5"}, ANY, "10.0.0.5"),
        ({"ROS_HOSTNAME": "robot"}, ANY, "robot"),
        ({"ROS_HOSTNAME": "robot", "ROS_IP": "127.0.0.1"}, ANY, "robot"),
        ({"ROS_HOSTNAME": "localhost", "ROS_MASTER_URI": MASTER_FAR}, LOOPBACK, "localhost"),
        ({"ROS_IP": "127.0.1.1"}, "127.0.1.1", "127.0.1.1"),
        ({"ROS_IP": "::1"}, "::1", "::1"),
        ({"ROS_IP": "fd00::7"}, ANY_IPV6, "fd00::7"),
    ],
)
def test_only_loopback_is_bound_until_the_environment_opens_it(
    variables: dict[str, str], bound: str, advertised: str
) -> None:
    environment = Environment.from_os(variables)
    assert bind_host(environment) == bound
    assert advertised_host(environment) == advertised


@pytest.mark.parametrize(
    ("variables", "bound", "advertised"),
    [
        ({}, LOOPBACK_IPV6, "localhost"),
        ({"ROS_MASTER_URI": "http://[::1]:11311"}, LOOPBACK_IPV6, "localhost"),
        ({"ROS_HOSTNAME": "localhost"}, LOOPBACK_IPV6, "localhost"),
        ({"ROS_IP": "127.0.0.1"}, LOOPBACK, "127.0.0.1"),
        ({"ROS_IP": "::1"}, LOOPBACK_IPV6, "::1"),
        ({"ROS_IP": "10.0.0.5"}, ANY_IPV6, "10.0.0.5"),
        ({"ROS_HOSTNAME": "robot"}, ANY_IPV6, "robot"),
        ({"ROS_MASTER_URI": MASTER_FAR}, ANY_IPV6, "laptop"),
    ],
)
def test_ipv6_is_bound_on_demand_with_names_that_genuine_nodes_understand(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], bound: str, advertised: str
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "laptop")
    names_mean(monkeypatch, lambda *_, **__: [(socket.AF_INET6, 1, 6, "", ("::1", 0, 0, 0))])
    environment = Environment.from_os({"ROS_IPV6": "on", **variables})
    assert bind_host(environment) == bound
    assert advertised_host(environment) == advertised


@pytest.mark.parametrize(
    ("variables", "bound", "advertised"),
    [
        ({}, LOOPBACK_IPV6, "::1"),
        ({"ROS_HOSTNAME": "localhost"}, LOOPBACK, "localhost"),
        ({"ROS_IPV6": "yes"}, LOOPBACK, LOOPBACK),
    ],
)
def test_localhost_without_an_ipv6_address_is_not_used_for_ipv6(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], bound: str, advertised: str
) -> None:
    def unknown(*_: object, **__: object) -> Any:
        raise socket.gaierror(socket.EAI_NONAME, "not known")

    names_mean(monkeypatch, unknown)
    environment = Environment.from_os({"ROS_IPV6": "on", **variables})
    assert bind_host(environment) == bound
    assert advertised_host(environment) == advertised


def test_with_a_remote_master_this_machine_advertises_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = Environment(master_uri=MASTER_FAR)
    assert bind_host(environment) == ANY
    monkeypatch.setattr(socket, "gethostname", lambda: "laptop")
    assert advertised_host(environment) == "laptop"


def test_a_machine_without_a_name_advertises_its_address_towards_the_master(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
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
    assert uri("robot", 1) == "http://robot:1/"
    assert uri("fd00::7", 1, "rosrpc") == "rosrpc://[fd00::7]:1"


@pytest.mark.parametrize(
    ("configured", "is_address", "problem"),
    [
        ("", True, "an empty string"),
        ("http://robot", False, "protocol should not be included"),
        ("10.0.0.5:1", True, "port should not be included"),
        ("robot", True, "must be a valid IPv4 or IPv6 address"),
        ("robot:1", False, None),
        ("10.0.0.5", True, None),
        ("fd00::7", True, None),
    ],
)
def test_malformed_addresses_are_explained(configured: str, is_address: bool, problem: str | None) -> None:
    assert problem_of(configured, is_address=is_address) == problem
