"""One bad package, wheel or folder among good ones closes only itself, wherever it is in the order."""

import os
from pathlib import Path

import pytest

from pipros.packages import crawl as crawl_module
from pipros.packages.crawl import crawl
from pipros_tools.cli import rosmsg, rospack
from pipros_wheels import installer
from pipros_wheels.commands import index, install, rosdep, wheel
from tests.support.workspaces import MANIFEST, Workspace, hide_setuptools
from tests.unit.wheels.test_installation import add_wheel

GOOD = ("b_good", "y_good")
POSITIONS = {"first": "a_bad", "middle": "m_bad", "last": "z_bad"}
HEAD = "cmake_minimum_required(VERSION 3.0.2)\nproject({0})\n"
MESSAGES = (
    "find_package(catkin REQUIRED COMPONENTS message_generation std_msgs)\n"
    "add_message_files(FILES {0}.msg)\ngenerate_messages(DEPENDENCIES std_msgs)\ncatkin_package()"
)
FAULTS: dict[str, dict[str, str | bytes | Path]] = {
    "a_cmake_error": {"CMakeLists.txt": "project({0})\nmessage(FATAL_ERROR broken)\n"},
    "a_malformed_manifest": {"package.xml": "<package><name>{0}</name>"},
    "an_empty_manifest": {"package.xml": ""},
    "a_foreign_encoding": {
        "package.xml": MANIFEST.replace("<description>d", "<description>caf\xe9").encode("latin-1")
    },
    "an_invalid_message": {"msg/Bad.msg": "int8 8\n", "CMakeLists.txt": HEAD + MESSAGES.format("Bad") + "\n"},
    "an_invalid_setup": {
        "CMakeLists.txt": f"{HEAD}find_package(catkin REQUIRED)\ncatkin_python_setup()\ncatkin_package()\n",
        "setup.py": "raise RuntimeError('broken')\n",
    },
    "a_dangling_manifest": {"package.xml": Path("nowhere")},
    "a_manifest_in_a_loop": {"package.xml": Path("package.xml")},
}
"""The files of a package with one fault, with `{0}` for its name; a path is that of a link."""
NO_PACKAGE = ("a_dangling_manifest", "a_manifest_in_a_loop")
"""Faults with which `rospack` finds no package in a folder."""

every_fault = pytest.mark.parametrize("fault", FAULTS)
every_position = pytest.mark.parametrize("position", POSITIONS)


def write_bad_package(workspace: Workspace, fault: str, position: str) -> str:
    """Write the good packages and a bad one, whose name decides its position, and return its name."""
    bad = POSITIONS[position]
    for name in (*GOOD, bad):
        workspace.add(name, MESSAGES.format("Good"), "std_msgs message_runtime", msg__Good_dot_msg="int8 a\n")
    for path, content in FAULTS[fault].items():
        file = workspace.base / "src" / bad / path
        if isinstance(content, Path):
            file.unlink()
            file.symlink_to(content)
        elif isinstance(content, bytes):
            file.write_bytes(content.replace(b"{name}", bad.encode()).replace(b"{more}", b""))
        else:
            file.write_text(content.replace("{0}", bad))
    return bad


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    made = Workspace(tmp_path / "ws")
    hide_setuptools(tmp_path, monkeypatch)
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    return made


@every_fault
@every_position
def test_catkin_make_builds_the_other_packages(workspace: Workspace, fault: str, position: str) -> None:
    bad = write_bad_package(workspace, fault, position)
    result = workspace.build(installs=True)
    assert result.built == list(GOOD)
    assert len(result.errors) == 1
    assert bad in result.errors[0]
    assert sorted(path.name for path in (workspace.layout.install / "share").iterdir()) == list(GOOD)


@every_fault
@every_position
def test_the_other_wheels_are_built_and_the_bad_package_is_named(
    workspace: Workspace, fault: str, position: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = write_bad_package(workspace, fault, position)
    assert wheel.main([str(workspace.base), "-o", str(tmp_path / "dist")]) == 1
    assert sorted(file.name.partition("-")[0] for file in (tmp_path / "dist").iterdir()) == [
        f"ros1_{name}" for name in GOOD
    ]
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("pipros wheel: ")]
    assert len(errors) == 1
    assert bad in errors[0]


@every_fault
def test_the_other_packages_are_installed(workspace: Workspace, fault: str, monkeypatch, capsys) -> None:
    bad = write_bad_package(workspace, fault, "middle")
    given: list[str] = []
    monkeypatch.setattr(
        installer.Installer,
        "install",
        lambda _self, _more, wheels, _only: given.extend(file.name for file in wheels),
    )
    assert install.main([str(workspace.base)]) == 1
    assert [name.partition("-")[0] for name in given] == [f"ros1_{name}" for name in GOOD]
    assert bad in capsys.readouterr().err


@every_fault
@every_position
def test_rospack_and_rosmsg_go_on(
    workspace: Workspace,
    fault: str,
    position: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bad = write_bad_package(workspace, fault, position)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(workspace.base / "src"))
    names = set(GOOD) | (set() if fault in NO_PACKAGE else {bad})
    known = names if "manifest" not in fault and "encoding" not in fault else set(GOOD)
    for words, expected in {
        ("list-names",): names,
        ("find", "y_good"): {str(workspace.base / "src/y_good")},
        ("depends1", "y_good"): {"std_msgs"},
        ("depends-on", "std_msgs"): known,
    }.items():
        assert rospack.main(list(words)) == 0
        lines = set(capsys.readouterr().out.split())
        assert {line for line in lines if "_good" in line or "_bad" in line} | (lines & expected) == expected
    assert rosmsg.main(["packages"]) in (0, None)
    assert {line for line in capsys.readouterr().out.split() if line.endswith(("_good", "_bad"))} == names
    assert rosmsg.main(["show", "y_good/Good"]) in (0, None)
    assert capsys.readouterr().out == "int8 a\n\n"


def test_packages_that_need_a_bad_one_are_left_out_with_the_reason(
    workspace: Workspace, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    workspace.add("a_bad", "message(FATAL_ERROR broken)")
    workspace.add("b_user", depends="a_bad")
    workspace.add("c_user", depends="b_user")
    workspace.add("d_good")
    assert wheel.main([str(workspace.base), "-o", str(tmp_path / "dist")]) == 1
    assert [file.name for file in (tmp_path / "dist").iterdir()] == ["ros1_d_good-0.1.0-py3-none-any.whl"]
    errors = capsys.readouterr().err
    assert "b_user: it is left out, because it needs a_bad, which failed" in errors
    assert "c_user: it is left out, because it needs b_user, which failed" in errors


def test_packages_that_share_a_name_or_form_a_cycle_are_left_out(
    workspace: Workspace, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("x1", "x2"):
        manifest = workspace.add(name) / "package.xml"
        manifest.write_text(manifest.read_text().replace(f"<name>{name}", "<name>x"))
    for name, depends in (
        ("c1", "c2"), ("c2", "c1"), ("user", "c1"), ("good", ""), ("my-arm", ""), ("my_arm", ""),
    ):  # fmt: skip
        workspace.add(name, depends=depends)
    workspace.add("arm_")
    assert wheel.main([str(workspace.base), "-o", str(tmp_path / "dist")]) == 1
    assert [file.name for file in (tmp_path / "dist").iterdir()] == ["ros1_good-0.1.0-py3-none-any.whl"]
    errors = capsys.readouterr().err
    for part in (
        "Multiple packages found with the same name 'x'",
        "the packages c1, c2 depend on each other",
        "user: it is left out, because it needs a package in this cycle",
        "packages my-arm and my_arm would both be distributed as ros1-my-arm",
        "package name [arm_] must consist of",
    ):
        assert part in errors


@every_position
def test_an_index_lists_the_other_wheels(tmp_path: Path, position: str, capsys) -> None:
    bad = POSITIONS[position]
    for name in GOOD:
        add_wheel(tmp_path, name, "1.0")
    (tmp_path / f"{bad}-1.0-py3-none-any.whl").write_text("no zip file")
    (tmp_path / f"{bad}.whl").touch()
    assert index.main([str(tmp_path)]) == 1
    assert sorted(path.name for path in (tmp_path / "simple").iterdir() if path.is_dir()) == [
        "b-good",
        "y-good",
    ]
    errors = capsys.readouterr().err
    assert f"left out: {tmp_path}/{bad}-1.0-py3-none-any.whl is not a wheel" in errors
    assert f"left out: ['{bad}.whl'] is not the file name of a wheel" in errors


def test_rosdep_reads_the_other_packages(workspace: Workspace, monkeypatch, capsys) -> None:
    bad = write_bad_package(workspace, "a_malformed_manifest", "first")
    monkeypatch.setenv("PATH", "/nowhere")
    assert rosdep.main(["keys", "--from-paths", str(workspace.base)]) == 1
    shown = capsys.readouterr()
    assert shown.out.split() == ["message_runtime", "std_msgs"]
    assert bad in shown.err


@every_position
def test_a_folder_without_permission_is_named_and_the_others_are_searched(
    workspace: Workspace, position: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bad = write_bad_package(workspace, "a_cmake_error", position)
    scandir = os.scandir

    def scan(folder: str) -> object:
        if folder.endswith(bad):
            raise PermissionError(13, "Permission denied", folder)  # which root would not meet
        return scandir(folder)

    monkeypatch.setattr(crawl_module.os, "scandir", scan)
    left_out: list[str] = []
    found = crawl(str(workspace.base / "src"), left_out)
    assert [package.name for package in found.packages] == list(GOOD)
    assert left_out == [f"{workspace.base}/src/{bad}: Permission denied"]


def test_a_loop_of_links_is_walked_once(workspace: Workspace) -> None:
    for name in GOOD:
        workspace.add(name)
    (workspace.base / "src" / "loop").symlink_to(workspace.base / "src")
    (workspace.base / "src" / "a_loop").symlink_to("a_loop")
    result = workspace.build()
    assert result.built == list(GOOD)
