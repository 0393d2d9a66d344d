"""The messages of a dynamic_reconfigure server, and requests for changes."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from pipros_libraries.reconfigure.config import (
    BadValue,
    change_fields,
    constants,
    decode_description,
    get_tree,
)

PARAMETER: dict[str, Any] = {"min": "", "max": "", "default": "", "level": 0, "description": ""}
ENUM = (
    "{'enum': [{'name': 'Small', 'type': 'int', 'value': 1}, {'name': 'Large', 'type': 'int', 'value': 2}]}"
)
DESCRIPTION = {
    "name": "Default", "id": 0, "parent": 0,
    "parameters": [
        PARAMETER | {"name": "gain", "type": "double", "edit_method": ""},
        PARAMETER | {"name": "size", "type": "int", "edit_method": ENUM},
    ],
    "groups": {
        "Inner": {
            "name": "Inner", "id": 1, "parent": 0,
            "parameters": [PARAMETER | {"name": "on", "type": "bool", "edit_method": ""}], "groups": {},
        }
    },
}  # fmt: skip


def group(number: int, parent: int) -> Any:
    return SimpleNamespace(id=number, parent=parent, name=f"g{number}", type="", parameters=[])


def test_changes_are_requested_by_type() -> None:
    fields = change_fields(DESCRIPTION, {"gain": 3, "size": "large", "on": "yes"}, {"Inner": False})
    assert fields == {
        "bools": [{"name": "on", "value": True}], "ints": [{"name": "size", "value": 2}], "strs": [],
        "doubles": [{"name": "gain", "value": 3.0}],
        "groups": [{"name": "Inner", "state": False, "id": 1, "parent": 0}],
    }  # fmt: skip


@pytest.mark.parametrize(("changes", "states", "words"), [
    ({"nothing": 1}, {}, "don't know parameter: nothing"),
    ({"gain": "much"}, {}, "can't set parameter 'gain'"),
    ({"size": float("inf")}, {}, "can't set parameter 'size'"),
    ({}, {"Nowhere": True}, "don't know group: Nowhere"),
])  # fmt: skip
def test_impossible_changes_are_reported(changes: Any, states: Any, words: str) -> None:
    with pytest.raises(BadValue, match=words):
        change_fields(DESCRIPTION, changes, states)


def test_groups_that_a_peer_wrote_in_a_circle_end() -> None:
    message = SimpleNamespace(groups=[group(0, 0), group(1, 1), group(2, 3), group(3, 2), group(4, 0)])
    assert list(get_tree(message)["groups"]) == ["g4"]
    layers = [group(number, number - 1) for number in range(1, 30) for _ in range(2)]
    tree = get_tree(SimpleNamespace(groups=[group(0, 0), *layers]))
    depth = 0
    while tree["groups"]:
        assert len(tree["groups"]) == 1
        (tree,) = tree["groups"].values()
        depth += 1
    assert depth == 29


def test_groups_are_walked_once_however_many_there_are() -> None:
    walks = []

    class Groups(list[Any]):
        def __iter__(self) -> Iterator[Any]:
            walks.append(self)
            return super().__iter__()

    tree = get_tree(SimpleNamespace(groups=Groups([group(number, 0) for number in range(100)])))
    assert len(tree["groups"]) == 99
    assert len(walks) <= 2


def test_a_description_needs_bounds() -> None:
    nothing = SimpleNamespace(bools=[], ints=[], strs=[], doubles=[])
    root = group(0, 0)
    root.parameters = [SimpleNamespace(name="x", type="int", level=0, description="", edit_method="")]
    with pytest.raises(KeyError, match="x"):
        decode_description(SimpleNamespace(groups=[root], min=nothing, max=nothing, dflt=nothing))


@pytest.mark.parametrize(
    "text", ["", "x", "{", "{'enum': 5}", "{'enum': [1]}", "__import__('os')", "(" * 10_000]
)
def test_an_edit_method_is_only_read(text: str) -> None:
    assert constants(text) == []


def test_a_long_edit_method_is_not_parsed() -> None:
    padded = ENUM + " " * 100_000
    assert (len(constants(ENUM)), constants(padded)) == (2, [])


@pytest.mark.parametrize("constant", [
    {"name": 5, "type": "int", "value": 1}, {"name": "a", "type": "int", "value": "one"},
    {"name": "a", "type": "int", "value": 2**63}, {"name": "a", "type": "int", "value": [1]},
    {"name": "a", "type": ["int"], "value": 1}, {"name": "a", "type": "str", "value": {1, 2}},
])  # fmt: skip
def test_malformed_constants_are_ignored(constant: Any) -> None:
    good = {"name": "b", "type": "str", "value": "x"}
    assert constants(repr({"enum": [constant, good]})) == [good]


def test_constants_can_be_changed_by_the_caller() -> None:
    constants(ENUM)[0]["name"] = "Changed"
    assert constants(ENUM)[0]["name"] == "Small"
