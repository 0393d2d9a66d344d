"""The example is a plain Noetic package: genuine catkin builds it, and genuine ROS runs every step of it."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

from tests.support.catkin import CatkinWorkspace
from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem

PACKAGE = EXAMPLES / "composiv_tryouts"


def test_the_package_does_not_depend_on_pipros() -> None:
    files = [file for file in PACKAGE.rglob("*") if file.is_file() and file.suffix != ".pyc"]

    assert len(files) == 7
    assert [file for file in files if "pipros" in file.read_text().lower()] == []


def test_scripts_and_the_test_are_executable() -> None:
    scripts = sorted(PACKAGE.glob("*/*.py"))

    assert [file.name for file in scripts] == ["composiv_listener.py", "composiv_talker.py", "test_talker.py"]
    assert all(file.stat().st_mode & 0o111 for file in scripts)


def test_catkin_make_builds_it(catkin_workspace: CatkinWorkspace) -> None:
    generated = catkin_workspace.folder / "devel/lib/python3/dist-packages/composiv_tryouts/msg"

    assert "-- composiv_tryouts: 1 messages, 0 services" in catkin_workspace.log
    assert (generated / "_BatteryLevel.py").exists()


def test_rosmsg_shows_its_message(ros: RosSystem) -> None:
    shown = ros.genuine.run("rosmsg", "show", "composiv_tryouts/BatteryLevel")
    digest = ros.genuine.run("rosmsg", "md5", "composiv_tryouts/BatteryLevel")

    assert shown.stdout == ["string battery", ""]
    assert digest.stdout == ["cb6d55cbf4a366bc603a59ea79320b82"]


def test_talker_listener_and_test_run_by_rosrun(ros: RosSystem) -> None:
    ros.genuine.start_master()
    listener = ros.genuine.start("rosrun", "composiv_tryouts", "composiv_listener.py")
    talker = ros.genuine.start("rosrun", "composiv_tryouts", "composiv_talker.py")

    talker.wait_for(r"^\[INFO\] \[\d+\.\d+\]: %25$")
    listener.wait_for(r"^\[INFO\] \[\d+\.\d+\]: Battery level of vehicle: %25$")
    test = ros.genuine.run("rosrun", "composiv_tryouts", "test_talker.py")

    assert (
        "SyntaxWarning: The publisher should be created with an explicit keyword argument" in talker.stderr[0]
    )
    assert (test.returncode, test.stdout[1]) == (0, "[Testcase: test_talker_publishing] ... ok")


def test_roslaunch_runs_the_two_nodes_without_the_test(ros: RosSystem) -> None:
    launch = ros.genuine.start("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")

    launch.wait_for(r"process\[listener-\d+\]: started")
    launch.wait_for("Battery level of vehicle: %25")
    started = re.findall(r"process\[([a-z_]+)-?\d*\]: started", launch.output)
    launch.press_ctrl_c()

    assert launch.wait() == 0
    assert started == ["master", "rosout", "talker", "listener"]


def test_rostest_passes(ros: RosSystem) -> None:
    result = ros.genuine.run("rostest", "composiv_tryouts", "composiv_tryout.launch", timeout_s=120)

    assert result.returncode == 0, result.output
    assert "[composiv_tryouts.rosunit-test_talker/test_talker_publishing][passed]" in result.stdout
    assert _tests_in(ros.home / ".ros/test_results/composiv_tryouts/rosunit-test_talker.xml") == (1, 0)


def _tests_in(result_file: Path) -> tuple[int, int]:
    suite = ElementTree.parse(result_file).getroot()  # noqa: S314 - written by the run above
    return int(suite.attrib["tests"]), int(suite.attrib["failures"])
