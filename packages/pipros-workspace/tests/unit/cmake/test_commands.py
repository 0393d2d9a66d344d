"""The commands of CMake. `tests.golden.cmake` has the values of CMake 3.25, which `tests.interop` runs."""

import errno
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros_workspace.cmake.cmake_command import script_interpreter
from pipros_workspace.cmake.language import CMakeError
from tests.support.cmake_cases import MISTAKES, TOPICS, Case, line_of_mistake, read_cases
from tests.support.full_disk import files_limited_to


def value_of(case: Case, folder: Path) -> str:
    """Return the value of `o`, or the error."""
    folder.mkdir()
    interpreter = script_interpreter({})
    interpreter.scope.values["CMAKE_CURRENT_SOURCE_DIR"] = str(folder)
    interpreter.scope.values["CMAKE_CURRENT_BINARY_DIR"] = str(folder)
    try:
        interpreter.run_text(case.script, "case.cmake")
    except CMakeError as error:
        return str(error)
    return interpreter.scope.values.get("o", "")


@pytest.mark.parametrize("topic", TOPICS)
def test_values_are_those_of_cmake(topic: str, tmp_path: Path) -> None:
    wrong = []
    for case in read_cases(topic):
        value = value_of(case, tmp_path / str(case.line))
        if value != case.expected:
            wrong.append(f"{topic}.cmake:{case.line}: {case.script!r} gives {value!r}, not {case.expected!r}")
    assert wrong == []


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_is_named_with_its_line(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CMakeError) as error:
        script_interpreter({}).run_text(text, "mistake.cmake")
    assert f"mistake.cmake:{line_of_mistake(text)}" in str(error.value)


def test_a_missing_source_directory_is_named() -> None:
    with pytest.raises(CMakeError, match="add_subdirectory needs the source directory"):
        script_interpreter({}).run_text("add_subdirectory()", "mistake.cmake")


def test_the_environment_of_the_process_is_left_alone(tmp_path: Path) -> None:
    script_interpreter({}).run_text("set(ENV{PIPROS_TEST_OF_CMAKE} x)", "case.cmake")
    assert "PIPROS_TEST_OF_CMAKE" not in os.environ


@pytest.fixture
def deep_recursion() -> Iterator[None]:
    """Allow deep recursion, as some libraries do, mypy among them."""
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(1 << 14)
    yield
    sys.setrecursionlimit(limit)


@pytest.mark.usefixtures("deep_recursion")
@pytest.mark.parametrize("sign", ["-", "~", "(", "1+"])
def test_a_long_expression_is_a_mistake_whatever_the_recursion_limit(sign: str) -> None:
    with pytest.raises(
        CMakeError, match=r"mistake.cmake:1 \(math\):\n  the expression has \d+ characters; the limit"
    ):
        script_interpreter({}).run_text(f'math(EXPR o "{sign * 8000}1")', "mistake.cmake")


def test_paths_on_another_drive_are_absolute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: str, start: str) -> str:
        raise ValueError(f"path is on mount '{path}', start on mount '{start}'")

    (tmp_path / "a.txt").touch()
    monkeypatch.setattr(os.path, "relpath", refuse)
    interpreter = script_interpreter({})
    for script in (
        f"file(GLOB o RELATIVE /d {tmp_path}/*.txt)",
        f"file(RELATIVE_PATH o /d {tmp_path}/a.txt)",
    ):
        interpreter.run_text(script, "case.cmake")
        assert interpreter.scope.values["o"] == f"{tmp_path}/a.txt"


@pytest.mark.needs("resource limits")
@pytest.mark.parametrize("command", [
    "file(WRITE ${o} ${c})", "file(APPEND ${o} ${c})", "file(CONFIGURE OUTPUT ${o} CONTENT ${c})",
    "configure_file(${i} ${o})", "file(INSTALL ${i} DESTINATION ${d} RENAME o)",
])  # fmt: skip
def test_a_full_disk_is_named_and_keeps_the_old_file(command: str, tmp_path: Path) -> None:
    content = "x" * 9000
    (tmp_path / "i").write_text(content)
    (tmp_path / "o").write_text("old")
    interpreter = script_interpreter({})
    paths = {"i": f"{tmp_path / 'i'}", "o": f"{tmp_path / 'o'}", "d": f"{tmp_path}"}
    interpreter.scope.values |= {**paths, "c": content}

    with files_limited_to(5000), pytest.raises(CMakeError) as error:
        interpreter.run_text(command, "case.cmake")

    assert f"{tmp_path / 'o'}: {os.strerror(errno.EFBIG)}" in str(error.value).replace("'", "")
    assert ((tmp_path / "o").read_text().rstrip("x"), sorted(os.listdir(tmp_path))) == ("old", ["i", "o"])
