"""Queries of nodes that may not answer."""

from __future__ import annotations

import threading

import pytest

from pipros_tools.graph.node_queries import NodeQueries


def test_a_node_that_does_not_answer_delays_only_its_own_key() -> None:
    queries, ended = NodeQueries("test"), threading.Event()
    queries.ask("silent", lambda: ended.wait(60) and "late")
    queries.ask("quick", lambda: "answer")
    while queries.answer("quick") is None:
        queries.wait(0.01)

    assert queries.answer("quick") == "answer"
    assert queries.answer("silent") is None
    assert not queries.wait(0.01)
    ended.set()
    assert queries.wait(60)
    assert queries.answer("silent") == "late"
    queries.close()


def test_answers_are_requested_again_when_they_are_old_and_kept_if_there_is_none() -> None:
    answers = iter(["first", None, "third"])
    queries = NodeQueries("test", retry_s=0.0)
    seen = []
    for _ in range(3):
        queries.ask("key", lambda: next(answers))
        assert queries.wait(60)
        seen.append(queries.answer("key"))
    assert seen == ["first", "first", "third"]
    queries.forget_all_but([].__contains__)
    assert queries.answer("key") is None


def test_recent_answers_are_not_requested_again() -> None:
    queries, asked = NodeQueries("test", retry_s=1000.0), list[int]()
    for number in range(3):
        queries.ask("key", lambda number=number: asked.append(number))
        assert queries.wait(60)
    assert asked == [0]


def test_a_query_that_fails_is_logged_unless_the_queries_are_closed(caplog: pytest.LogCaptureFixture) -> None:
    queries = NodeQueries("test", retry_s=0.0)

    def fail() -> None:
        raise ValueError("broken")

    queries.ask("key", fail)
    assert queries.wait(60)
    queries.close()
    queries.ask("key", fail)
    assert queries.wait(60)

    assert [record.getMessage() for record in caplog.records] == ["a query to a node failed: key"]
    assert queries.answer("key") is None
