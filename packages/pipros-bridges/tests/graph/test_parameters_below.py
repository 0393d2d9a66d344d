"""A whitelist that allows a parameter allows no other parameter, although a dictionary contains it."""

from __future__ import annotations

import json
import re
from functools import partial
from typing import Any

import pytest

from pipros.node import Node
from pipros.node.service_server import HandlerError
from pipros_bridges.foxglove.handler import Rules
from pipros_bridges.rosapi import Allowed, RosApi
from pipros_bridges.rosbridge.globs import Globs
from tests.support.foxglove import connected, serving
from tests.support.nodes import MakeNode

STORED = {"b": 1, "c": {"d": 2}}
CHANGES: list[tuple[str, Any, str]] = [
    ("/a", {"b": 5}, "/a/b"), ("/a", {"c": {"d": 5}}, "/a/c/d"), ("/a", {"new": 5, "c/d": 5}, "/a/new"),
    ("/a", 5, "/a/b"), ("/a", None, "/a/b"), ("/x/y", 5, "/x"),
]  # fmt: skip
"""Changes of allowed parameters, and a parameter that each of them would change, too."""


@pytest.fixture
def node(make_node: MakeNode) -> Node:
    node = make_node("bridge")
    node.params.set("/a", STORED)
    node.params.set("/x", 1)
    return node


@pytest.mark.parametrize(("name", "value", "other"), CHANGES)
def test_rosapi_changes_no_parameter_that_the_globs_do_not_allow(
    node: Node, name: str, value: Any, other: str
) -> None:
    api = RosApi(node, Allowed(params=Globs(["/a", "/x/y", "/free/*"])))
    change = api.delete_param if value is None else partial(api.set_param, value=json.dumps(value))
    with pytest.raises(HandlerError, match=f"the globs do not allow the parameter {other}$"):
        change(name)
    assert (node.params.get("/a"), node.params.get("/x")) == (STORED, 1)
    api.set_param("/free/all", json.dumps({"b": {"c": 2}}))
    api.delete_param("/free/all/b")


def test_rosapi_shows_no_parameter_that_the_globs_do_not_allow(node: Node) -> None:
    def shown(*globs: str) -> Any:
        return json.loads(RosApi(node, Allowed(params=Globs(globs))).get_param("/a", "")["value"])

    assert (shown("/a"), shown("/a", "/a/b")) == ({"c": {}}, {"b": 1, "c": {}})
    assert shown("/a", "/a/*") == shown() == STORED


@pytest.mark.parametrize(("name", "value", "other"), CHANGES)
def test_foxglove_changes_no_parameter_that_the_whitelist_does_not_allow(
    node: Node, name: str, value: Any, other: str
) -> None:
    rules = Rules(parameters=(re.compile("/a|/x/y|/free.*"),), has_control=True)
    with serving(node, rules) as address, connected(address) as client:
        client.send("setParameters", parameters=[{"name": name, "value": value}])
        message = client.next("status", level=2)["message"]
        assert message.endswith(f"the whitelist does not allow the parameter {other}")
        client.send("setParameters", parameters=[{"name": "/free", "value": {"b": 2}}], id="set")
        assert client.next("parameterValues", id="set")
    assert (node.params.get("/a"), node.params.get("/x")) == (STORED, 1)
    assert node.params.get("/free") == {"b": 2}
