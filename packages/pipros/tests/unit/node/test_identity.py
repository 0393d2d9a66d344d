"""The name of a node, from its argument, the command line and the environment."""

from __future__ import annotations

import os
import re

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import InvalidName
from pipros.node.identity import Identity


def identity_of(
    *argv: str, name: str = "talker", anonymous: bool = False, environment: Environment | None = None
) -> Identity:
    return Identity.from_arguments(
        name, anonymous=anonymous, argv=argv, environment=environment or Environment()
    )


def test_a_node_is_in_the_namespace_of_the_environment() -> None:
    identity = identity_of(environment=Environment(namespace="/robot/arm/"))
    assert (identity.name, identity.namespace) == ("/robot/arm/talker", "/robot/arm/")


def test_the_command_line_wins() -> None:
    identity = identity_of(
        "__name:=other", "__ns:=a/b", anonymous=True, environment=Environment(namespace="/robot/")
    )
    assert (identity.name, identity.namespace) == ("/a/b/other", "/a/b/")


def test_an_anonymous_name_is_unique_and_legal() -> None:
    assert re.fullmatch(rf"/talker_{os.getpid()}_\d{{13}}", identity_of(anonymous=True).name)


def test_names_are_resolved_and_remapped() -> None:
    identity = identity_of("chat:=/talk", "~rate:=fast", environment=Environment(namespace="/ns/"))
    assert [identity.resolve(name) for name in ("chat", "/ns/chat", "/chat", "~rate", "x", "~x", "")] == [
        "/talk",
        "/talk",
        "/chat",
        "/ns/fast",
        "/ns/x",
        "/ns/talker/x",
        "/ns/",
    ]


def test_master_and_address_can_be_given() -> None:
    told = Environment(hostname="robot", ip="10.0.0.1")
    assert identity_of("__master:=http://m:1", environment=told).environment.master_uri == "http://m:1"
    by_ip = identity_of("__ip:=10.0.0.2", environment=told).environment
    assert (by_ip.hostname, by_ip.ip) == (None, "10.0.0.2")
    by_name = identity_of("__hostname:=arm", environment=told).environment
    assert (by_name.hostname, by_name.ip) == ("arm", None)


def test_a_name_of_the_command_line_may_have_a_namespace() -> None:
    identity = identity_of("__name:=a/b", environment=Environment(namespace="/ns/"))
    assert (identity.name, identity.namespace) == ("/ns/a/b", "/ns/a/")
    assert identity_of("__name:=/a/b", "__ns:=n").resolve("x") == "/a/x"
    with pytest.raises(InvalidName, match="it must not consist of slashes only"):
        identity_of("__name:=/")


@pytest.mark.parametrize("name", ["", "a/b", "/a"])
def test_a_node_name_has_no_namespace(name: str) -> None:
    with pytest.raises(InvalidName, match="must be a name without a namespace"):
        identity_of(name=name)
