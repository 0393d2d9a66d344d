"""The tools for packages: launch files are shown, and nothing else is opened or started."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.assistants import LocalAssistant

SECRET = "the content of another file"  # noqa: S105
LAUNCH = """<launch>
  <include file="$(find robot)/../secret.launch"/>
  <include file="package://robot/../secret.launch"/>
  <param name="command" command="touch TOUCHED"/>
  <node pkg="robot" type="x" name="x" output="$(eval __import__('os'))"/>
  <param name="mesh" value="file:///etc/passwd"/>
</launch>
"""


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    package = tmp_path / "src" / "robot"
    (package / "launch").mkdir(parents=True)
    manifest = "<package format='2'><name>robot</name><version>1.0.0</version><description>d</description>"
    manifest += "<maintainer email='m@example.org'>m</maintainer><license>none</license></package>"
    (package / "package.xml").write_text(manifest)
    (package / "launch" / "up.launch").write_text(LAUNCH.replace("TOUCHED", str(tmp_path / "touched")))
    (package / "mesh.stl").write_text(SECRET)
    (tmp_path / "src" / "secret.launch").write_text(SECRET)
    (package / "launch" / "out.launch").symlink_to(tmp_path / "src" / "secret.launch")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    return tmp_path


@pytest.fixture
def assistant(workspace: Path) -> LocalAssistant:
    return LocalAssistant("http://127.0.0.1:1")


def test_launch_files_are_shown_but_not_evaluated(assistant: LocalAssistant, workspace: Path) -> None:
    assert "robot" in str(assistant.call("list_packages").text)
    assert assistant.call("list_launch_files", package="robot").data == ["launch/up.launch"]
    reply = assistant.call("read_launch_file", package="robot", file="launch/up.launch")
    assert reply.data[0] == "<launch>"
    assert len(reply.data) == len(LAUNCH.splitlines())
    assert SECRET not in reply.text
    assert not (workspace / "touched").exists()


@pytest.mark.parametrize("file", [
    "../secret.launch", "launch/../../secret.launch", "launch/out.launch",
    "package://robot/../secret.launch", "$(find robot)/../secret.launch", "/etc/passwd", "mesh.stl",
    "package://robot/mesh.stl", "package.xml",
])  # fmt: skip
def test_other_files_are_refused(assistant: LocalAssistant, file: str) -> None:
    reply = assistant.call("read_launch_file", package="robot", file=file)
    assert reply.is_error
    assert SECRET not in reply.text


@pytest.mark.parametrize("package", ["..", "../src", "robot/launch", "/etc", "nothing", "$(find robot)"])
def test_other_folders_are_refused(assistant: LocalAssistant, package: str) -> None:
    assert assistant.call("list_launch_files", package=package).is_error
