"""Values as JSON for browsers."""

import asyncio
import json
import threading
import tracemalloc
from datetime import datetime, timezone
from enum import IntEnum
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipros_server import json_text as json_module
from pipros_server.json_text import LARGE_CHARACTERS, LARGE_VALUES, is_large, json_bytes, json_text

INF, NAN = float("inf"), float("nan")


@pytest.fixture(params=["orjson", "json"], autouse=True)
def _library(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "json":
        monkeypatch.setattr("pipros_server.json_text.ORJSON", None)


def text(value: Any) -> str:
    return asyncio.run(json_text(value))


def test_small_values_are_short() -> None:
    letter = "ä" if json_module.ORJSON else "\\u00e4"
    assert (
        text({"id": 1, "data": [1, 2.5, "ä", None, True]})
        == f'{{"id":1,"data":[1,2.5,"{letter}",null,true]}}'
    )


class Code(IntEnum):
    FIVE = 5


class Pair(NamedTuple):
    first: int
    second: str


KEYS = st.one_of(st.text(), st.integers(), st.floats(allow_nan=False, allow_infinity=False), st.none())
ODD = [
    2**53 + 1, 2**64 - 1, -(2**63), 2**64, -(2**70), -0.0, 5e-324, 1e16, 1e300, NAN, INF, "\ud800", Code.FIVE,
]  # fmt: skip
ODD += [
    Pair(1, "b"), numpy.float64(0.1), numpy.float64("nan"), numpy.str_("text"), Path("/x"),
    datetime(2026, 1, 2, 3, tzinfo=timezone.utc),
]  # fmt: skip
VALUES = st.recursive(
    st.one_of(
        st.sampled_from(ODD), st.floats(), st.integers(), st.text(st.characters()), st.none(), st.booleans()
    ),
    lambda inner: st.one_of(st.lists(inner), st.tuples(inner, inner), st.dictionaries(KEYS, inner)),
)


@given(value=VALUES)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_both_libraries_give_the_same_values(value: Any) -> None:
    with pytest.MonkeyPatch.context() as without:
        fast = text(value)
        without.setattr("pipros_server.json_text.ORJSON", None)
        slow = text(value)
    read = partial(json.loads, parse_float=lambda digits: repr(float(digits)), parse_constant=pytest.fail)
    assert read(fast) == read(slow)


@pytest.mark.parametrize("padding", [[], [0] * (LARGE_VALUES + 1)])
def test_numbers_that_json_lacks_become_null(padding: list[int]) -> None:
    value = {"rates": [1.0, INF, (-INF, NAN)], "deep": {"a": {"b": NAN}}, INF: 1, "padding": padding}
    decoded = json.loads(text(value), parse_constant=pytest.fail)
    assert decoded == {
        "rates": [1.0, None, [None, None]], "deep": {"a": {"b": None}}, "inf": 1, "padding": padding,
    }  # fmt: skip


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
    assert json.loads(text([Witness(), *range(LARGE_VALUES)])) == ["seen", *range(LARGE_VALUES)]
    assert threads[0] is threading.main_thread()
    assert threads[1] is not threading.main_thread()


def test_a_list_that_contains_itself_raises() -> None:
    value: list[Any] = [INF]
    value.append(value)
    with pytest.raises((RecursionError, ValueError)):
        text(value)


def test_short_bytes_in_a_queue_hold_no_more_memory_than_they_need() -> None:
    if (data := json_bytes({"op": "status"})) is None:  # the standard library returns text
        return
    tracemalloc.start()
    try:
        queued = [json_bytes({"op": "status"}) for _ in range(1000)]
        held_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()

    assert held_bytes < len(queued) * (len(data) + 200)
