"""Ids of channels and services as the graph changes, and updates of the connection graph."""

from __future__ import annotations

import json
from typing import Any

from pipros_bridges.foxglove.catalog import CatalogChange, Channel, TopicCatalog
from pipros_bridges.foxglove.graph_changes import EMPTY, graph_update
from pipros_tools.graph.definitions import Definition, ServiceDefinition
from pipros_tools.graph.system_state import SystemState

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
        "op": "connectionGraphUpdate",
        "publishedTopics": [{"name": "/a", "publisherIds": ["/o", "/p"]}],
        "subscribedTopics": [{"name": "/b", "subscriberIds": ["/q"]}],
        "advertisedServices": [{"name": "/s", "providerIds": ["/p"]}],
        "removedTopics": [],
        "removedServices": [],
    }


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
