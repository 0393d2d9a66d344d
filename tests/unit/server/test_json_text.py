"""Values as JSON for browsers."""

from __future__ import annotations

import asyncio
import json
import threading
from typing import Any

import pytest

from pipros.server.json_text import LARGE_CHARACTERS, LARGE_VALUES, is_large, json_text

INF, NAN = float("inf"), float("nan")


def text(value: Any) -> str:
    return asyncio.run(json_text(value))


def test_small_values_are_short() -> None:
    assert text({"id": 1, "data": [1, 2.5, "ä", None, True]}) == '{"id":1,"data":[1,2.5,"\\u00e4",null,true]}'


@pytest.mark.parametrize("padding", [[], [0] * (LARGE_VALUES + 1)])
def test_numbers_that_json_lacks_become_null(padding: list[int]) -> None:
    value = {"rates": [1.0, INF, (-INF, NAN)], "deep": {"a": {"b": NAN}}, INF: 1, "padding": padding}
    decoded = json.loads(text(value), parse_constant=pytest.fail)
    assert decoded == {
        "rates": [1.0, None, [None, None]],
        "deep": {"a": {"b": None}},
        "inf": 1,
        "padding": padding,
    }


def test_values_unknown_to_json_become_text() -> None:
    assert text([{1}]) == '["{1}"]'


def test_values_beyond_the_limits_are_large() -> None:
    assert not is_large({"a": ["b" * LARGE_CHARACTERS, 1, None]})
    assert not is_large([0] * LARGE_VALUES)
    assert is_large([0] * (LARGE_VALUES + 1))
    assert is_large([[0] * 1000 for _ in range(LARGE_VALUES // 1000)])
    assert is_large({"a": "b" * LARGE_CHARACTERS, "c": "d"})


def test_large_values_are_encoded_in_another_thread() -> None:
    threads = []

    class Witness:
        def __str__(self) -> str:
            threads.append(threading.current_thread())
            return "seen"

    assert text([Witness()]) == '["seen"]'
    large = [Witness(), *range(LARGE_VALUES)]
    assert json.loads(text(large)) == ["seen", *range(LARGE_VALUES)]
    assert threads[0] is threading.main_thread()
    assert threads[1] is not threading.main_thread()


def test_a_list_that_contains_itself_raises() -> None:
    value: list[Any] = [INF]
    value.append(value)
    with pytest.raises((RecursionError, ValueError)):
        text(value)
