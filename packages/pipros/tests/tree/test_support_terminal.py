"""`tests.support.terminal` behaves like a terminal window."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.terminal import Terminal


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    opened = Terminal({"PATH": "/usr/bin:/bin", "TERM": "xterm"}, tmp_path)
    yield opened
    opened.close()


def test_a_command_gives_its_output_and_exit_code(terminal: Terminal) -> None:
    assert terminal.run("echo hello; (exit 3)") == (3, "hello\n")


def test_programs_see_a_terminal(terminal: Terminal) -> None:
    assert terminal.run("test -t 0 && test -t 1 && test -t 2") == (0, "")


def test_ctrl_c_ends_the_command_in_the_foreground_and_not_the_shell(terminal: Terminal) -> None:
    terminal.type("sh -c 'echo waiting; exec cat'")
    terminal.wait_for("waiting\n")

    terminal.press_ctrl_c()

    assert terminal.wait_for_prompt() == 130
    assert terminal.run("echo still here") == (0, "still here\n")


def test_missing_output_is_reported_with_the_screen(terminal: Terminal) -> None:
    terminal.type("echo something else")
    terminal.wait_for("something else\n")

    with pytest.raises(AssertionError, match="something else"):
        terminal.wait_for("hello", timeout_s=0.3)
