"""The test nodes of the package rostest, each in rostest files that pass and that fail."""

from collections.abc import Iterator
from pathlib import Path

import pytest

import pipros
from tests.support.ros import RosSystem
from tests.support.rostest_nodes import ONLY_OURS, SCENES, LevelSystem, Scene, cases_in

ALL = SCENES + ONLY_OURS


@pytest.fixture(scope="module")
def system(module_ros: RosSystem) -> Iterator[LevelSystem]:
    nodes = Path(pipros.__file__).parent / "share/rostest/nodes"
    system = LevelSystem(module_ros, module_ros.pipros, "python", nodes)
    yield system
    system.close()


@pytest.mark.parametrize("scene", ALL, ids=[f"{scene.node} {scene.params}" for scene in ALL])
def test_a_test_node_passes_or_reports_the_failure(system: LevelSystem, scene: Scene) -> None:
    ended, cases = system.run(scene, f"scene_{ALL.index(scene)}")

    assert ended.returncode == (0 if scene.passes else 1), ended.output
    assert scene.expected in ended.output
    assert "Traceback" not in ended.output
    assert cases == scene.cases


@pytest.mark.parametrize("scene", [SCENES[0], SCENES[-1]], ids=["passes", "fails"])
def test_rostest_runs_them_with_the_parameters_of_the_file(ros: RosSystem, scene: Scene) -> None:
    scene.write(ros.home / "ws")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(ros.home / "ws")

    run = ros.pipros.run("rostest", "around", "scene.test")

    assert run.returncode == (0 if scene.passes else 2), run.output
    assert scene.expected in run.output
    # The surrounding node may be ended during its imports, with a traceback on stderr.
    assert not any("Traceback" in line for line in run.stdout)
    assert scene.cases == cases_in(ros.home / ".ros/test_results/around/rosunit-scene.xml")


def test_rospack_and_rosrun_find_the_test_nodes(ros: RosSystem) -> None:
    found = ros.pipros.run("rospack", "find", "rostest")
    assert found.returncode == 0
    assert found.stdout[0].endswith("/share/rostest")

    ros.serve_master()
    ran = ros.pipros.run("rosrun", "rostest", "paramtest", "_param_name_target:=/run_id", "--text")

    assert ran.returncode == 0, ran.output
    assert ran.stderr[0].startswith("test_param")


WITHOUT_CLOCK = {
    "paramtest _param_name_target:=/run_id": True,
    "hztest _topic:=/silent _hz:=0 _test_duration:=0.1 _wait_time:=0.1 _wall_clock:=true": True,
    "hztest _topic:=/silent _hz:=0 _test_duration:=0.1 _wait_time:=0.1": False, "publishtest": False,
}  # fmt: skip
"""Whether test nodes pass although simulated time does not run, as in Noetic."""


@pytest.mark.parametrize("command", WITHOUT_CLOCK)
def test_a_test_node_that_needs_simulated_time_reports_that_and_exits(ros: RosSystem, command: str) -> None:
    ros.serve_master()
    ros.pipros.run("rosparam", "set", "/use_sim_time", "true")
    ros.pipros.run("rosparam", "set", "/run_id", "a-test")

    ran = ros.pipros.run("rosrun", "rostest", *command.split())

    passes = WITHOUT_CLOCK[command]
    assert ran.returncode == (0 if passes else 1), ran.output
    late = "/use_sim_time is true, but no message arrived on /clock within 10 s"
    assert (late in ran.output) != passes
