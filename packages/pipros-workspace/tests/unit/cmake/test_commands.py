"""The commands of CMake. `tests.golden.cmake` has the values of CMake 3.25, which `tests.interop` runs."""

import errno
import os
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros_workspace.cmake.cmake_command import script_interpreter
from pipros_workspace.cmake.copying import PROGRAM_MODE, CannotCopy, Copy, copy, read_copies
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

    tmp_path /= "ws[1]"  # which matches itself, and not its neighbour
    tree(tmp_path, "a.txt", "../ws1/b.txt")
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


def in_source(path: str) -> str:
    return os.path.normpath(os.path.join("/source", path))


@pytest.mark.parametrize(("words", "expected"), [
    ("a b DESTINATION d", [("/source/a", "d"), ("/source/b", "d")]),
    ("DESTINATION d a", [("/source/a", "d")]), ("x/ DESTINATION d", [("/source/x/", "d")]),
    ("/abs/a DESTINATION /d", [("/abs/a", "/d")]), ("DESTINATION d", []),
    ("a DESTINATION d COMPONENT c CONFIGURATIONS Debug Release", [("/source/a", "d")]),
])  # fmt: skip
def test_sources_and_target_are_read(words: str, expected: list[tuple[str, str]]) -> None:
    assert [(item.source, item.target) for item in read_copies(words.split(), in_source)] == expected


@pytest.mark.parametrize(("words", "attributes"), [
    ("a DESTINATION d", {"mode": 0o644, "is_optional": False, "rename": "", "keeps_permissions": False}),
    ("a DESTINATION d RENAME b OPTIONAL", {"rename": "b", "is_optional": True}),
    ("a DESTINATION d PERMISSIONS OWNER_READ OWNER_EXECUTE GROUP_READ", {"mode": 0o540}),
    ("a DESTINATION d FILE_PERMISSIONS OWNER_READ DIRECTORY_PERMISSIONS OWNER_WRITE", {"mode": 0o400}),
    ("a DESTINATION d USE_SOURCE_PERMISSIONS", {"keeps_permissions": True}),
    ("a DESTINATION d FILES_MATCHING PATTERN *.x", {"only_matching": True}),
])  # fmt: skip
def test_options_are_read(words: str, attributes: dict[str, object]) -> None:
    (item,) = read_copies(words.split(), in_source)
    assert {name: getattr(item, name) for name in attributes} == attributes


@pytest.mark.parametrize(("words", "complaint"), [
    ("a", "DESTINATION"), ("a DESTINATION", "DESTINATION"), ("a DESTINATION d RENAME", "RENAME"),
    ("a DESTINATION d EXCLUDE", "EXCLUDE"), ("a DESTINATION d PATTERN", "PATTERN"),
    ("a DESTINATION d REGEX (", "cannot be compiled"),
])  # fmt: skip
def test_wrong_words_are_refused(words: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        read_copies(words.split(), in_source)


def tree(folder: Path, *files: str) -> Path:
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(file)
        (folder / file).chmod(0o755 if file.endswith(".sh") else 0o644)
    return folder


def copied(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()}


@pytest.mark.parametrize(("words", "expected"), [
    ("s DESTINATION t", {"s/a.py", "s/b.sh", "s/sub/c.py", "s/sub/d.txt"}),
    ("s/ DESTINATION t", {"a.py", "b.sh", "sub/c.py", "sub/d.txt"}),
    ("s/ DESTINATION t PATTERN *.py EXCLUDE", {"b.sh", "sub/d.txt"}),
    ("s/ DESTINATION t PATTERN sub EXCLUDE PATTERN py EXCLUDE", {"a.py", "b.sh"}),
    ("s/ DESTINATION t PATTERN s* EXCLUDE PATTERN .py EXCLUDE", {"a.py", "b.sh"}),
    ("s/ DESTINATION t PATTERN s?b/*.py EXCLUDE PATTERN s/*.txt EXCLUDE", {"a.py", "b.sh", "sub/d.txt"}),
    ("s/ DESTINATION t FILES_MATCHING PATTERN *.py", {"a.py", "sub/c.py"}),
    ("s/ DESTINATION t FILES_MATCHING PATTERN *.py PATTERN sub EXCLUDE", {"a.py"}),
    ("s/ DESTINATION t REGEX /sub/.*txt$ EXCLUDE", {"a.py", "b.sh", "sub/c.py"}),
    ("s/ DESTINATION t FILES_MATCHING REGEX [.]sh$", {"b.sh"}), ("s/sub/ DESTINATION t", {"c.py", "d.txt"}),
    ("nowhere DESTINATION t", set()),
])  # fmt: skip
def test_folders_are_copied_by_their_patterns(tmp_path: Path, words: str, expected: set[str]) -> None:
    tree(tmp_path / "s", "a.py", "b.sh", "sub/c.py", "sub/d.txt", "__pycache__/a.pyc")
    (item,) = read_copies(words.split(), lambda path: os.path.normpath(tmp_path / path), is_folder=True)
    copy(item, tmp_path / "base", lambda _line: None)
    assert copied(tmp_path / "base" / "t") == expected


@pytest.mark.parametrize(("words", "modes"), [
    ("s/ DESTINATION t", {"a.py": 0o644, "b.sh": 0o644}),
    ("s/ DESTINATION t USE_SOURCE_PERMISSIONS", {"a.py": 0o644, "b.sh": 0o755}),
    ("s/ DESTINATION t PATTERN *.sh PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE",
     {"a.py": 0o644, "b.sh": 0o700}),
])  # fmt: skip
def test_permissions_are_the_requested_ones(tmp_path: Path, words: str, modes: dict[str, int]) -> None:
    tree(tmp_path / "s", "a.py", "b.sh")
    (item,) = read_copies(words.split(), lambda path: os.path.normpath(tmp_path / path), is_folder=True)
    copy(item, tmp_path, lambda _line: None)
    assert {name: stat.S_IMODE((tmp_path / "t" / name).stat().st_mode) for name in modes} == modes


def test_a_file_is_copied_once_until_it_changes(tmp_path: Path) -> None:
    tree(tmp_path, "a")
    item = Copy(str(tmp_path / "a"), "t", rename="b", mode=PROGRAM_MODE)
    lines: list[str] = []
    target = copy(item, tmp_path, lines.append)
    copy(item, tmp_path, lines.append)
    (tmp_path / "a").write_text("new")
    os.utime(tmp_path / "a", (1, 1))
    copy(item, tmp_path, lines.append)
    assert lines == [f"-- Installing: {target}", f"-- Up-to-date: {target}", f"-- Installing: {target}"]
    assert (target, target.read_text()) == (tmp_path / "t" / "b", "new")


def test_links_are_copied_as_links(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("nowhere")
    for _ in range(2):
        target = copy(Copy(str(tmp_path / "link"), "t"), tmp_path, lambda _line: None)
    assert os.readlink(target) == "nowhere"


def test_links_to_folders_are_copied_with_their_folder(tmp_path: Path) -> None:
    tree(tmp_path / "s", "meshes/base.stl")
    (tmp_path / "s" / "latest").symlink_to("meshes")
    for only_matching in (False, True):
        item = Copy(f"{tmp_path}/s/", f"t{only_matching}", is_folder=True, only_matching=only_matching)
        copy(item, tmp_path, lambda _line: None)
    assert os.readlink(tmp_path / "tFalse" / "latest") == "meshes"
    assert (tmp_path / "tFalse" / "latest" / "base.stl").is_file()
    assert not os.path.lexists(tmp_path / "tTrue" / "latest")  # FILES_MATCHING, and no pattern matches


@pytest.mark.parametrize("slash", ["", "/"])
def test_a_folder_that_is_a_link_is_copied_with_its_contents(slash: str, tmp_path: Path) -> None:
    tree(tmp_path / "real", "deep/a.launch")
    (tmp_path / "launch").symlink_to("real")
    copy(Copy(f"{tmp_path}/launch{slash}", "share", is_folder=True), tmp_path, lambda _line: None)
    copied = tmp_path / "share" / ("" if slash else "launch") / "deep" / "a.launch"
    assert copied.is_file()


def test_a_missing_file_is_refused_unless_it_is_optional(tmp_path: Path) -> None:
    missing = Copy(str(tmp_path / "nope"), "t")
    with pytest.raises(CannotCopy, match="nope"):
        copy(missing, tmp_path, lambda _line: None)
    copy(Copy(str(tmp_path / "nope"), "t", is_optional=True), tmp_path, lambda _line: None)
    assert not (tmp_path / "t").exists()


@pytest.mark.needs("resource limits")
def test_a_full_disk_keeps_the_old_copy(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("x" * 9000)
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "x").write_text("old")

    with files_limited_to(5000), pytest.raises(OSError, match=r"d.x'$"):
        copy(Copy(str(tmp_path / "x"), "d"), tmp_path, print)

    assert [each.read_text() for each in (tmp_path / "d").iterdir()] == ["old"]
