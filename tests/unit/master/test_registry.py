"""The books of the master: who is where, and who has to be told."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from pipros.master.params import as_namespace
from pipros.master.registry import Notice, Registry, Role, param_updates

A, B, C = "http://a:1/", "http://b:2/", "http://c:3/"


def update(node: str, api: str, topic: str, publishers: list[str]) -> Notice:
    return Notice(node, api, "publisherUpdate", ("/master", topic, publishers))


def test_each_new_publisher_is_announced_to_every_subscriber_with_the_full_list() -> None:
    books = Registry()
    books.register_subscriber("/s1", "/t", "*", A)
    books.register_subscriber("/s2", "/t", "*", B)
    assert books.register_publisher("/p", "/t", "x/Y", C) == [
        update("/s1", A, "/t", [C]),
        update("/s2", B, "/t", [C]),
    ]
    assert books.apis_of(Role.SUBSCRIBER, "/t") == [A, B]


def test_a_publisher_that_registers_again_is_announced_again_but_not_twice_in_the_list() -> None:
    books = Registry()
    books.register_subscriber("/s", "/t", "*", A)
    books.register_publisher("/p", "/t", "x/Y", C)
    assert books.register_publisher("/p", "/t", "x/Y", C) == [update("/s", A, "/t", [C])]
    assert books.names_of(Role.PUBLISHER, "/t") == ["/p"]


def test_a_new_subscriber_tells_nobody() -> None:
    books = Registry()
    books.register_publisher("/p", "/t", "x/Y", C)
    assert books.register_subscriber("/s", "/t", "*", A) == []
    assert books.apis_of(Role.PUBLISHER, "/t") == [C]


def test_a_publisher_that_leaves_makes_the_list_shorter() -> None:
    books = Registry()
    books.register_subscriber("/s", "/t", "*", A)
    books.register_publisher("/p", "/t", "x/Y", B)
    books.register_publisher("/q", "/t", "x/Y", C)
    assert books.unregister(Role.PUBLISHER, "/p", "/t", B) == (True, [update("/s", A, "/t", [C])])
    assert books.unregister(Role.PUBLISHER, "/q", "/t", C) == (True, [update("/s", A, "/t", [])])
    assert books.table(Role.PUBLISHER) == []


def test_a_subscriber_that_leaves_is_told_no_more() -> None:
    books = Registry()
    books.register_subscriber("/s", "/t", "*", A)
    assert books.unregister(Role.SUBSCRIBER, "/s", "/t", A) == (True, [])
    assert books.register_publisher("/p", "/t", "x/Y", C) == []


def test_unregistering_what_is_unknown_or_under_another_api_changes_nothing() -> None:
    books = Registry()
    books.register_publisher("/p", "/t", "x/Y", A)
    for node, topic, api in (("/p", "/t", B), ("/p", "/u", A), ("/q", "/t", A)):
        assert books.unregister(Role.PUBLISHER, node, topic, api) == (False, [])
    assert books.table(Role.PUBLISHER) == [["/t", ["/p"]]]


def test_a_node_exists_as_long_as_it_has_a_registration() -> None:
    books = Registry()
    books.register_publisher("/n", "/t", "x/Y", A)
    books.subscribe_param("/n", "/p", A)
    books.unregister(Role.PUBLISHER, "/n", "/t", A)
    assert books.api_of("/n") == A
    books.unregister(Role.PARAM_SUBSCRIBER, "/n", "/p", A)
    assert books.api_of("/n") is None


def test_a_concrete_type_of_a_publisher_wins_and_of_a_subscriber_only_fills_a_gap() -> None:
    books = Registry()
    books.register_subscriber("/s", "/t", "*", A)
    assert books.topic_types == {}
    books.register_publisher("/p", "/t", "*", B)
    assert books.topic_types == {"/t": "*"}
    books.register_subscriber("/s", "/t", "x/Sub", A)
    assert books.topic_types == {"/t": "*"}
    books.register_publisher("/p", "/t", "x/Pub", B)
    books.register_publisher("/p", "/t", "*", B)
    assert books.topic_types == {"/t": "x/Pub"}
    books.remove_node("/p")
    assert books.topic_types == {"/t": "x/Pub"}


def test_a_service_moves_silently_to_whoever_registers_it_last() -> None:
    books = Registry()
    books.register_service("/a", "/srv", "rosrpc://a:1", A)
    assert books.register_service("/b", "/srv", "rosrpc://b:2", B) == []
    assert books.service_api_of("/srv") == "rosrpc://b:2"
    assert books.api_of("/a") is None
    assert not books.unregister_service("/a", "/srv", "rosrpc://a:1")
    assert books.unregister_service("/b", "/srv", "rosrpc://b:2")
    assert books.service_api_of("/srv") is None
    assert books.table(Role.SERVICE) == []


def test_a_second_node_of_the_same_name_shuts_the_first_down_and_drops_all_it_had() -> None:
    books = Registry()
    books.register_subscriber("/s", "/t", "*", C)
    books.register_publisher("/n", "/t", "x/Y", A)
    books.register_service("/n", "/srv", "rosrpc://a:1", A)
    books.subscribe_param("/n", "/p", A)
    assert books.register_publisher("/n", "/u", "x/Y", B) == [
        Notice("/n", A, "shutdown", ("/master", "[/n] Reason: new node registered with same name")),
        update("/s", C, "/t", []),
    ]
    assert books.table(Role.PUBLISHER) == [["/u", ["/n"]]]
    assert books.table(Role.SERVICE) == []
    assert books.names_of(Role.PARAM_SUBSCRIBER, "/p") == []


def test_a_process_that_was_replaced_cannot_take_its_name_back_before_it_is_told() -> None:
    books = Registry()
    books.register_service("/other", "/srv", "rosrpc://c:1", C)
    books.register_publisher("/n", "/t", "x/Y", A)
    shutdown, *_ = books.register_publisher("/n", "/t", "x/Y", B)
    books.subscribe_param("/n", "/p", A)
    books.register_service("/n", "/srv", "rosrpc://a:1", A)
    assert books.register_subscriber("/n", "/t", "x/Y", A) == []
    assert books.api_of("/n") == B
    assert books.names_of(Role.SERVICE, "/srv") == ["/other"]
    assert books.names_of(Role.PARAM_SUBSCRIBER, "/p") == []

    books.dealt_with(shutdown)
    assert [notice.api for notice in books.register_publisher("/n", "/t", "x/Y", A)] == [B]
    assert books.api_of("/n") == A


def test_a_node_that_is_removed_is_missed_by_its_subscribers() -> None:
    books = Registry()
    books.register_subscriber("/s", "/t", "*", A)
    books.register_publisher("/p", "/t", "x/Y", B)
    books.register_publisher("/p", "/unheard", "x/Y", B)
    assert books.remove_node("/p") == [update("/s", A, "/t", [])]
    assert books.remove_node("/p") == []


def test_whoever_changes_a_parameter_is_not_told_of_it() -> None:
    books = Registry()
    books.subscribe_param("/a", "/w", A)
    books.subscribe_param("/b", "/w", B)
    assert list(param_updates(books, [("/w", "/w/k/", 1)], except_node="/a")) == [
        Notice("/b", B, "paramUpdate", ("/master", "/w/k/", 1))
    ]


def test_what_many_are_told_is_one_value_for_all() -> None:
    books = Registry()
    books.subscribe_param("/a", "/w", A)
    books.subscribe_param("/b", "/w", B)
    first, second = param_updates(books, [("/w", "/w/k/", [1])], except_node="/c")
    assert first.params is second.params


KEYS = st.lists(st.sampled_from(["a", "b", "ab", "a0", "a.b"]), max_size=4).map(
    lambda parts: "/" + "/".join(parts)
)


@given(st.lists(st.tuples(KEYS, st.booleans())), KEYS)
def test_the_parameter_keys_around_a_key_are_those_at_above_and_below_it(
    changes: list[tuple[str, bool]], key: str
) -> None:
    books = Registry()
    subscribed = set()
    for changed, is_wanted in changes:
        if is_wanted:
            books.subscribe_param("/n", changed, A)
            subscribed.add(changed)
        else:
            books.unregister(Role.PARAM_SUBSCRIBER, "/n", changed, A)
            subscribed.discard(changed)
    found = books.param_keys_around(key)
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

    def typed(self, *entry: object) -> None:
        self.entries.append(("type", *entry))


def test_the_journal_hears_of_every_change_and_of_nothing_else() -> None:
    books = Registry()
    books.journal = journal = Recorder()
    books.register_publisher("/p", "/t", "x/Y", A)
    books.register_publisher("/p", "/t", "x/Y", A)
    books.register_service("/p", "/srv", "rosrpc://a:1", A)
    books.unregister(Role.PUBLISHER, "/p", "/t", B)
    books.unregister(Role.PUBLISHER, "/p", "/t", A)
    assert journal.entries == [
        ("+", Role.PUBLISHER, "/p", "/t", A, None),
        ("type", "/t", "x/Y"),
        ("+", Role.SERVICE, "/p", "/srv", A, "rosrpc://a:1"),
        ("-", Role.PUBLISHER, "/p", "/t"),
    ]
