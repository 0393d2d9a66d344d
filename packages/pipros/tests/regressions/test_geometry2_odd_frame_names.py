"""geometry2: one frame with an odd name, and tools could not read or draw the whole tree."""

from __future__ import annotations

import shutil
import subprocess

import pytest
import yaml
from geometry_msgs.msg import TransformStamped

import rospy
import tf2_ros

NAMES = [
    *("cart: left", "joe's robot", 'arm "b"', "a\\b", "1", "-", "no", "Null", "~", "1e3", "{x}", "# c"),
    *("a\nb", "küche", "robot1/base_link", "base.link-2", "🤖", " gap ", "*x", "2020-01-01", "."),
]


@pytest.fixture
def buffer() -> tf2_ros.BufferCore:
    made = tf2_ros.BufferCore(rospy.Duration(10))
    for parent, child in zip(["map", *NAMES], NAMES, strict=False):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.transform.rotation.w = parent, 1.0
        made.set_transform(transform, "/it's")
    return made


def test_the_yaml_of_all_frames_has_each_name(buffer: tf2_ros.BufferCore) -> None:
    text = buffer.all_frames_as_yaml()
    rows = yaml.safe_load(text)
    assert list(rows) == NAMES
    assert [row["parent"] for row in rows.values()] == ["map", *NAMES[:-1]]
    assert {row["broadcaster"] for row in rows.values()} == {"/it's"}
    assert "\nrobot1/base_link: \n  parent: 'küche'\n" in text  # as in tf2


def test_graphviz_draws_each_name(buffer: tf2_ros.BufferCore) -> None:
    text = buffer._allFramesAsDot()
    assert '"joe\'s robot" -> "arm \\"b\\""[' in text
    assert '"arm \\"b\\"" -> "a\\\\b"[' in text
    if dot := shutil.which("dot"):
        subprocess.run([dot, "-Tplain"], input=text.encode(), stdout=subprocess.DEVNULL, check=True)
