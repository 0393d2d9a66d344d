"""Parameters as Foxglove clients see them."""

import json
from typing import Any
from xmlrpc.client import Binary

import pytest

from pipros_bridges.foxglove.catalog import CatalogChange, Channel, TopicCatalog
from pipros_bridges.foxglove.graph_changes import EMPTY, graph_update
from pipros_bridges.foxglove.parameters import (
    InvalidClientParameter,
    flattened,
    from_client,
    outermost,
    selected,
    to_client,
)
from pipros_tools.graph.definitions import Definition, ServiceDefinition
from pipros_tools.graph.system_state import SystemState

TREE = {"a": 1, "robot": {"speed": 1.0, "names": ["x"], "deep": {"y": True}}}


def test_each_value_has_its_full_name() -> None:
    assert flattened(TREE) == {"/a": 1, "/robot/speed": 1.0, "/robot/names": ["x"], "/robot/deep/y": True}
    assert flattened(3) == {}


def test_a_name_selects_a_parameter_or_a_namespace_as_a_dictionary() -> None:
    found = flattened(TREE)
    robot = TREE["robot"]
    assert selected(found, ["/a"]) == {"/a": 1}
    assert selected(found, ["/robot"]) == {"/robot": robot}
    assert (selected(found, ["/rob"]), selected(found, ["/"])) == ({}, {"/": TREE})
    assert selected(found, ["/robot", "/robot/deep", "/robot/deep/y", "/robot"]) == {
        "/robot": robot, "/robot/deep/y": True
    }  # fmt: skip
    assert selected(found, ["/robot/deep", "/a", "/robot/speed"]) == {
        "/a": 1, "/robot/deep": {"y": True}, "/robot/speed": 1.0
    }  # fmt: skip


def test_names_below_other_names_are_not_needed() -> None:
    assert outermost(["/robot/deep/y", "/a", "/robot", "/robot-b", "/robot/deep", "/a"]) == (
        "/a", "/robot-b", "/robot"
    )  # fmt: skip
    assert (outermost(["/a", "/", "/a/b"]), outermost([]), flattened(1, "/a")) == (("/",), (), {"/a": 1})
    assert flattened({"y": True}, "/robot/deep") == {"/robot/deep/y": True}


class CountedNames(dict[str, Any]):
    """Parameters that count how often they are looked up."""

    lookups = 0

    def __getitem__(self, name: str) -> Any:
        self.lookups += 1
        return super().__getitem__(name)


def test_each_parameter_is_read_once_however_many_names_select_it() -> None:
    found = CountedNames((f"/a/b/c{number}", number) for number in range(5000))
    names = ["/", "/a", "/a/b", "/none", *(f"/none{number}" for number in range(2000))] * 3
    assert selected(found, names)["/"]["a"]["b"]["c4999"] == 4999
    assert found.lookups == 5000


@pytest.mark.parametrize(("value", "row"), [
    (1, {"value": 1}), (True, {"value": True}), ("x", {"value": "x"}),
    (1.0, {"value": 1.0, "type": "float64"}),
    ([1.0, 2.0], {"value": [1.0, 2.0], "type": "float64_array"}), ([1, 2.0], {"value": [1, 2.0]}),
    ([], {"value": []}), (Binary(b"\0\1"), {"value": "AAE=", "type": "byte_array"}),
])  # fmt: skip
def test_values_keep_their_type_both_ways(value: Any, row: dict[str, Any]) -> None:
    sent = to_client("/x", value)
    assert sent == {"name": "/x", **row}
    back = from_client(sent)
    assert back == value
    assert type(back) is type(value)


@pytest.mark.parametrize(("value", "kind"), [
    ("no base64!", "byte_array"), (5, "byte_array"), ("x", "float64"), (True, "float64"),
    (10**400, "float64"), (1, "float64_array"), ([None], "float64_array"), (1, "color"), (1, ["float64"]),
])  # fmt: skip
def test_values_of_another_type_are_refused(value: object, kind: object) -> None:
    with pytest.raises(InvalidClientParameter, match="/x"):
        from_client({"name": "/x", "value": value, "type": kind})


def test_whole_numbers_become_floats_by_their_type() -> None:
    assert repr(from_client({"name": "/x", "value": 3, "type": "float64"})) == "3.0"


# Ids of channels and services as the graph changes, and updates of the connection graph.


TEXT = Definition("std_msgs/String", "a" * 32, "string data")
NUMBER = Definition("std_msgs/Int32", "b" * 32, "int32 data")
TRIGGER = ServiceDefinition("std_srvs/Trigger", "c" * 32, "", "")


def test_only_changes_are_announced() -> None:
    catalog = TopicCatalog()
    assert catalog.update_channels({"/a": TEXT}) == CatalogChange([Channel(1, "/a", TEXT)], [])
    assert catalog.update_channels({"/a": TEXT}) == CatalogChange([], [])
    assert catalog.update_channels({"/a": TEXT, "/b": TEXT}) == CatalogChange([Channel(2, "/b", TEXT)], [])
    assert catalog.update_channels({"/b": TEXT}) == CatalogChange([], [1])


def test_another_definition_is_another_channel() -> None:
    catalog = TopicCatalog()
    catalog.update_channels({"/a": TEXT})
    assert catalog.update_channels({"/a": NUMBER}) == CatalogChange([Channel(2, "/a", NUMBER)], [1])
    assert list(catalog.channels) == [2]


def test_ids_are_never_used_again() -> None:
    catalog = TopicCatalog()
    for number in range(1, 4):
        assert catalog.update_channels({"/a": TEXT}).added[0].id == 2 * number - 1
        assert catalog.update_services({"/s": TRIGGER}).added[0].id == 2 * number
        catalog.update_channels({})
        assert catalog.update_services({}).removed == [2 * number]


def update(before: SystemState, after: SystemState) -> Any:
    frame = graph_update(before, after)
    return frame and json.loads(frame.parts[0])


def test_the_first_update_of_the_graph_is_complete() -> None:
    state = SystemState({"/a": ["/p", "/o"]}, {"/b": ["/q"]}, {"/s": ["/p"]})
    assert update(EMPTY, state) == {
        "op": "connectionGraphUpdate", "publishedTopics": [{"name": "/a", "publisherIds": ["/o", "/p"]}],
        "subscribedTopics": [{"name": "/b", "subscriberIds": ["/q"]}],
        "advertisedServices": [{"name": "/s", "providerIds": ["/p"]}], "removedTopics": [],
        "removedServices": [],
    }  # fmt: skip


def test_later_updates_have_what_changed() -> None:
    before = SystemState({"/a": ["/p"], "/b": ["/p"], "/c": ["/p"]}, {"/c": ["/q"]}, {"/s": ["/p"]})
    after = SystemState({"/a": ["/p"], "/b": ["/p", "/o"]}, {"/c": ["/q"]}, {})
    assert update(before, after) == {
        "op": "connectionGraphUpdate",
        "publishedTopics": [{"name": "/b", "publisherIds": ["/o", "/p"]}, {"name": "/c", "publisherIds": []}],
        "subscribedTopics": [], "advertisedServices": [], "removedTopics": [], "removedServices": ["/s"],
    }  # fmt: skip
    assert update(after, EMPTY)["removedTopics"] == ["/a", "/b", "/c"]
    assert update(after, after) is None
