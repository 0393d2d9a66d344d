"""Questions of clients are answered in turns, by a few threads."""

from __future__ import annotations

import threading

import pytest

from pipros.net.workers import Workers
from pipros_bridges.call_turns import QuestionTurns
from tests.support.waiting import wait_until


def test_a_client_with_one_question_waits_for_one_question_of_each_other_client() -> None:
    turns = QuestionTurns("questions", 1)
    may_begin = threading.Event()
    asked: list[str] = []
    turns.run("greedy", lambda: may_begin.wait(20))
    for number in range(100):
        turns.run("greedy", lambda number=number: asked.append(f"greedy {number}"))
    turns.run("modest", lambda: asked.append("modest"))
    may_begin.set()
    wait_until(lambda: len(asked) == 101)
    assert asked.index("modest") <= 1
    assert [each for each in asked if each != "modest"] == [f"greedy {number}" for number in range(100)]
    turns.close()


def test_the_questions_share_a_few_threads() -> None:
    turns = QuestionTurns("questions", 2)
    together = threading.Barrier(3)
    threads: set[int] = set()

    def meet() -> None:
        threads.add(threading.get_ident())
        together.wait(20)

    for user in range(4):
        turns.run(user, meet)
    together.wait(20)
    together.wait(20)
    assert len(threads) == 2
    turns.close()


def test_questions_of_a_client_that_has_left_are_dropped_and_errors_end_no_thread() -> None:
    turns = QuestionTurns("questions", 1)
    may_begin, is_done = threading.Event(), threading.Event()
    asked: list[str] = []
    turns.run("other", lambda: may_begin.wait(20))
    turns.run("gone", lambda: asked.append("gone"))
    turns.run("other", lambda: 1 / 0)
    turns.run("other", is_done.set)
    turns.forget("gone")
    may_begin.set()
    assert is_done.wait(20)
    assert not asked
    turns.close()


def test_a_question_for_which_no_thread_can_start_is_refused_or_left_to_a_running_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("can't start new thread")

    turns = QuestionTurns("questions", 2)
    asked: list[str] = []
    with monkeypatch.context() as changes:
        changes.setattr(Workers, "run", fail)
        with pytest.raises(RuntimeError, match="start new thread"):
            turns.run("refused", lambda: asked.append("refused"))
    may_begin = threading.Event()
    turns.run("first", lambda: may_begin.wait(20))
    monkeypatch.setattr(Workers, "run", fail)
    turns.run("second", lambda: asked.append("second"))
    may_begin.set()
    wait_until(lambda: asked == ["second"])
    turns.close()
