"""The packages of users that tests/graph runs, with half of their nodes on genuine ROS."""

from __future__ import annotations

import os

import pytest

from tests.support.patrol import PACKAGES, SAID
from tests.support.ros import RosSystem


@pytest.mark.parametrize(
    ("base", "patrol"), [("pipros", "genuine"), ("genuine", "pipros"), ("genuine", "genuine")]
)
def test_a_robot_with_actions_and_transforms_goes_on_patrol(
    plain_ros: RosSystem, base: str, patrol: str
) -> None:
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}
    for side in sides.values():
        paths = (str(PACKAGES), side.environment["ROS_PACKAGE_PATH"])
        side.environment["ROS_PACKAGE_PATH"] = os.pathsep.join(paths)
    plain_ros.serve_master()

    sides[base].start("rosrun", "patrol", "base.py")
    ended = sides[patrol].run("rosrun", "patrol", "patrol.py", timeout_s=120)

    assert ended.stdout == SAID, ended.output
