"""The test nodes of the package rostest, each in rostest files that pass and that fail."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from tests.support.ros import RosSystem
from tests.support.rostest_nodes import ONLY_OURS, SCENES, Scene

ALL = SCENES + ONLY_OURS


@pytest.mark.parametrize("scene", ALL, ids=[f"{scene.node} {scene.params}" for scene in ALL])
def test_a_test_node_passes_or_says_what_it_missed(ros: RosSystem, scene: Scene) -> None:
    scene.write(ros.home / "ws")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(ros.home / "ws")

    run = ros.pipros.run("rostest", "around", "scene.test")

    assert run.returncode == (0 if scene.passes else 2), run.output
    assert scene.expected in run.output
    # The node around it may be ended before its imports are through, and says so on stderr.
    assert not any("Traceback" in line for line in run.stdout)
    results = ElementTree.parse(ros.home / ".ros/test_results/around/rosunit-scene.xml").getroot()  # noqa: S314
    assert scene.cases == tuple(
        (case.attrib["classname"], case.attrib["name"], len(case) == 0) for case in results.iter("testcase")
    )


def test_rospack_and_rosrun_know_the_test_nodes(ros: RosSystem) -> None:
    found = ros.pipros.run("rospack", "find", "rostest")
    assert found.returncode == 0
    assert found.stdout[0].endswith("/share/rostest")

    ros.pipros.start_master()
    ran = ros.pipros.run("rosrun", "rostest", "paramtest", "_param_name_target:=/run_id", "--text")

    assert ran.returncode == 0, ran.output
    assert ran.stderr[0].startswith("test_param")


def test_without_simulated_time_a_test_node_says_so_and_ends(ros: RosSystem) -> None:
    ros.pipros.start_master()
    ros.pipros.run("rosparam", "set", "/use_sim_time", "true")

    ran = ros.pipros.run("rosrun", "rostest", "paramtest", "_param_name_target:=/run_id")

    assert ran.returncode == 1
    assert "/use_sim_time is true, but no message came on /clock in 10 s" in ran.output
