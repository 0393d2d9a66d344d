"""The parameter tree: values are read as they were set, and subscribers are notified."""

import random
import sys
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import pytest

from pipros.master.api import param_notices
from pipros.master.param_weight import weigh
from pipros.master.params import LEVELS_LIMIT, NotATree, NotSet, ParamTree, TooDeep
from pipros.master.registry import MASTER_ID, Notice, Registry
from pipros.wire.xmlrpc import NESTING_LIMIT, decode_response, encode_response


@pytest.mark.parametrize("key", ["/a/b", "/a/b/", "//a//b"])
def test_doubled_and_trailing_slashes_do_not_matter(key: str) -> None:
    tree = ParamTree()
    tree.set(key, 1)
    assert tree.get("/a/b") == 1
    assert tree.has(key)


@pytest.mark.parametrize("key", ["/nope", "/a/nope", "/a/b/below_a_value", "/x/y"])
def test_missing_parameters_cannot_be_read_or_deleted(key: str) -> None:
    tree = ParamTree({"a": {"b": 1}, "x/y": 2})
    assert not tree.has(key)
    with pytest.raises(NotSet):
        tree.get(key)
    with pytest.raises(NotSet):
        tree.delete(key)


def test_keys_with_a_slash_inside_a_dictionary_are_kept_but_are_not_paths() -> None:
    tree = ParamTree()
    tree.set("/n", {"x/y": 1})
    assert (tree.get("/n"), tree.names()) == ({"x/y": 1}, ["/n/x/y"])


def test_the_root_accepts_only_a_dictionary_and_cannot_be_deleted() -> None:
    tree = ParamTree({"a": 1})
    with pytest.raises(NotATree):
        tree.set("/", 5)
    with pytest.raises(NotSet):
        tree.delete("/")
    tree.set("/", {"b": 2})
    assert tree.get("/") == {"b": 2}


def test_names_are_those_of_values_in_the_order_they_were_set() -> None:
    tree = ParamTree({"a": {"b": 1, "e": {}, "c": {"d": 2}}, "~p": 3, "f": []})
    assert tree.names() == ["/a/b", "/a/c/d", "~p", "/f"]


@pytest.mark.parametrize(("ns", "key", "found"), [
    ("/ns/n", "w", "/ns/n/w"), ("/ns/m", "w", "/ns/w"), ("/other", "w", "/w"), ("/", "w", "/w"),
    ("/ns/", "w/q", "/ns/w/q"), ("/ns/n", "w/anything", "/ns/n/w/anything"), ("/ns/n", "w/", "/ns/n/w/"),
    ("/ns/n", "nope", None), ("/ns/n", "/w/g", "/w/g"), ("/ns/n", "/w/nope", None), ("/ns/n", "/", "/"),
])  # fmt: skip
def test_a_search_goes_upwards_for_the_first_part_of_the_key(ns: str, key: str, found: str | None) -> None:
    assert ParamTree({"w": {"g": 1}, "ns": {"w": {"q": 2}, "n": {"w": 3}}}).search(ns, key) == found


def test_the_time_of_an_upward_search_is_proportional_to_the_depth() -> None:
    far_down = "/ns" + "/x" * 100_000
    assert ParamTree({"ns": {"w": 1}}).search(far_down, "w") == "/ns/w"


def test_a_key_of_too_many_parts_is_refused_so_that_the_tree_fits_in_an_answer() -> None:
    tree = ParamTree()
    tree.set("/a" * LEVELS_LIMIT, 1)
    with pytest.raises(TooDeep):
        tree.set("/a" * (LEVELS_LIMIT + 1), 1)
    value: Any = 1
    for _ in range(NESTING_LIMIT):
        value = [value]
    tree.set("/a" * LEVELS_LIMIT, value)
    assert decode_response(encode_response([1, "", tree.get("/")]))[2] == tree.get("/")


def test_the_replaced_value_can_be_read_before() -> None:
    tree = ParamTree({"robot": {"speed": 5}})
    assert tree.former("/robot/speed") == 5
    assert tree.former("/robot/speed/limit") == 5  # a value along the path
    assert tree.former("/robot") == {"speed": 5}
    assert tree.former("/nothing") is None


def test_a_known_size_is_not_computed_again() -> None:
    tree, value = ParamTree(), "x" * 1000
    empty = tree.held_bytes
    with tree.weights_known({id(value): 7}):
        tree.set("/text", value)
    known = tree.held_bytes - empty
    again = ParamTree()
    again.set("/text", value)
    assert (again.held_bytes - empty) - known == weigh(value) - 7


def copies_of_dictionaries(act: Callable[[], object]) -> int:
    names: list[str] = []

    def note(_frame: object, event: str, argument: Any) -> None:
        if event == "c_call":
            names.append(argument.__name__)

    sys.setprofile(note)
    try:
        act()
    finally:
        sys.setprofile(None)
    return names.count("copy")


def test_setting_and_deleting_many_keys_copies_no_namespace_for_each_of_them() -> None:
    params = ParamTree({"a": {}, "other": {"deep": {"x": 1}}})

    def set_and_delete() -> None:
        for number in range(500):
            params.set(f"/a/k{number}", number)
            params.get("/other/deep")
        for number in range(500):
            params.delete(f"/a/k{number}")

    assert copies_of_dictionaries(set_and_delete) == 2
    assert params.get("/") == {"a": {}, "other": {"deep": {"x": 1}}}
    assert copies_of_dictionaries(lambda: params.set("/a/k", 1)) == 2


@pytest.mark.parametrize("seed", range(20))
def test_values_that_were_passed_or_received_never_change(seed: int) -> None:
    chance = random.Random(seed)  # noqa: S311
    params = ParamTree()
    seen: list[tuple[Any, Any]] = []
    model: dict[str, Any] = {}
    for _ in range(400):
        parts = [chance.choice("ab") for _ in range(chance.randint(1, 4))]
        key = "/".join(["", *parts])
        value = chance.choice([1, {}, {"a": {"b": 2}}, {"b": {"a": {"a": {}}}}])
        value = deepcopy(value)
        kind = chance.choice(["set", "set", "get", "former", "delete"])
        if kind == "set":
            params.set(key, value)
            seen.append((value, deepcopy(value)))
            below = model
            for part in parts[:-1]:
                if type(below.get(part)) is not dict:
                    below[part] = {}
                below = below[part]
            below[parts[-1]] = deepcopy(value)
        elif kind == "former":
            value = params.former(key)
            seen.append((value, deepcopy(value)))
        elif params.has(key):
            value = params.get(key)
            seen.append((value, deepcopy(value)))
            if kind == "delete":
                params.delete(key)
                below = model
                for part in parts[:-1]:
                    below = below[part]
                del below[parts[-1]]
        if chance.random() < 0.1:
            assert params.get("/") == model
    assert all(value == before for value, before in seen)
    assert params.get("/") == model
    assert params.held_bytes == ParamTree(model).held_bytes


# Which nodes are notified of a parameter change, and with which key and value.


A, B = "http://a:1/", "http://b:2/"


@pytest.mark.parametrize(("subscribed", "key", "value", "heard"), [
    ("/w", "/w", 7, ("/w/", 7)), ("/w", "/w/g/k", 1, ("/w/g/k/", 1)), ("/", "/w", 7, ("/w/", 7)),
    ("/w/g", "/w", {"g": 5}, ("/w/g/", 5)), ("/w/g/k", "/w", {"g": {"k": [1]}}, ("/w/g/k/", [1])),
    ("/w/g", "/w", {}, ("/w/g/", {})), ("/w/g", "/w", 7, ("/w/g/", {})), ("/w", "/", {"w": 1}, ("/w/", 1)),
    ("/", "/", {"w": 1}, ("/", {"w": 1})), ("/a", "/ab", 1, None), ("/ab", "/a", {"b": 1}, None),
])  # fmt: skip
def test_subscribers_above_get_the_change_and_those_below_their_part(
    subscribed: str, key: str, value: Any, heard: tuple[str, Any] | None
) -> None:
    registry = Registry()
    registry.subscribe_param("/a", subscribed, A)
    expected = [] if heard is None else [Notice("/a", A, "paramUpdate", (MASTER_ID, *heard))]
    assert list(param_notices(registry, key, value, except_node="/x")) == expected


def test_the_node_that_sets_a_parameter_hears_only_of_those_below_and_that_deletes_one_of_all() -> None:
    registry = Registry()
    for node, key, api in (("/a", "/w", A), ("/b", "/w", B), ("/a", "/w/k/m", A)):
        registry.subscribe_param(node, key, api)
    for except_node, heard in (
        ("/a", [("/b", "/w/k/"), ("/a", "/w/k/m/")]),
        (None, [("/a", "/w/k/"), ("/b", "/w/k/"), ("/a", "/w/k/m/")]),
    ):
        notices = param_notices(registry, "/w/k", {}, except_node=except_node)
        assert [(each.node, each.params[1]) for each in notices] == heard


def test_all_subscribers_of_a_key_get_the_same_value() -> None:
    registry = Registry()
    registry.subscribe_param("/a", "/w", A)
    registry.subscribe_param("/b", "/w", B)
    first, second = param_notices(registry, "/w/k", [1], except_node="/c")
    assert first.params is second.params


def test_a_node_that_moves_is_notified_at_its_new_address() -> None:
    registry = Registry()
    registry.subscribe_param("/a", "/w", A)
    notices = param_notices(registry, "/w", 1, except_node="/c")
    registry.subscribe_param("/a", "/w", B)
    assert [notice.api for notice in notices] == [B]
