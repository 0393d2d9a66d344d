from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipros.basics.env import DISTRIBUTION
from pipros_workspace.program_start import command_of, program_environment, why_not_startable


def program(path: Path, content: str = "#!/bin/sh\n") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode())
    path.chmod(0o755)
    return path


def test_the_own_interpreter_comes_first_when_another_python_would_be_found(tmp_path: Path) -> None:
    own, other = program(tmp_path / "venv" / "python3"), program(tmp_path / "other" / "python3")
    environment = program_environment({"PATH": str(other.parent), "A": "b"}, str(own))
    assert environment == {**DISTRIBUTION, "PATH": f"{own.parent}:{other.parent}", "A": "b"}


def test_a_path_with_the_own_interpreter_is_unchanged(tmp_path: Path) -> None:
    own, tools = program(tmp_path / "venv" / "python3"), program(tmp_path / "tools" / "gdb")
    variables = {"PATH": f"{tools.parent}:{own.parent}"}
    assert program_environment(variables, str(own))["PATH"] == variables["PATH"]


def test_programs_see_the_distribution_unless_the_environment_has_another(tmp_path: Path) -> None:
    environment = program_environment({"PATH": "/nowhere", "ROS_DISTRO": "one"})
    assert [environment[name] for name in DISTRIBUTION] == ["one", "1", "3"]


def test_a_launch_prefix_is_split_into_words_without_a_shell(tmp_path: Path) -> None:
    script = program(tmp_path / "talker")
    command = command_of(script, ["a b"], "gdb -ex 'run $(x)' --args")
    assert command == ["gdb", "-ex", "run $(x)", "--args", str(script), "a b"]


@pytest.mark.needs("first lines")
def test_a_script_without_a_first_line_is_run_by_the_shell(tmp_path: Path) -> None:
    script = program(tmp_path / "start", "echo hello\n")
    assert command_of(script) == ["/bin/sh", str(script)]


@pytest.mark.parametrize(("name", "content", "is_python"), [
    ("talker", "#!/usr/bin/env python3\n", True),
    ("talker.py", "import rospy\n", True), ("talker.exe", "MZ python", False),
])  # fmt: skip
def test_windows_runs_python_scripts_with_the_own_interpreter(
    name: str, content: str, is_python: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros_workspace.program_start.ON_WINDOWS", True)
    script = program(tmp_path / name, content)
    assert command_of(script) == [*[sys.executable] * is_python, str(script)]
    assert why_not_startable(script) is None


def test_windows_runs_python_scripts_whose_lines_end_as_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros_workspace.program_start.ON_WINDOWS", True)
    assert why_not_startable(program(tmp_path / "talker", "#!/opt/none/python3\r\nimport rospy\r\n")) is None


def test_on_windows_a_program_can_print_any_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_workspace.program_start.ON_WINDOWS", True)
    monkeypatch.delenv("PYTHONIOENCODING", raising=False)
    poor = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}  # as Windows's pipes
    environment = program_environment({**os.environ, **poor})
    printed = subprocess.run(
        [sys.executable, "-c", "print(chr(0x4e2d))"], env=environment, capture_output=True, check=True
    )
    assert printed.stdout.strip() == b"\\u4e2d"


@pytest.mark.needs("first lines")
@pytest.mark.parametrize(("content", "complaint"), [
    ("import rospy\n", "make '#!/usr/bin/env python3' its first line"),
    ("#!/usr/bin/env python3\r\nimport rospy\r\n", "Windows line endings"),
    ("#!/opt/none/ruby\n", "/opt/none/ruby, which does not exist"),
])  # fmt: skip
def test_a_bad_first_line_is_explained(tmp_path: Path, content: str, complaint: str) -> None:
    assert complaint in (why_not_startable(program(tmp_path / "talker.py", content)) or "")


def test_a_valid_script_has_no_findings(tmp_path: Path) -> None:
    assert why_not_startable(program(tmp_path / "talker.py", "#!/bin/sh\n")) is None
