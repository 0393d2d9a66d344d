"""Scripts of ROS 1 and ROS 2, and the variables that ROS 2's wheels set."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from pipros_workspace.client_library import beside_ros2, is_ros1_script, without_libraries

GUARD = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"


@pytest.mark.parametrize(("text", "is_ros1"), [
    ("import rospy\n", True), ("import os, rospy as ros\n", True),
    ("    from rospy.topics import Publisher\n", True),
    ("import rclpy\nfrom rclpy.node import Node\n", False), ("import sys, rclpy.qos\n", False),
    ("import rospy\nimport rclpy\n", False),
    ("import rospy_helpers\n# import rclpy\n", False),
    ("text = 'from rclpy'\n", False), ("\udcff\n", False),
])  # fmt: skip
def test_scripts_of_ros1_import_rospy_and_not_rclpy(tmp_path: Path, text: str, is_ros1: bool) -> None:
    script = tmp_path / "node.py"
    script.write_bytes(text.encode("utf-8", "surrogateescape"))
    assert is_ros1_script(script) is is_ros1


def test_a_script_that_cannot_be_read_is_not_of_ros1(tmp_path: Path) -> None:
    assert not is_ros1_script(tmp_path)
    assert not is_ros1_script(tmp_path / "gone")


def test_libraries_of_this_environment_are_removed_and_others_stay() -> None:
    own = f"{sys.prefix}/lib"
    assert without_libraries({GUARD: "1", "LD_LIBRARY_PATH": own, "A": "b"}) == {"A": "b"}
    both = {GUARD: "1", "LD_LIBRARY_PATH": os.pathsep.join((own, "/opt/lib"))}
    assert without_libraries(both) == {"LD_LIBRARY_PATH": "/opt/lib"}
    assert without_libraries({"LD_LIBRARY_PATH": own}) == {"LD_LIBRARY_PATH": own}


def test_only_scripts_of_rospy_in_this_environment_get_the_names_of_ros1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "node.py"
    script.write_text("import rospy\n")
    variables = {GUARD: "1", "LD_LIBRARY_PATH": f"{sys.prefix}/lib"}
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    assert beside_ros2(script, sys.executable, variables) == variables
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
    assert beside_ros2(script, sys.executable, variables) == {"PIPROS_MESSAGES": "ros1", **variables}
    chosen = {**variables, "PIPROS_MESSAGES": "ros2"}
    assert beside_ros2(script, sys.executable, chosen) == chosen
    assert beside_ros2(script, "/usr/bin/python3", variables) == {}
    assert beside_ros2(script, None, variables) == {}
