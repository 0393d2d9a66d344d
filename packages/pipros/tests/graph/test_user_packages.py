"""Packages written for Noetic from the public description of its libraries run unchanged."""

from __future__ import annotations

from tests.support import errand
from tests.support.patrol import PACKAGES, SAID
from tests.support.ros import RosSystem


def test_a_robot_with_actions_and_transforms_patrols(ros: RosSystem) -> None:
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(PACKAGES)

    launched = ros.pipros.run(
        "roslaunch", "patrol", "patrol.launch", "-p", str(ros.port), "--screen", timeout_s=120
    )

    found = [line.partition("] ")[2] if line.startswith("[patrol-") else line for line in launched.stdout]
    assert [line for line in found if line in SAID] == SAID, launched.output


def test_a_state_machine_runs_an_errand(ros: RosSystem) -> None:
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(PACKAGES)

    launched = ros.pipros.run(
        "roslaunch", "state_machines", "errand.launch", "-p", str(ros.port), "--screen", timeout_s=120
    )

    assert [line for line in launched.stdout if line in errand.SAID] == errand.SAID, launched.output
