"""The registrations of nodes, and the resulting notifications."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.names import as_namespace
from pipros.master.registry import Notice, Registry, Role

A, B, C = "http://a:1/", "http://b:2/", "http://c:3/"


def update(node: str, api: str, topic: str, publishers: list[str]) -> Notice:
    return Notice(node, api, "publisherUpdate", ("/master", topic, publishers))


@pytest.fixture
def registry() -> Registry:
    return Registry()


def test_a_publisher_that_registers_again_is_announced_again_but_not_twice_in_the_list(registry) -> None:
    registry.register_subscriber("/s", "/t", "*", A)
    registry.register_publisher("/p", "/t", "x/Y", C)
    assert registry.register_publisher("/p", "/t", "x/Y", C) == [update("/s", A, "/t", [C])]
    assert registry.names_of(Role.PUBLISHER, "/t") == ["/p"]


def test_subscribers_are_notified_of_a_publisher_that_leaves(registry: Registry) -> None:
    registry.register_subscriber("/s", "/t", "*", A)
    registry.register_publisher("/p", "/t", "x/Y", B)
    assert registry.unregister(Role.PUBLISHER, "/p", "/t", B) == (True, [update("/s", A, "/t", [])])


def test_a_subscriber_that_leaves_is_no_longer_notified(registry: Registry) -> None:
    registry.register_subscriber("/s", "/t", "*", A)
    assert registry.unregister(Role.SUBSCRIBER, "/s", "/t", A) == (True, [])
    assert registry.register_publisher("/p", "/t", "x/Y", C) == []


def test_a_node_exists_as_long_as_it_has_a_registration(registry: Registry) -> None:
    registry.register_publisher("/n", "/t", "x/Y", A)
    registry.subscribe_param("/n", "/p", A)
    registry.unregister(Role.PUBLISHER, "/n", "/t", A)
    assert registry.api_of("/n") == A
    registry.unregister(Role.PARAM_SUBSCRIBER, "/n", "/p", A)
    assert registry.api_of("/n") is None


def test_a_concrete_type_of_a_publisher_wins_and_of_a_subscriber_only_fills_a_gap(registry: Registry) -> None:
    registry.register_subscriber("/s", "/t", "*", A)
    assert registry.topic_types == {}
    registry.register_publisher("/p", "/t", "*", B)
    assert registry.topic_types == {"/t": "*"}
    registry.register_subscriber("/s", "/t", "x/Sub", A)
    assert registry.topic_types == {"/t": "*"}
    registry.register_publisher("/p", "/t", "x/Pub", B)
    registry.register_publisher("/p", "/t", "*", B)
    assert registry.topic_types == {"/t": "x/Pub"}
    registry.remove_node("/p")
    assert registry.topic_types == {"/t": "x/Pub"}


def test_a_second_node_of_the_same_name_replaces_the_first_and_its_registrations(registry: Registry) -> None:
    registry.register_subscriber("/s", "/t", "*", C)
    registry.register_publisher("/n", "/t", "x/Y", A)
    registry.register_service("/n", "/srv", "rosrpc://a:1", A)
    registry.subscribe_param("/n", "/p", A)
    assert registry.register_publisher("/n", "/u", "x/Y", B) == [
        Notice("/n", A, "shutdown", ("/master", "[/n] Reason: new node registered with same name")),
        update("/s", C, "/t", []),
    ]
    assert (registry.table(Role.PUBLISHER), registry.table(Role.SERVICE)) == ([["/u", ["/n"]]], [])
    assert registry.names_of(Role.PARAM_SUBSCRIBER, "/p") == []


def test_a_replaced_process_cannot_take_its_name_back_before_its_shutdown_notice(registry: Registry) -> None:
    registry.register_service("/other", "/srv", "rosrpc://c:1", C)
    registry.register_publisher("/n", "/t", "x/Y", A)
    shutdown, *_ = registry.register_publisher("/n", "/t", "x/Y", B)
    registry.subscribe_param("/n", "/p", A)
    registry.register_service("/n", "/srv", "rosrpc://a:1", A)
    assert registry.register_subscriber("/n", "/t", "x/Y", A) == []
    assert (registry.api_of("/n"), registry.names_of(Role.SERVICE, "/srv")) == (B, ["/other"])
    assert registry.names_of(Role.PARAM_SUBSCRIBER, "/p") == []

    registry.notice_done(shutdown)
    assert [notice.api for notice in registry.register_publisher("/n", "/t", "x/Y", A)] == [B]
    assert registry.api_of("/n") == A


def test_subscribers_are_notified_of_a_removed_node(registry: Registry) -> None:
    registry.register_subscriber("/s", "/t", "*", A)
    registry.register_publisher("/p", "/t", "x/Y", B)
    registry.register_publisher("/p", "/unheard", "x/Y", B)
    assert registry.remove_node("/p") == [update("/s", A, "/t", [])]
    assert registry.remove_node("/p") == []


KEYS = st.lists(st.sampled_from(["a", "b", "ab", "a0", "a.b"]), max_size=4).map(
    lambda parts: "/" + "/".join(parts)
)


@given(st.lists(st.tuples(KEYS, st.booleans())), KEYS)
def test_the_parameter_keys_around_a_key_are_those_at_above_and_below_it(
    changes: list[tuple[str, bool]], key: str
) -> None:
    registry = Registry()
    subscribed = set()
    for changed, is_wanted in changes:
        if is_wanted:
            registry.subscribe_param("/n", changed, A)
            subscribed.add(changed)
        else:
            registry.unregister(Role.PARAM_SUBSCRIBER, "/n", changed, A)
            subscribed.discard(changed)
    found = registry.param_keys_around(key)
    assert len(found) == len(set(found))
    assert set(found) == {
        other
        for other in subscribed
        if as_namespace(other).startswith(as_namespace(key))
        or as_namespace(key).startswith(as_namespace(other))
    }


class Recorder:
    def __init__(self) -> None:
        self.entries: list[object] = []

    def registered(self, *entry: object) -> None:
        self.entries.append(("+", *entry))

    def unregistered(self, *entry: object) -> None:
        self.entries.append(("-", *entry))

    def type_set(self, *entry: object) -> None:
        self.entries.append(("type", *entry))


def test_the_journal_gets_exactly_the_changes(registry: Registry) -> None:
    registry.journal = journal = Recorder()
    registry.register_publisher("/p", "/t", "x/Y", A)
    registry.register_publisher("/p", "/t", "x/Y", A)
    registry.register_service("/p", "/srv", "rosrpc://a:1", A)
    registry.unregister(Role.PUBLISHER, "/p", "/t", B)
    registry.unregister(Role.PUBLISHER, "/p", "/t", A)
    assert journal.entries == [
        ("+", Role.PUBLISHER, "/p", "/t", A, None), ("type", "/t", "x/Y"),
        ("+", Role.SERVICE, "/p", "/srv", A, "rosrpc://a:1"), ("-", Role.PUBLISHER, "/p", "/t"),
    ]  # fmt: skip
