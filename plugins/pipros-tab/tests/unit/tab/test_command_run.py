"""Command lines of a tab."""

import platform

import pytest

from pipros_tab.command_run import run_words


def test_python_prints_its_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert [run_words(["python3", option]) for option in ("--version", "-V")] == [0, 0]
    assert capsys.readouterr().out == f"Python {platform.python_version()}\n" * 2
