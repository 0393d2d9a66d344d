"""The language of CMake: scripts that print their results, run by CMake and by pipros."""

import shutil
import subprocess
from pathlib import Path

import pytest

from pipros_workspace.cmake.cmake_command import run_script
from pipros_workspace.cmake.language import CMakeError
from tests.support.cmake_cases import MISTAKES, TOPICS, line_of_mistake, read_cases

SCRIPTS = Path(__file__).parent / "cmake"

CLEAN_UP = """\
file(REMOVE_RECURSE ${CMAKE_CURRENT_SOURCE_DIR}/w)
unset(X CACHE)
unset(OPT CACHE)
unset(P CACHE)
unset(ENV{MY_V})
unset(ENV{X_X})
set_property(GLOBAL PROPERTY P)
"""


@pytest.mark.parametrize("name", ["language", "files"])
def test_a_script_prints_the_same_as_with_cmake(name: str, tmp_path, capsys, monkeypatch) -> None:
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
def test_errors_are_also_errors_of_cmake_and_name_their_line(text: str, tmp_path, monkeypatch) -> None:
    script = tmp_path / "mistake.cmake"
    script.write_text(f"cmake_minimum_required(VERSION 3.16)\n{text}\n")
    assert carried_out_by_cmake(script, tmp_path / "work").returncode == 1
    monkeypatch.chdir(tmp_path / "work")
    with pytest.raises(CMakeError) as error:
        run_script(str(script))
    assert f"{script}:{1 + line_of_mistake(text)}" in str(error.value)


@pytest.mark.parametrize("topic", TOPICS)
def test_the_recorded_values_are_those_of_cmake(topic: str, tmp_path: Path) -> None:
    cases = read_cases(topic)
    lines = ["cmake_minimum_required(VERSION 3.25)"]
    for number, case in enumerate(cases):
        lines += [f"function(case_{number})", case.script, 'message(STATUS "o=[${o}]")', "endfunction()"]
        lines += [f"case_{number}()", CLEAN_UP]
    script = tmp_path / "work" / "cases.cmake"
    printed = carried_out_by_cmake(script, script.parent, "\n".join(lines))
    assert printed.returncode == 0, printed.stderr
    values = [part.rpartition("]")[0] for part in printed.stdout.split("-- o=[")[1:]]
    assert values == [case.expected for case in cases]


def carried_out_by_cmake(
    script: Path, folder: Path, text: str | None = None
) -> subprocess.CompletedProcess[str]:
    folder.mkdir()
    if text is not None:
        script.write_text(text)
    return subprocess.run(
        ["/usr/bin/cmake", "-P", script], cwd=folder, capture_output=True, text=True, check=False
    )
