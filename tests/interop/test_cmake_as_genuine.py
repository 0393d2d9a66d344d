"""The language of CMake: scripts that print what they compute, carried out by CMake and by pipros."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from pipros.cmake.language import CMakeError
from pipros.cmake.program import run_script

SCRIPTS = Path(__file__).parent / "cmake"

MISTAKES = [
    'message(FATAL_ERROR "a reason")',
    "nonsense()",
    "include(nope.cmake)",
    "list(NOPE x)",
    "list(GET)",
    "set(L a b)\nlist(GET L 5 o)",
    'string(SUBSTRING "abc" 7 1 o)',
    "math(EXPR a)",
    'math(EXPR a "1 +")',
    'math(EXPR a "1 / 0")',
    "file(READ nope o)",
    "file(STRINGS nope o)",
    "if(a b)\nendif()",
    "while(TRUE",
    "function(f a)\nendfunction()\nf()",
    'string(REGEX MATCH "(" o x)',
    "foreach(i RANGE 1 5 -1)\nendforeach()",
    "configure_file(nope out)",
    "execute_process(COMMAND false COMMAND_ERROR_IS_FATAL ANY)",
    "find_program(X nope_of_that_name REQUIRED)",
]


@pytest.mark.parametrize("name", ["language", "files"])
def test_a_script_prints_what_it_prints_with_cmake(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / f"{name}.cmake"
    shutil.copy(SCRIPTS / script.name, script)
    genuine = carried_out_by_cmake(script, tmp_path / "work")
    assert genuine.returncode == 0, genuine.stderr
    shutil.rmtree(tmp_path / "work")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    assert run_script(str(script)) == 0
    assert capsys.readouterr().out == genuine.stdout


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_is_one_for_cmake_too_and_named_with_its_line(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "mistake.cmake"
    script.write_text(f"cmake_minimum_required(VERSION 3.16)\n{text}\n")
    assert carried_out_by_cmake(script, tmp_path / "work").returncode == 1
    monkeypatch.chdir(tmp_path / "work")
    with pytest.raises(CMakeError) as error:
        run_script(str(script))
    lines_before = text.count("\n") if text.startswith(("set(", "function(")) else 0
    assert f"{script}:{2 + lines_before}" in str(error.value)


def carried_out_by_cmake(script: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    folder.mkdir()
    return subprocess.run(
        ["/usr/bin/cmake", "-P", script], cwd=folder, capture_output=True, text=True, check=False
    )
