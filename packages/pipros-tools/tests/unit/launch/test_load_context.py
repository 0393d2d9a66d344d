from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pipros_tools.launch.load_context import CommandFailed, LoadContext

PYTHON = f'"{Path(sys.executable).as_posix()}"'


def test_a_command_in_python_prints_any_text_on_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_tools.launch.load_context.ON_WINDOWS", True)
    monkeypatch.delenv("PYTHONIOENCODING", raising=False)
    for name, value in (("LC_ALL", "C"), ("PYTHONCOERCECLOCALE", "0"), ("PYTHONUTF8", "0")):
        monkeypatch.setenv(name, value)  # on Linux, a pipe has a poor encoding only with these
    assert LoadContext.of_process().run_command(f'{PYTHON} -c "print(chr(0x4e2d))"').strip() == "中"


def test_on_windows_the_variable_home_names_the_users_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = str(Path.home())
    monkeypatch.setattr("pipros_tools.launch.load_context.ON_WINDOWS", True)
    monkeypatch.setattr("os.path.expanduser", lambda _: expected)
    monkeypatch.delenv("HOME", raising=False)
    assert LoadContext.of_process().environment["HOME"] == expected
    monkeypatch.setenv("HOME", "/chosen")
    assert LoadContext.of_process().environment["HOME"] == "/chosen"


def test_an_absent_xacro_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "pipros_tools.launch.load_context.program_environment", lambda _: {"PATH": "/nowhere"}
    )
    with pytest.raises(CommandFailed, match=r"no such command .* comes from PyPI: .*pip install .*urdf"):
        LoadContext.of_process().run_command("xacro robot.xacro")
