"""ros_comm#2371, #2217: reading a launch file without its arguments raised an unexpected error."""

from __future__ import annotations

from pathlib import Path

import pytest

import roslaunch
import roslaunch.config

UNSET = '<arg name="a"/><arg name="b" default="$(arg a)"/><node pkg="rospy" type="x" name="n$(arg b)"/>'


@pytest.mark.parametrize("content", [UNSET, '<arg name="b" value="$(arg a)"/>'])
def test_an_argument_without_a_value_is_an_error_that_programs_catch(tmp_path: Path, content: str) -> None:
    file = tmp_path / "x.launch"
    file.write_text(f"<launch>{content}</launch>")
    with pytest.raises(roslaunch.RLException, match="requires the 'a' arg to be set"):
        roslaunch.config.load_config_default([str(file)], None)


def test_the_nodes_of_a_file_are_listed_without_its_arguments(tmp_path: Path) -> None:
    file = tmp_path / "x.launch"
    file.write_text(f"<launch>{UNSET}<node pkg='rospy' type='x' name='m'/></launch>")
    config = roslaunch.config.load_config_default([str(file)], None, ignore_unset_args=True)
    assert [node.name for node in config.nodes] == ["n", "m"]
