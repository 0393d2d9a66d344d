"""Settings that clients of dynamic_reconfigure change, on a node without rospy."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until

SETTINGS = (
    Setting("enabled", True, description="Whether it works", level=1),
    Setting("radius", 0.5, 0, 10, level=2),
    Setting("width", 10, 0, level=4),
    Setting("origin", 0.0),
    Setting("footprint", "[]", level=8),
)
Config: Any = load_message_class("dynamic_reconfigure/Config")


def parameter(kind: str, name: str, value: Any) -> Any:
    parameter_class: Any = load_message_class(f"dynamic_reconfigure/{kind}Parameter")
    return parameter_class(name, value)


def test_settings_are_read_clamped_described_and_changed(make_node: MakeNode) -> None:
    node, client = make_node("robot"), make_node("client")
    node.params.set("~costmap", {"enabled": 1, "radius": 50, "width": 2.6, "origin": "left"})
    calls: list[tuple[dict[str, Any], int]] = []
    server = Reconfigurable(
        node, "~costmap", SETTINGS, lambda values, level: calls.append((dict(values), level))
    )
    first = {"enabled": True, "radius": 10.0, "width": 3, "origin": 0.0, "footprint": "[]"}
    assert calls == [(first, 0xFFFFFFFF)]
    assert node.params.get("~costmap") == first

    descriptions: list[Any] = []
    updates: list[Any] = []
    description_class = load_message_class("dynamic_reconfigure/ConfigDescription")
    client.subscribe("/robot/costmap/parameter_descriptions", description_class, descriptions.append)
    client.subscribe("/robot/costmap/parameter_updates", Config, updates.append)
    wait_until(lambda: descriptions and updates, 30, "the latched messages")
    described = descriptions[0]
    assert [each.name for each in described.groups[0].parameters] == list(first)
    assert [each.type for each in described.groups[0].parameters] == [
        "bool",
        "double",
        "int",
        "double",
        "str",
    ]
    assert {each.name: each.value for each in described.max.doubles} == {
        "radius": 10.0,
        "origin": float("inf"),
    }
    assert [(each.name, each.value) for each in described.max.ints] == [("width", 2147483647)]
    assert [(each.name, each.value) for each in described.min.ints] == [("width", 0)]
    assert [(each.name, each.value) for each in described.dflt.strs] == [("footprint", "[]")]

    service_class: Any = load_service_class("dynamic_reconfigure/Reconfigure")
    request = service_class._request_class(
        Config(
            bools=[parameter("Bool", "enabled", False), parameter("Bool", "unknown", True)],
            ints=[parameter("Int", "width", -7), parameter("Int", "radius", 3)],
            doubles=[parameter("Double", "radius", 0.25), parameter("Double", "origin", float("nan"))],
        )
    )
    answer: Any = client.client("/robot/costmap/set_parameters", service_class).call(request)
    assert [(each.name, each.value) for each in answer.config.doubles] == [("radius", 0.25), ("origin", 0.0)]
    assert server.values == {**first, "enabled": False, "radius": 0.25, "width": 0}
    assert calls[1:] == [(server.values, 7)]
    assert node.params.get("~costmap/radius") == 0.25
    wait_until(lambda: any(not update.bools[0].value for update in updates), 30, "the update")


def test_the_result_of_the_function_replaces_the_settings(make_node: MakeNode) -> None:
    node = make_node("robot")
    server = Reconfigurable(node, "~", SETTINGS, lambda values, _: {**values, "radius": 2.0})

    server.update({"radius": 7.0, "footprint": "[[1, 1]]"})

    assert (server.values["radius"], server.values["footprint"]) == (2.0, "[[1, 1]]")
    assert node.params.get("~radius") == 2.0


@pytest.mark.parametrize(
    ("value", "read"),
    [
        (2.5, 3),
        (-1, 0),
        (True, 10),
        ("3", 10),
        (float("nan"), 10),
        (float("inf"), 2**31 - 1),
        (1e300, 2**31 - 1),
    ],
)
def test_numbers_are_read_as_in_roscpp(value: Any, read: int) -> None:
    assert Setting("width", 10, 0).read(value) == read
