"""Each setting of nodes is read from launch files, and passes through `roslaunch.core` unchanged.

No reader and no facade lists the settings: one that is added to `LaunchNode` passes, too.
"""

from __future__ import annotations

import pytest

from pipros_tools.launch.model import NODE_SETTINGS, LaunchNode, NodeSetting
from pipros_tools.launch.xml import load
from roslaunch.core import Node


@pytest.mark.parametrize("setting", [each for each in NODE_SETTINGS if each.xml], ids=lambda each: each.xml)
def test_each_setting_is_read_and_passes_through_the_library(setting: NodeSetting) -> None:
    text = {bool: "true", float: "2.5"}.get(type(setting.default), "sample")
    choices = [each.value for each in setting.choices or ()]
    attributes = {"pkg": "p", "type": "t", "name": "n", setting.xml: [text, *choices][-1]}
    written = " ".join(f"{name}='{value}'" for name, value in attributes.items())
    node = f"<node {written}><remap from='a' to='b'/><env name='A' value='1'/></node>"
    launch = load([], texts=[f"<launch><arg name='ros2_python' default='python'/>{node}</launch>"])

    found = launch.nodes[0]
    kept = Node.from_model(found).to_model()
    usual = getattr(LaunchNode("p", "t", "n"), setting.field)
    assert usual is None or isinstance(getattr(found, setting.field), type(usual))
    assert getattr(found, setting.field) != usual
    assert (kept, kept.place, launch.warnings) == (found, found.place, ())
