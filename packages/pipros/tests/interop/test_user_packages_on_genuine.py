"""The realistic packages of tests.graph, with half of their nodes on genuine ROS."""

from __future__ import annotations

import os

import pytest

from tests.support import errand
from tests.support.patrol import PACKAGES, SAID
from tests.support.ros import RosSystem, Side

PAIRS = [("pipros", "genuine"), ("genuine", "pipros"), ("genuine", "genuine")]


@pytest.mark.timeout(300)
@pytest.mark.parametrize(("base", "patrol"), PAIRS)
def test_a_robot_with_actions_and_transforms_patrols(plain_ros: RosSystem, base: str, patrol: str) -> None:
    sides = with_packages(plain_ros)
    plain_ros.serve_master()

    sides[base].start("rosrun", "patrol", "base.py")
    ended = sides[patrol].run("rosrun", "patrol", "patrol.py", timeout_s=120)

    assert ended.stdout == SAID, ended.output


@pytest.mark.timeout(300)
@pytest.mark.parametrize(("world", "machine"), PAIRS)
def test_a_state_machine_runs_an_errand(plain_ros: RosSystem, world: str, machine: str) -> None:
    sides = with_packages(plain_ros)
    # Genuine ROS finds Python code in built packages only.
    sides["genuine"].environment["PYTHONPATH"] = str(errand.SOURCES)
    plain_ros.serve_master()

    sides[world].start("rosrun", "state_machines", "world.py")
    ended = sides[machine].run("rosrun", "state_machines", "errand.py", timeout_s=120)

    assert [line for line in ended.stdout if line in errand.SAID] == errand.SAID, ended.output


def with_packages(ros: RosSystem) -> dict[str, Side]:
    """Return both sides by name, with the packages on their paths."""
    sides = {"pipros": ros.pipros, "genuine": ros.genuine}
    for side in sides.values():
        paths = (str(PACKAGES), side.environment["ROS_PACKAGE_PATH"])
        side.environment["ROS_PACKAGE_PATH"] = os.pathsep.join(paths)
    return sides
