"""`cmake -E`, with which custom commands copy and compare files and run programs."""

import os
import sys
from pathlib import Path

import pytest

from pipros_workspace.cmake.tools import ToolFailed, run_tool

EXIT = "import os, sys; sys.exit(int(os.environ.get('CODE', '9')))"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").write_text("a")
    (tmp_path / "d" / "sub").mkdir(parents=True)
    (tmp_path / "d" / "sub" / "x").write_text("x")
    return tmp_path


@pytest.mark.parametrize(("command", "files"), [
    ("copy a b", {"b": "a"}), ("copy a d", {"d/a": "a"}), ("copy a d/sub/x d", {"d/a": "a", "d/x": "x"}),
    ("copy a new/b", {"new/b": "a"}), ("copy_if_different a b", {"b": "a"}),
    ("copy_directory d e", {"e/sub/x": "x"}), ("rename a b", {"b": "a", "a": None}),
    ("remove a nope", {"a": None}), ("remove -f a", {"a": None}), ("rm -rf d nope", {"d/sub/x": None}),
    ("rm -r d", {"d/sub/x": None}), ("remove_directory d", {"d/sub/x": None}),
    ("touch a b", {"a": "a", "b": ""}), ("touch_nocreate b", {"b": None}),
    ("create_symlink a l", {"l": "a"}), ("make_directory e/f e/f", {}),
])  # fmt: skip
def test_files_are_changed(folder: Path, command: str, files: dict[str, str | None]) -> None:
    name, *words = command.split()
    assert run_tool(name, words) == 0
    for path, content in files.items():
        file = folder / path
        assert (file.read_text() if file.is_file() else None) == content


@pytest.mark.parametrize(("words", "code"), [
    (["true"], 0), (["false"], 1), (["compare_files", "a", "a"], 0),
    (["compare_files", "a", "d/sub/x"], 1), (["env", "CODE=3", sys.executable, "-c", EXIT], 3),
    (["env", "--unset=CODE", "A=b", "--", sys.executable, "-c", EXIT], 9),
    (["chdir", "d", sys.executable, "-c", "import os, sys; sys.exit(os.path.isdir('sub'))"], 1),
    (["sleep", "0"], 0),
])  # fmt: skip
def test_codes_are_returned(words: list[str], code: int) -> None:
    assert run_tool(words[0], words[1:]) == code


def test_texts_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    run_tool("echo", ["a", "b c"])
    run_tool("echo_append", ["d"])
    run_tool("cat", ["a", "a"])
    assert capsys.readouterr().out == "a b c\ndaa"


@pytest.mark.parametrize(("words", "error"), [
    (["nope"], ToolFailed), (["rename", "a"], ToolFailed), (["sleep", "x"], ToolFailed),
    (["copy", "nope", "b"], OSError),
])  # fmt: skip
def test_mistakes_are_refused(words: list[str], error: type[Exception]) -> None:
    with pytest.raises(error):
        run_tool(words[0], words[1:])
    assert os.path.exists("a")
