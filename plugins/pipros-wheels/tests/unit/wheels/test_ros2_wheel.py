"""`pipros wheel --ros2`, which `pipros_ros2` translates for, where something is missing.

# needs the rooms: ros2
"""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros_wheels.commands.wheel import main


def test_one_line_says_which_compiler_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("CXX", raising=False)

    assert main(["--ros2", "jazzy", "tf2_msgs"]) == 1

    assert capsys.readouterr().err == (
        "pipros wheel: messages for rclpy need a C and a C++ compiler; "
        "on Debian and Ubuntu: apt-get install g++ python3-dev\n"
    )


def test_an_unknown_package_is_named_before_anything_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for variable in ("CC", "CXX"):
        monkeypatch.setenv(variable, "/bin/true")
    monkeypatch.setenv("ROS_HOME", str(tmp_path))

    assert main(["--ros2", "kilted", "-o", str(tmp_path / "dist"), "no_such_msgs"]) == 1

    assert "there is no package no_such_msgs" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
