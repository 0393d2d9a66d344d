"""The topics that packages of the core declare; those of navigation need its plugin."""

from __future__ import annotations

import pytest

from pipros.basics import plugin_table
from pipros_simulation.launch_sets.expected_robot import expected_robot
from pipros_tools.launch.xml import load

LAUNCH = """<launch>
  <node pkg="twist_mux" type="twist_mux" name="mux"><remap from="cmd_vel_out" to="base/cmd_vel"/></node>
  <node pkg="fake_localization" type="fake_localization" name="fake" ns="r"/>
  <node pkg="urg_node" type="urg_node" name="laser"/>
</launch>"""


def test_the_topics_of_programs_are_those_that_their_packages_declare() -> None:
    found = expected_robot(load([], texts=[LAUNCH]))

    assert found.topics == {"cmd_vel": "/base/cmd_vel", "base_pose_ground_truth": "/r/base_pose_ground_truth"}
    assert "topics of /laser (urg_node/urg_node); if one drives hardware, leave it out" in found.unknown


def test_programs_of_a_plugin_that_is_not_installed_are_named_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(plugin_table, "plugin_folders", dict)

    text = "\n".join(expected_robot(load([], texts=[LAUNCH])).unknown)

    assert "topics of a node: urg_node" in text
    assert "pipros-robot" in text
