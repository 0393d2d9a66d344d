"""Pipes and devices in place of untrusted files never block, and are not read into memory."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from pipros.basics.input_file import read_file, read_text
from tests.support.processes import Process
from tests.support.ros import RosSystem

pytestmark = pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="needs /dev/zero")

KINDS = ["pipe", "device", "link to a device"]


def plant(path: Path, kind: str) -> str:
    """Put a pipe or a device at the path, and return the path."""
    if kind == "device":
        return "/dev/zero"
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    return str(path)


@pytest.fixture
def source(ros: RosSystem) -> Path:
    """A folder with one good package, on ROS_PACKAGE_PATH."""
    folder = ros.home / "src"
    (folder / "good" / "msg").mkdir(parents=True)
    (folder / "good" / "package.xml").write_text("<package><name>good</name></package>")
    (folder / "good" / "msg" / "Plain.msg").write_text("int8 a\n")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    return folder


def run(ros: RosSystem, *argv: str) -> Process:
    """Run a tool that would not end, or exhaust this memory, if it read the planted file."""
    return ros.pipros.run("sh", "-c", 'ulimit -v 2000000; exec "$@"', "sh", *argv)


@pytest.mark.parametrize("kind", ["pipe", "link to a device"])
def test_a_manifest_that_is_not_a_file_is_not_a_package(ros: RosSystem, source: Path, kind: str) -> None:
    (source / "bad").mkdir()
    plant(source / "bad" / "package.xml", kind)

    found = run(ros, "rospack", "find", "good")
    missing = run(ros, "rosversion", "bad")
    listed = run(ros, "rosmsg", "packages")

    assert (found.returncode, found.stdout) == (0, [str(source / "good")])
    assert missing.returncode == 1
    assert "good" in listed.stdout


@pytest.mark.parametrize("kind", ["pipe", "link to a device"])
def test_a_definition_that_is_not_a_file_is_not_a_message(ros: RosSystem, source: Path, kind: str) -> None:
    plant(source / "good" / "msg" / "Bad.msg", kind)

    shown = run(ros, "rosmsg", "show", "good/Bad")
    plain = run(ros, "rosmsg", "show", "good/Plain")

    assert shown.returncode == 1
    assert plain.stdout[:1] == ["int8 a"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "content",
    [
        "<include file='{}'/>",
        "<rosparam file='{}'/>",
        "<param name='x' textfile='{}'/>",
        "<param name='x' binfile='{}'/>",
    ],
)
def test_a_launch_file_cannot_read_a_device(ros: RosSystem, content: str, kind: str) -> None:
    path = plant(ros.home / "planted", kind)
    file = ros.home / "x.launch"
    file.write_text(f"<launch>{content.format(path)}</launch>")

    loaded = run(ros, "roslaunch", "--nodes", str(file))

    assert loaded.returncode == 1
    assert f"cannot read [{path}]: it is not a regular file" in loaded.output


def test_the_output_of_a_command_in_a_launch_file_has_a_limit(ros: RosSystem) -> None:
    file = ros.home / "x.launch"
    file.write_text("<launch><param name='x' command='cat /dev/zero'/></launch>")

    loaded = ros.pipros.run("roslaunch", "--nodes", file, PIPROS_LIMITS="file_bytes=1000")

    assert loaded.returncode == 1
    assert "printed more than 1000 bytes" in loaded.output


@pytest.mark.parametrize(
    "command",
    ["sleep 30", "sh -c 'sleep 30 &amp; echo $! &gt; pid'", "sh -c 'exec &gt;&amp;-; exec sleep 30'"],
)
def test_a_command_in_a_launch_file_has_a_time_limit(ros: RosSystem, command: str) -> None:
    file = ros.home / "x.launch"
    file.write_text(f'<launch>\n<param name="x" command="{command}"/></launch>')

    loaded = ros.pipros.run("roslaunch", "--nodes", file, PIPROS_LIMITS="launch_command_s=0.1")

    if (started := ros.home / "pid").exists():  # keeps the pipe open
        os.kill(int(started.read_text()), signal.SIGKILL)
    assert loaded.returncode == 1
    assert f"{file}:2" in loaded.output
    assert "did not end in time, so it was ended: the limit is 0.1 (launch_command_s" in loaded.output


def test_results_of_tests_that_are_not_files_are_skipped(ros: RosSystem) -> None:
    results = ros.home / "results"
    results.mkdir()
    plant(results / "a.xml", "pipe")
    plant(results / "b.xml", "link to a device")

    counted = run(ros, "catkin_test_results", str(results))

    assert (counted.returncode, counted.stdout) == (0, ["Summary: 0 tests, 0 errors, 0 failures, 0 skipped"])


def test_a_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"a\r\nb\n")

    assert read_file(file, 5) == b"a\r\nb\n"
    assert read_text(file, 5) == "a\nb\n"
    with pytest.raises(OSError, match="it is larger than 4 bytes"):
        read_file(file, 4)
