from __future__ import annotations

import io
from pathlib import Path

import pytest

from pipros_tools.launch.console import Console


def test_the_console_prints_and_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    console = Console()
    console.open_log(tmp_path / "log")
    console.say("plain")
    console.bold("bold")
    console.title("title")
    console.detail("detail")
    console.error("wrong")
    console.close()
    captured = capsys.readouterr()
    assert captured.out == "plain\n\033[1mbold\033[0m\n\033]2;title\007\n"
    assert captured.err == "\033[31mwrong\033[0m\n"
    lines = (tmp_path / "log").read_text().splitlines()
    assert [line.rpartition(": ")[2] for line in lines] == ["plain", "bold", "detail", "wrong"]
    assert lines[0].startswith("[roslaunch][INFO] ")
    assert lines[3].startswith("[roslaunch][ERROR] ")


def test_a_title_is_optional_and_details_can_be_shown(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(has_title=False, is_verbose=True)
    console.title("title")
    console.detail("detail")
    assert capsys.readouterr().out == "detail\n"


def test_a_closed_terminal_is_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    class Closed(io.StringIO):
        def write(self, text: str) -> int:
            raise BrokenPipeError

    monkeypatch.setattr("sys.stdout", Closed())
    Console().say("unheard")
