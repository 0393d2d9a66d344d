"""A machine without genuine ROS, pyright or a browser: which tests are skipped, and how that is reported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import bridge_clients, browser, dds_peers, genuine, pyright, ros2_wheels, windows
from tests.support.environments import REPOSITORY

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
    *lines, last = ended.stdout.rstrip("\n").splitlines()
    if lines[-5].startswith("examples/fleet: "):  # if this machine has no systemd
        del lines[-5:-3]
    (
        *_,
        checker,
        how,
        page,
        get,
        python,
        clients,
        install,
        dds,
        peers,
        ros2,
        wheels,
        wine,
        debian,
        what,
        lacking,
        cure,
    ) = lines
    assert checker == "tests/typing: what pyright says is not tested, for it is not on this machine"
    assert how == f"to have it where Node.js is: {pyright.INSTALL}"
    assert page.startswith(
        "tests/browser: the page is not tried in a browser, for this machine lacks: chromium"
    )
    assert get == f"to have it on Debian 12, as root: {browser.INSTALL}"
    assert python == "tests/pyodide: Python in a browser is not tried, for this machine lacks npm"
    assert clients.startswith("tests/clients: ")
    assert clients.endswith("this machine lacks: roslib, ws")
    assert install == f"to have them where Node.js is: {bridge_clients.INSTALL}"
    assert dds == "tests/dds: Fast DDS and Cyclone DDS are not tried; this machine lacks: tshark"
    assert peers == f"to have them on Debian 12, as root: {dds_peers.INSTALL}"
    assert ros2 == "tests/interop: genuine ROS 2 is not tried; this machine lacks: rclpy of jazzy"
    assert wheels == f"to have it on Linux with x86_64: {ros2_wheels.INSTALL}"
    assert wine == "tests/windows: Windows's Python is not tried; this machine lacks: wine"
    assert debian == f"to have it on Debian 12, as root: {windows.INSTALL}"
    assert what == "tests/interop: genuine ROS 1 is not complete on this machine"
    assert lacking == "lacking: python3-rospy"
    assert cure.startswith("to have it on Debian 12, as root: apt-get install --no-install-recommends ")
    assert "collected" in last or "no tests" in last


def test_in_continuous_integration_it_is_an_error(run_without_genuine: Path) -> None:
    ended = run(run_without_genuine, "packages/pipros/tests/tree/test_support_genuine.py", CI="true")

    assert ended.returncode == pytest.ExitCode.USAGE_ERROR
    assert "genuine ROS 1 is needed here (CI is set) and lacks: python3-rospy" in ended.stderr


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
    (tmp_path / "conftest.py").write_text("from packages.conftest import pytest_runtest_makereport\n")
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
