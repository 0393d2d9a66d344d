"""The total size of a master's data: counted at each change, and limited."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.master.api import MasterApi
from pipros.master.param_weight import TooManyElements, weigh
from pipros.master.params import NotSet, ParamsFull, ParamTree
from pipros.master.registry import Registry, RegistryFull, Role
from tests.support.constants import Constants, changed

KEYS = st.lists(st.sampled_from(["a", "b", "é"]), max_size=3).map(lambda parts: "/" + "/".join(parts))
VALUES = st.recursive(
    st.one_of(st.integers(0, 9), st.booleans(), st.text(max_size=3), st.floats(allow_nan=False)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.sampled_from(["a", "b"]), inner, max_size=2)
    ),
    max_leaves=6,
)


@given(st.lists(st.tuples(KEYS, st.none() | VALUES), max_size=20))
def test_the_weight_of_all_parameters_is_always_that_of_the_tree(changes: list[tuple[str, Any]]) -> None:
    tree = ParamTree(limit_bytes=1_000_000)
    for key, value in changes:
        try:
            if value is None:
                tree.delete(key)
            elif key != "/" or isinstance(value, dict):
                tree.set(key, value)
        except NotSet:
            continue
        assert tree.held_bytes == weigh(tree.get("/"))


def test_a_parameter_beyond_the_limit_is_refused_and_changes_nothing() -> None:
    tree = ParamTree(limit_bytes=1000)
    tree.set("/a", "x" * 500)
    with pytest.raises(ParamsFull, match=r"/b would bring the parameters to 1162 bytes; the limit is 1000"):
        tree.set("/b", "y" * 500)
    assert tree.get("/") == {"a": "x" * 500}
    tree.set("/a", "x" * 800)  # replacing the other one makes room
    tree.set("/a", 1)
    tree.set("/b", "y" * 500)


def test_parameters_above_the_limit_can_become_fewer() -> None:
    tree = ParamTree({"a": "x" * 2000, "b": "y" * 2000}, limit_bytes=1000)
    tree.set("/a", "x" * 1500)
    tree.delete("/b")
    tree.set("/a", "")
    assert tree.get("/") == {"a": ""}


def test_the_elements_of_a_weighed_value_can_be_limited() -> None:
    assert weigh("x" * 10_000, elements_limit=0) == 10_032
    assert weigh([[1] * 100, {"a": 2}], elements_limit=103) == 3_361
    for value in ([[1] * 100, {"a": 2}], [[1] * 51] * 2, {"a": {"b": [0] * 101}}):
        with pytest.raises(TooManyElements):
            weigh(value, elements_limit=102)


def test_the_response_names_the_limit_that_a_parameter_exceeds() -> None:
    api = MasterApi(
        Registry(), ParamTree(limit_bytes=500), notify=lambda _: None, shutdown=lambda _: True
    )  # fmt: skip
    complaint = "Error: invalid arguments: /a would bring the parameters to 597 bytes; the limit is 500"
    assert api.methods["setParam"]("/me", "/a", "x" * 500) == [-1, complaint, 0]


def held(books: Registry) -> int:
    """Return the weight of the registry, counted again."""
    registrations = sum(
        256 + len(entry.name) + len(entry.api) + len(key)
        for entry in books.nodes.values()
        for names in entry.names.values()
        for key in names
    )
    services = sum(len(books.service_api_of(service) or "") for service in books.keys_of(Role.SERVICE))
    return registrations + services + sum(map(len, books.topic_types.values()))


NODES = st.sampled_from(["/n", "/node"])
APIS = st.sampled_from(["http://a:1/", "http://bb:22/"])
TOPICS = st.sampled_from(["/t", "/topic", "/x"])
TYPES = st.sampled_from(["*", "a/B", "pkg/Type"])


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("register_publisher"), NODES, TOPICS, TYPES, APIS),
            st.tuples(st.just("register_subscriber"), NODES, TOPICS, TYPES, APIS),
            st.tuples(st.just("register_service"), NODES, TOPICS, APIS, APIS),
            st.tuples(st.just("subscribe_param"), NODES, TOPICS, APIS),
            st.tuples(st.just("unregister"), st.sampled_from(Role), NODES, TOPICS, APIS),
            st.tuples(st.just("remove_node"), NODES),
        ),
        max_size=30,
    )
)
@changed(TOPIC_TYPES=1)
def test_the_counted_bytes_of_registrations_are_always_their_size(changes: list[tuple[Any, ...]]) -> None:
    books = Registry()
    for method, *arguments in changes:
        for notice in getattr(books, method)(*arguments) if method != "unregister" else ():
            books.notice_done(notice)
        if method == "unregister" and arguments[0] is not Role.SERVICE:
            books.unregister(*arguments)
        assert books.held_bytes == held(books)
        in_use = {*books.keys_of(Role.PUBLISHER), *books.keys_of(Role.SUBSCRIBER)}
        assert len(books.topic_types.keys() - in_use) <= 1


def test_a_type_that_replaces_another_is_counted_instead_of_it() -> None:
    books = Registry()
    for type_name in ("*", "a/B", "pkg/Type"):
        books.register_publisher("/n", "/t", type_name, "http://a:1/")
        assert books.held_bytes == held(books)


def test_a_registration_beyond_the_limit_is_refused_and_changes_nothing(constants: Constants) -> None:
    constants(REGISTRATIONS_BYTES=600)
    books = Registry()
    books.register_publisher("/n", "/t", "x/Y", "http://a:1/")
    for register in (
        lambda: books.register_publisher("/n", "/t2", "x/Y" * 100, "http://a:1/"),
        lambda: books.register_publisher("/n", "/t", "x/Y" * 200, "http://a:1/"),
        lambda: books.register_subscriber("/n", "/t" * 200, "x/Y", "http://a:1/"),
        lambda: books.register_service("/n", "/s", "rosrpc://" + "a" * 300, "http://a:1/"),
        lambda: books.subscribe_param("/n", "/p" * 200, "http://a:1/"),
        lambda: books.register_publisher("/n", "/t" * 200, "x/Y", "http://elsewhere:1/"),
    ):
        with pytest.raises(
            RegistryFull, match=r"bring the master's registrations .* bytes; the limit is 600"
        ):
            register()
    assert (books.topic_types, books.api_of("/n")) == ({"/t": "x/Y"}, "http://a:1/")
    assert [books.table(role) for role in Role] == [[["/t", ["/n"]]], [], [], []]
    assert books.register_publisher("/n", "/t", "x/Y", "http://a:1/") == []


def test_the_types_that_were_unused_longest_are_discarded(constants: Constants) -> None:
    constants(TOPIC_TYPES=2)
    books = Registry()
    for topic in ("/a", "/b", "/c", "/used"):
        books.register_publisher("/n", topic, "x/Y", "http://a:1/")
    for topic in ("/b", "/a", "/c"):
        books.unregister(Role.PUBLISHER, "/n", topic, "http://a:1/")
    assert list(books.topic_types) == ["/a", "/c", "/used"]
    books.register_subscriber("/m", "/a", "*", "http://b:1/")  # /a is in use again
    books.unregister(Role.PUBLISHER, "/n", "/used", "http://a:1/")
    assert books.topic_types == {"/a": "x/Y", "/c": "x/Y", "/used": "x/Y"}


def test_long_names_leave_room_for_fewer_types(constants: Constants) -> None:
    constants(TOPIC_TYPE_BYTES=100)
    books = Registry()
    for name in ("/" + "a" * 60, "/" + "b" * 60, "/c"):
        books.register_publisher("/n", name, "x/Y", "http://a:1/")
        books.unregister(Role.PUBLISHER, "/n", name, "http://a:1/")
    assert [topic[:2] for topic in books.topic_types] == ["/b", "/c"]
