"""The start of a node: its name, its options, its imports."""

import asyncio
import errno
import os
import re
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import InvalidName
from pipros.node import node
from pipros.node.identity import Identity
from pipros.node.start_params import is_on, set_private_params, window_limits
from pipros.node.topic_statistics import WindowLimits
from pipros.safe.yaml import YamlError


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
        "/talk", "/talk", "/chat", "/ns/fast", "/ns/x", "/ns/talker/x", "/ns/",
    ]  # fmt: skip


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


# Start options of a started_with, read from its parameters.


class Params(dict[str, Any]):
    def get(self, key: str, *_: Any) -> Any:
        return self[key]

    def set(self, key: str, value: Any) -> None:
        self[key] = value


def started_with(values: dict[str, Any], **private: str) -> Any:
    identity = SimpleNamespace(arguments=SimpleNamespace(params=private))
    return SimpleNamespace(params=Params(values), identity=identity)


@pytest.mark.parametrize(("value", "expected"), [(True, True), (False, False), (1, False), ("true", False)])
def test_a_switch_is_on_only_when_it_is_true(value: object, expected: bool) -> None:
    assert is_on(started_with({"/use_sim_time": value}), "/use_sim_time") is expected


def test_a_switch_that_is_not_set_is_off() -> None:
    assert not is_on(started_with({}), "/use_sim_time")


def test_private_parameters_are_read_as_yaml() -> None:
    started = started_with({}, rate="10", names="[a, b]")

    set_private_params(started)

    assert started.params == {"~rate": 10, "~names": ["a", "b"]}


def test_a_private_parameter_that_is_not_yaml_is_refused() -> None:
    with pytest.raises(YamlError):
        set_private_params(started_with({}, rate="[1"))


def test_windows_have_defaults_for_missing_and_invalid_parameters() -> None:
    given = {"/statistics_window_max_size": 8, "/statistics_window_min_size": -1}
    given |= {"/statistics_window_min_elements": "many"}  # type: ignore[dict-item]

    assert window_limits(started_with(given)) == WindowLimits(max_size_s=8)


# A started node imports what links need, if it can.


def test_a_node_without_descriptors_imports_it_with_the_first_link(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> bool:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(node, "shares_memory", fail)
    asyncio.run(node._load_links())
