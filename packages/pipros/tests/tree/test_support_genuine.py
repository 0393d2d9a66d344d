"""A machine without genuine ROS, pyright or a browser: which tests are skipped, and how that is reported."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import genuine, left_out, ros2_wheels, windows
from tests.support.environments import REPOSITORY, project_files

PLUGIN = """
from tests.support import bridge_clients, browser, dds_peers, genuine, npm, pyright, ros2_wheels, windows
bridge_clients.missing = lambda: ["roslib"]
bridge_clients.missing_foxglove = lambda: ["ws"]
browser.find_chromium = lambda: None
dds_peers.missing = lambda: ["tshark"]
genuine._FILES = {"/no/such/file": "python3-rospy"}
genuine._MODULES = {}
npm.is_installed = lambda: False
pyright.find_pyright = lambda: None
ros2_wheels.missing = lambda: ["rclpy of jazzy"]
windows.missing = lambda: ["wine"]
"""


@pytest.fixture
def run_without_genuine(tmp_path: Path) -> Path:
    (tmp_path / "without_genuine.py").write_text(PLUGIN)
    return tmp_path


def run(plugins: Path, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "without_genuine", "--collect-only", "-q", *arguments],
        cwd=REPOSITORY,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": f"{plugins}:{REPOSITORY}", **variables},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_missing_packages_are_found_by_their_files(monkeypatch: pytest.MonkeyPatch) -> None:
    # The tables are read when tests are collected, where nothing can pass others.
    monkeypatch.setattr(genuine, "_FILES", {"/no/such/file": "python3-rospy", "/": "base-files"})
    monkeypatch.setattr(genuine, "_MODULES", {})

    assert genuine.missing_packages() == ["python3-rospy"]


def test_interop_is_left_out_and_the_last_lines_say_so(run_without_genuine: Path) -> None:
    ended = run(
        run_without_genuine,
        "packages/pipros/tests/interop",
        "packages/pipros/tests/tree/test_support_genuine.py",
    )

    assert "interop/" not in ended.stdout.partition("left out")[0]
    *_, what, how, last = ended.stdout.rstrip("\n").splitlines()
    assert what.startswith("left out: tests that need genuine ROS 1, Chromium, npm, clients of bridges, ")
    assert how == "`.venv/bin/python -m tests.support.left_out` prints how to install what is missing"
    assert "collected" in last or "no tests" in last


def test_what_is_missing_is_listed_with_commands(run_without_genuine: Path) -> None:
    program = "import runpy, without_genuine; runpy.run_module('tests.support.left_out', run_name='__main__')"
    printed = subprocess.run(
        [sys.executable, "-c", program],
        cwd=REPOSITORY,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": f"{run_without_genuine}:{REPOSITORY}"},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    ).stdout
    assert "genuine ROS 1 lacks python3-rospy\n  apt-get install --no-install-recommends " in printed
    assert f"Wine lacks wine\n  {windows.INSTALL} (as root on Debian 12)\n" in printed
    assert f"genuine ROS 2 lacks rclpy of jazzy\n  {ros2_wheels.INSTALL} (Linux, x86_64)\n" in printed


def test_files_that_name_absent_libraries_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "test_it.py"
    file.write_text("import numpy\n")
    monkeypatch.setattr(left_out, "_NEEDS_LIBRARY", re.compile(r"\b(numpy)\b"))
    assert left_out.needs_library(file)
    file.write_text("import array\n")
    assert not left_out.needs_library(file)


def test_in_continuous_integration_it_is_an_error(run_without_genuine: Path) -> None:
    ended = run(run_without_genuine, "packages/pipros/tests/interop", CI="true")

    assert ended.returncode == pytest.ExitCode.USAGE_ERROR
    assert "genuine ROS 1 is needed here (CI is set) and lacks: python3-rospy" in ended.stderr


def test_in_continuous_integration_other_folders_do_not_need_it(run_without_genuine: Path) -> None:
    ended = run(run_without_genuine, "packages/pipros/tests/tree/test_support_quick.py", CI="true")

    assert ended.returncode == pytest.ExitCode.OK


def test_in_continuous_integration_a_skipped_test_is_a_failure(pytester_folder: Path) -> None:
    (pytester_folder / "test_it.py").write_text(
        "import pytest\ndef test_it():\n    pytest.skip('no zsh here')\n"
    )

    here, in_ci = (_run_test(pytester_folder, **variables) for variables in ({}, {"CI": "true"}))

    assert here.returncode == 0
    assert in_ci.returncode == 1
    assert "skipped, which nothing may be in continuous integration" in in_ci.stdout
    assert "no zsh here" in in_ci.stdout


@pytest.fixture
def pytester_folder(tmp_path: Path) -> Path:
    (tmp_path / "conftest.py").write_text(
        "from tests.support.project_conftest import pytest_runtest_makereport\n"
    )
    return tmp_path


def _run_test(folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(folder)],
        cwd=folder,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(REPOSITORY), **variables},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_an_archive_without_git_has_the_same_files(monkeypatch: pytest.MonkeyPatch) -> None:
    patterns = ("packages/pipros/src/*", "pyproject.toml")
    known = {file for file in project_files(*patterns) if file.is_file()}
    monkeypatch.setenv("PATH", "")
    found = set(project_files(*patterns))

    assert set() < known <= found
