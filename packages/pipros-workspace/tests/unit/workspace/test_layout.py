import hashlib
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from pipros.basics.env import DISTRIBUTION
from pipros_workspace.catkin.project import Download
from pipros_workspace.layout import closure, read_source_space
from pipros_workspace.program_start import command_of, program_environment, why_not_startable
from pipros_workspace.run_tests import fetch

MANIFEST = """<package format="3"><name>{name}</name><version>1.0.0</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>x</license>{rest}</package>"""


def add(source: Path, name: str, rest: str = "", folder: str = "") -> Path:
    path = source / (folder or name)
    path.mkdir(parents=True)
    (path / "package.xml").write_text(MANIFEST.format(name=name, rest=rest))
    return path


def names(source: Path, **variables: str) -> list[str]:
    return [package.name for package in read_source_space(source, variables).packages]


def test_packages_follow_their_dependencies(tmp_path: Path) -> None:
    add(tmp_path, "a", "<depend>b</depend>")
    add(tmp_path, "b", "<build_depend>c</build_depend><exec_depend>elsewhere</exec_depend>")
    add(tmp_path, "c", "<test_depend>d</test_depend>")
    add(tmp_path, "d")
    assert names(tmp_path) == ["d", "c", "b", "a"]


@pytest.mark.parametrize(("condition", "variables", "is_needed"), [
    ("$ROS_PYTHON_VERSION == 3", {}, True), ("$ROS_PYTHON_VERSION == 2", {}, False),
    ("$ROS_DISTRO == noetic and $ROS_VERSION == 1", {}, True),
    ("$ROS_DISTRO == noetic", {"ROS_DISTRO": "melodic"}, False),
    ("$WITH_ARM == yes", {"WITH_ARM": "yes"}, True), ("$WITH_ARM == yes", {}, False),
])  # fmt: skip
def test_conditions_decide_what_a_package_depends_on(
    tmp_path: Path, condition: str, variables: dict[str, str], is_needed: bool
) -> None:
    add(tmp_path, "a", f'<depend condition="{condition}">b</depend>')
    add(tmp_path, "b")
    packages = {package.name: package for package in read_source_space(tmp_path, variables).packages}
    assert packages["a"].all_dependencies == ({"b"} if is_needed else set())


def test_dependencies_are_listed_by_kind(tmp_path: Path) -> None:
    add(tmp_path, "a", "<depend>x</depend><exec_depend>y</exec_depend><test_depend>z</test_depend>")
    (package,) = read_source_space(tmp_path, {}).packages
    assert package.dependencies("build_depends") == {"x"}
    assert package.dependencies("exec_depends") == {"x", "y"}
    assert package.dependencies("test_depends", "build_export_depends") == {"x", "z"}
    assert not package.is_metapackage


def test_the_closure_has_direct_and_indirect_dependencies(tmp_path: Path) -> None:
    add(tmp_path, "a", "<depend>b</depend>")
    add(tmp_path, "b", "<depend>c</depend><depend>elsewhere</depend>")
    add(tmp_path, "c")
    add(tmp_path, "other")
    packages = read_source_space(tmp_path, {}).packages
    assert (closure(packages, {"a"}), closure(packages, {"c", "nope"})) == ({"a", "b", "c"}, {"c"})
    assert closure(packages, set()) == set()


def test_metapackages_are_built_and_dry_packages_are_not(tmp_path: Path) -> None:
    add(tmp_path, "all_of_them", "<export><metapackage/></export>")
    (tmp_path / "dry").mkdir()
    (tmp_path / "dry" / "manifest.xml").write_text("<package/>")
    (package,) = read_source_space(tmp_path, {}).packages
    assert package.is_metapackage


@pytest.mark.parametrize(("manifest", "complaint"), [
    ("<package", "package.xml:1:"),
    ("<package format='2'>\n<name>x</name>\n<oops>\n</package>", "package.xml:4:"),
    ("<package format='2'><name>x</name></package>", "package.xml:1:"),
    (
        "<package format='9'><name>x</name></package>",
        "package.xml:1:1: format must be 1, 2 or 3, got [9]",
    ),
    ("<package format='two'/>", "format must be 1, 2 or 3, got [two]"), ("<other/>", "package.xml"),
    ("<!DOCTYPE x []><package/>", "package.xml:1:"),
    (MANIFEST.format(name="bad", rest="<depend>x</depend>" * 997), "at most 1000 elements, got 1002"),
])  # fmt: skip
def test_a_broken_manifest_is_reported_with_its_place(tmp_path: Path, manifest: str, complaint: str) -> None:
    add(tmp_path, "good")
    add(tmp_path, "bad")
    (tmp_path / "bad" / "package.xml").write_text(manifest)
    space = read_source_space(tmp_path, {})
    assert [package.name for package in space.packages] == ["good"]
    (error,) = space.errors
    assert complaint in error


@pytest.mark.parametrize("circle", [("a", "b"), ("a", "b", "c")])
def test_a_circle_is_named(tmp_path: Path, circle: tuple[str, ...]) -> None:
    for name, needed in zip(circle, (*circle[1:], circle[0]), strict=True):
        add(tmp_path, name, f"<depend>{needed}</depend>")
    space = read_source_space(tmp_path, {})
    assert not space.packages
    assert f"the packages {', '.join(circle)} depend on each other" in "".join(space.errors)


def test_one_name_for_two_packages_is_refused_with_both_folders(tmp_path: Path) -> None:
    folders = [add(tmp_path, "a", folder=folder) for folder in ("one", "two")]
    (error,) = read_source_space(tmp_path, {}).errors
    assert all(str(folder) in error for folder in folders)


CONTENT = b"a bag"
MD5 = hashlib.md5(CONTENT, usedforsecurity=False).hexdigest()


class Files(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200 if self.path == "/x.bag" else 404)
        self.end_headers()
        self.wfile.write(CONTENT)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 # as in the base
        pass


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), Files) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.mark.parametrize("md5", ["", MD5])
def test_a_file_is_downloaded_once(url: str, tmp_path: Path, md5: str) -> None:
    lines: list[str] = []
    download = Download(f"{url}/x.bag", str(tmp_path / "below" / "x.bag"), md5)
    fetch(download, lines.append)
    fetch(download, lines.append)
    assert (tmp_path / "below" / "x.bag").read_bytes() == CONTENT
    assert lines == [f"-- Downloading {url}/x.bag to {tmp_path / 'below' / 'x.bag'}"]
    assert [path.name for path in (tmp_path / "below").iterdir()] == ["x.bag"]


def test_a_file_with_another_content_is_replaced(url: str, tmp_path: Path) -> None:
    (tmp_path / "x.bag").write_text("old")
    fetch(Download(f"{url}/x.bag", str(tmp_path / "x.bag"), MD5), lambda _line: None)
    assert (tmp_path / "x.bag").read_bytes() == CONTENT


def test_a_wrong_content_is_not_kept(url: str, tmp_path: Path) -> None:
    lines: list[str] = []
    fetch(Download(f"{url}/x.bag", str(tmp_path / "x.bag"), "0" * 32), lines.append)
    assert lines[-1] == f"-- WARNING: the MD5 of {url}/x.bag must be {'0' * 32}, got {MD5}"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", ["{url}/missing", "file:///etc/passwd", "ftp://127.0.0.1/x", "nonsense"])
def test_failed_downloads_are_warnings(url: str, tmp_path: Path, path: str) -> None:
    lines: list[str] = []
    fetch(Download(path.format(url=url), str(tmp_path / "x.bag")), lines.append)
    assert "cannot be downloaded" in lines[-1]
    assert not (tmp_path / "x.bag").exists()


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
