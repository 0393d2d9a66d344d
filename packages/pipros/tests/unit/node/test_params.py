"""The parameter cache of a node: which reads it answers itself, and which are sent to the master."""

import asyncio
import errno
import logging
import os
import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import InvalidName, NotFound, Refused, Unreachable
from pipros.node import node
from pipros.node.identity import Identity
from pipros.node.params import CachedParameter, CacheState, Parameters
from pipros.node.registration import Registrations
from pipros.node.start_params import is_on, set_private_params, window_limits
from pipros.node.topic_statistics import WindowLimits
from pipros.safe.yaml import YamlError

JOINING, OVERTAKEN, CURRENT, STALE = CacheState


class Master:
    """A parameter server in memory, which counts the requests."""

    def __init__(self, **values: Any) -> None:
        self.values = {f"/{name}": value for name, value in values.items()}
        self.asked: list[str] = []
        self.is_away = False
        self.before_answer: Callable[[], object] = lambda: None

    def get_param(self, key: str) -> Any:
        self.asked.append(key)
        if self.is_away:
            raise Unreachable("master", "it is not available")
        if key not in self.values:
            raise Refused("getParam", -1, f"Parameter [{key}] is not set")
        value = self.values[key]
        self.before_answer()
        return value

    def set_param(self, key: str, value: Any) -> None:
        self.values[key] = value

    def delete_param(self, key: str) -> None:
        if self.values.pop(key, None) is None:
            raise Refused("getParam", -1, f"Parameter [{key}] is not set")

    def subscribe_param(self, _api: str, key: str) -> Any:
        if self.is_away:
            raise Unreachable("master", "it is not available")
        value = self.values.get(key, {})
        self.before_answer()
        return value


def parameters(master: Any) -> Parameters:
    log = logging.Logger("test", logging.CRITICAL)
    registrations = Registrations(master, "/node", "http://127.0.0.1:1/", log)
    return Parameters(master, lambda name: name, lambda: registrations)


def test_a_parameter_is_fetched_once_and_then_updated_by_notices() -> None:
    master = Master(speed=1)
    params = parameters(master)
    assert [params.get_cached("/speed") for _ in range(3)] == [1, 1, 1]
    assert params.update("/speed/", 2)
    assert params.get_cached("/speed") == 2
    assert master.asked == []  # the subscription brought the first value


def test_nothing_is_cached_before_the_node_starts() -> None:
    master: Any = Master(speed=1)
    params = Parameters(master, lambda name: name, lambda: None)
    assert (params.get_cached("/speed"), params.get_cached("/speed")) == (1, 1)
    assert master.asked == ["/speed", "/speed"]
    assert not params.update("/speed", 2)


def test_an_unset_parameter_is_fetched_at_each_read() -> None:
    master = Master()
    params = parameters(master)
    for _ in range(2):
        with pytest.raises(NotFound, match="parameter \\[/speed\\] is not set"):
            params.get_cached("/speed")
    params.update("/speed", 3)
    assert params.get_cached("/speed") == 3
    assert len(master.asked) == 2


def test_a_notice_about_a_parameter_below_changes_the_namespace() -> None:
    params = parameters(Master(gains={"p": 1}))
    assert params.get_cached("/gains") == {"p": 1}
    params.update("/gains/d/limit", 5)
    assert params.get_cached("/gains") == {"p": 1, "d": {"limit": 5}}


def test_a_deletion_below_a_namespace_refetches_it() -> None:
    master = Master(gains={"p": 1, "d": 2})
    params = parameters(master)
    params.get_cached("/gains")
    master.values["/gains"] = {"p": 1}
    params.update("/gains/d", {})
    assert (params.get_cached("/gains"), params.get_cached("/gains")) == ({"p": 1}, {"p": 1})
    assert master.asked == ["/gains"]


def test_an_old_notice_does_not_undo_a_change_by_this_node() -> None:
    master = Master(speed=1)
    params = parameters(master)
    params.get_cached("/speed")
    params.set("/speed", 3)
    params.update("/speed", 2)
    assert params.get_cached("/speed") == 3


@pytest.mark.parametrize("key", ["/gains", "/gains/p", "/"])
def test_a_change_by_this_node_updates_the_entries_at_above_and_below_it(key: str) -> None:
    params = parameters(Master(gains={"p": 1}))
    params.get_cached("/gains")
    assert params.cached_around(key) == ["/gains"]
    assert params.cached_around("/gain") == params.cached_around("/gains2") == []


def test_a_deletion_by_this_node_takes_effect_at_once() -> None:
    params = parameters(Master(speed=1))
    params.get_cached("/speed")
    params.delete("/speed")
    with pytest.raises(NotFound):
        params.get_cached("/speed")
    with pytest.raises(NotFound):
        params.delete("/speed")


def test_a_notification_before_the_first_value_is_not_lost() -> None:
    master = Master(speed=1)
    params = parameters(master)

    def overtake() -> None:
        master.before_answer = lambda: None
        master.values["/speed"] = 2
        params.update("/speed", 2)

    master.before_answer = overtake
    assert (params.get_cached("/speed"), params.get_cached("/speed")) == (2, 2)
    assert master.asked == ["/speed"]


def test_a_notification_during_a_refresh_repeats_it() -> None:
    master = Master(speed=1)
    params = parameters(master)
    params.get_cached("/speed")
    params.invalidate("/speed")

    def overtake() -> None:
        master.before_answer = lambda: None
        master.values["/speed"] = 2
        params.update("/speed", 2)

    master.before_answer = overtake
    assert params.get_cached("/speed") == 1  # the master's response
    assert params.get_cached("/speed") == 2
    assert master.asked == ["/speed", "/speed"]


def test_a_namespace_stays_stale_while_the_master_is_unreachable() -> None:
    master = Master(gains={"p": 1, "d": 2})
    params = parameters(master)
    params.get_cached("/gains")
    params.invalidate("/gains")
    master.is_away = True
    with pytest.raises(Unreachable):
        params.get_cached("/gains")
    master.is_away = False
    master.values["/gains"] = {"p": 3, "d": 2}
    params.update("/gains/p", 3)
    assert params.get_cached("/gains") == {"p": 3, "d": 2}


def test_a_parameter_whose_subscription_failed_is_fetched_at_each_read() -> None:
    master = Master(speed=1)
    master.is_away = True
    params = parameters(master)
    with pytest.raises(Unreachable):
        params.get_cached("/speed")
    master.is_away = False
    assert (params.get_cached("/speed"), params.get_cached("/speed")) == (1, 1)
    assert master.asked == ["/speed"] * 3


class TestStates:
    @pytest.mark.parametrize(("before", "registered", "invalidated", "noticed"), [
        (JOINING, CURRENT, OVERTAKEN, OVERTAKEN), (OVERTAKEN, STALE, OVERTAKEN, OVERTAKEN),
        (CURRENT, CURRENT, STALE, CURRENT), (STALE, STALE, STALE, STALE),
    ])  # fmt: skip
    def test_each_event_leads_to_the_next_state(
        self, before: CacheState, registered: CacheState, invalidated: CacheState, noticed: CacheState
    ) -> None:
        first, second, third = (CachedParameter("/a", before) for _ in range(3))
        first.registered(1)
        second.invalidate()
        third.notice("/a", 2)
        assert (first.state, second.state, third.state, first.value) == (registered, invalidated, noticed, 1)

    @pytest.mark.parametrize("state", [JOINING, OVERTAKEN, CURRENT])
    def test_only_a_stale_value_is_refreshed(self, state: CacheState) -> None:
        cached = CachedParameter("/a", state, 1)
        cached.refreshed(2, cached.changes)
        assert (cached.state, cached.value) == (state, 1)

    def test_a_value_that_becomes_a_namespace_is_replaced(self) -> None:
        cached = CachedParameter("/a", CURRENT, {"b": 1})
        cached.notice("/a/b/c", 2)
        assert cached.value == {"b": {"c": 2}}

    def test_the_root_holds_every_parameter(self) -> None:
        cached = CachedParameter("/", CURRENT, {"a": 1})
        cached.notice("/b/c", 2)
        assert cached.value == {"a": 1, "b": {"c": 2}}


# The start of a node: its name, its options, its imports.


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
    started = started_with({}, name="a", rate="[1")
    with pytest.raises(YamlError):
        set_private_params(started)
    assert started.params == {}
    set_private_params(started, keep_texts=True)
    assert started.params == {"~name": "a", "~rate": "[1"}


def test_windows_have_defaults_for_missing_and_invalid_parameters() -> None:
    given = {"/statistics_window_max_size": 8, "/statistics_window_min_size": -1}
    given |= {"/statistics_window_min_elements": "many"}  # type: ignore[dict-item]

    assert window_limits(started_with(given)) == WindowLimits(max_size_s=8)


def test_a_node_without_descriptors_imports_it_with_the_first_link(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> bool:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(node, "shares_memory", fail)
    asyncio.run(node._load_links())
