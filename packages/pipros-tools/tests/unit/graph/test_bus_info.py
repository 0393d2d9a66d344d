"""Responses of nodes about their connections, well-formed and malformed."""

from __future__ import annotations

import math
from typing import Any

import pytest

from pipros_tools.graph.bus_info import (
    BusConnection,
    established,
    read_row,
    rows_of,
    sent_counts,
    statistics_of,
)


def test_a_row_is_read_with_and_without_the_values_that_old_clients_omit() -> None:
    row: list[Any] = [1, "/listener", "o", "TCPROS", "/chatter"]
    assert read_row(row) == BusConnection("/listener", "o", "/chatter", id="1")
    assert read_row([*row, 0, "port 7"]) == BusConnection(
        "/listener", "o", "/chatter", id="1", is_established=False, remark="port 7"
    )


@pytest.mark.parametrize(
    "row",
    [None, [], "row", [1, "/x", "o", "TCPROS"], [1, ["/x"], "o", "TCPROS", "/t"], [1, "/x", "o", "", 5]],
)
def test_a_malformed_row_is_not_a_connection(row: object) -> None:
    assert read_row(row) is None
    assert list(established([row, [1, "/x", "o", "TCPROS", "/t"]])) == [BusConnection("/x", "o", "/t", "1")]


def test_connections_that_are_not_established_are_left_out() -> None:
    rows = [[1, "/x", "o", "TCPROS", "/t", state] for state in (False, 0, True, 1)]
    assert (len(list(established(rows))), list(established("rows"))) == (2, [])


@pytest.mark.parametrize("answer", [None, [], [0, "no", []], [1, "", "x"], [1, "", []] * 2])
def test_an_unexpected_response_is_an_error_that_names_the_method(answer: Any) -> None:
    with pytest.raises(ValueError, match=r"getBusInfo must return \[1, text, list\], got"):
        rows_of(answer, "getBusInfo")


def test_malformed_counts_are_ignored() -> None:
    statistics = [[["/t", 0, [[1, 10, 2], [2, "x", 3], None]], None, [], ["/u", 0, None]], 5]
    assert (dict(sent_counts(statistics)), dict(sent_counts([]))) == ({"1": (2, 10)}, {})


@pytest.mark.parametrize("number", [math.inf, -math.inf, math.nan, -1, 2**63, 2.0**70, True])
def test_impossible_counts_are_ignored(number: float) -> None:
    statistics = [[["/t", 0, [[1, 10, number], [2, number, 10], [3, 10, 10]]]]]
    assert [link for link, _ in sent_counts(statistics)] == ["3"]


def test_the_statistics_of_roscpp_are_read() -> None:
    """The response of a roscpp node: without code and text, and with another number for each connection."""
    answer = [[["/rosout", [[0, 194, 190, 1, 0]]], ["/battery_topic", [[1, 7888, 7780, 666, 0]]]], []]
    assert dict(sent_counts(statistics_of(answer))) == {"0": (1, 194), "1": (666, 7888)}


@pytest.mark.parametrize("answer", [[5], [["/t"], 5], 7, [], [1, "", 5], [0, "no", []]])
def test_malformed_statistics_are_an_error(answer: Any) -> None:
    with pytest.raises(ValueError, match="getBusStats must return"):
        statistics_of(answer)
