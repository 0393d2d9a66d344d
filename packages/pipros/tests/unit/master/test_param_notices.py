"""Which nodes are notified of a parameter change, and with which key and value."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.master.api import param_notices
from pipros.master.registry import MASTER_ID, Notice, Registry

A, B = "http://a:1/", "http://b:2/"


@pytest.mark.parametrize(
    ("subscribed", "key", "value", "heard"),
    [
        ("/w", "/w", 7, ("/w/", 7)),
        ("/w", "/w/g/k", 1, ("/w/g/k/", 1)),
        ("/", "/w", 7, ("/w/", 7)),
        ("/w/g", "/w", {"g": 5}, ("/w/g/", 5)),
        ("/w/g/k", "/w", {"g": {"k": [1]}}, ("/w/g/k/", [1])),
        ("/w/g", "/w", {}, ("/w/g/", {})),
        ("/w/g", "/w", 7, ("/w/g/", {})),
        ("/w", "/", {"w": 1}, ("/w/", 1)),
        ("/", "/", {"w": 1}, ("/", {"w": 1})),
        ("/a", "/ab", 1, None),
        ("/ab", "/a", {"b": 1}, None),
    ],
)
def test_subscribers_above_get_the_change_and_those_below_their_part(
    subscribed: str, key: str, value: Any, heard: tuple[str, Any] | None
) -> None:
    registry = Registry()
    registry.subscribe_param("/a", subscribed, A)
    expected = [] if heard is None else [Notice("/a", A, "paramUpdate", (MASTER_ID, *heard))]
    assert list(param_notices(registry, key, value, except_node="/x")) == expected


def test_the_node_that_changes_a_parameter_is_not_notified() -> None:
    registry = Registry()
    registry.subscribe_param("/a", "/w", A)
    registry.subscribe_param("/b", "/w", B)
    assert list(param_notices(registry, "/w/k", 1, except_node="/a")) == [
        Notice("/b", B, "paramUpdate", (MASTER_ID, "/w/k/", 1))
    ]


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
