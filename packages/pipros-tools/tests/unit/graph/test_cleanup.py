"""Unregistering nodes that do not respond: the question to the user, and the removed registrations."""

from __future__ import annotations

import pytest

from pipros.basics.errors import Unreachable
from pipros_tools.graph.cleanup import WARNING, clean_up
from tests.support.table_master import TableMaster

ANSWERS = {
    ("getSystemState",): [[["/t", ["/good", "/bad"]]], [], []],
    ("lookupNode", "/good"): "http://good:1/",
    ("lookupNode", "/bad"): "http://bad:1/",
}


class Run:
    def __init__(self, *answers: str, dead: str = "bad") -> None:
        self.lines: list[str] = []
        self.removed: list[str] = []

        def ask(api: str, _caller_id: str) -> object:
            if dead in api:
                raise Unreachable(api, "no response in time")
            return 1

        clean_up(
            TableMaster(ANSWERS),
            say=self.lines.append,
            complain=lambda _: None,
            answers=answers,
            ask=ask,
            remove=lambda _, node: self.removed.append(node),
        )


def test_after_a_y_the_silent_nodes_are_removed() -> None:
    run = Run("y\n")

    assert run.removed == ["/bad"]
    assert run.lines == [
        "Unable to contact the following nodes:\n * /bad", WARNING, "Unregistering /bad", "done",
    ]  # fmt: skip


def test_invalid_answers_are_asked_again() -> None:
    assert Run("yes\n", "\n", "y\n").removed == ["/bad"]


@pytest.mark.parametrize("answers", [("n\n",), ("maybe\n", "n\n"), ()])
def test_no_and_the_end_of_input_remove_nothing(answers: tuple[str, ...]) -> None:
    run = Run(*answers)

    assert (run.removed, run.lines[-1]) == ([], "aborting")


def test_without_dead_nodes_there_is_no_question() -> None:
    run = Run(dead="nobody")

    assert run.lines == []
