"""`catkin_make run_tests` and `catkin_test_results`: the tests declared by a package."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from pipros_tools.testing.script_runner import main as run_unittests
from tests.support.ros import RosSystem

MANIFEST = """<package format="2"><name>pkg</name><version>0.0.1</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>none</license>
<buildtool_depend>catkin</buildtool_depend><test_depend>rostest</test_depend>
<test_depend>roslaunch</test_depend></package>"""
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(pkg)
find_package(catkin REQUIRED)
catkin_package()
if(CATKIN_ENABLE_TESTING)
  find_package(rostest REQUIRED)
  find_package(roslaunch REQUIRED)
  add_rostest(test/ready.test ARGS value:=25)
  catkin_add_nosetests(test/test_unit.py)
  roslaunch_add_file_check(launch IGNORE_UNSET_ARGS)
endif()
"""
READY = """<launch>
<arg name="value"/><param name="/ready" value="$(arg value)"/>
<test test-name="is_ready" pkg="rostest" type="paramtest">
<rosparam>{param_name_target: /ready, param_value_expected: 25, test_duration: 0.2}</rosparam></test>
</launch>"""
UNIT = """import unittest

class Sums(unittest.TestCase):
    def test_sum(self):
        self.assertEqual(1 + 1, 2)

    def test_wrong_sum(self):
        self.assertEqual(1 + 1, SUM)
"""
# as in Noetic, nodes after an argument without a value are not looked up
LAUNCH = '<launch><node name="n" pkg="pkg" type="{}"/><arg name="x"/></launch>'


@pytest.fixture
def workspace(ros: RosSystem) -> Path:
    base = ros.home / "ws"
    write(base, "package.xml", MANIFEST)
    write(base, "CMakeLists.txt", CMAKE)
    write(base, "test/ready.test", READY)
    write(base, "test/test_unit.py", UNIT.replace("SUM", "2"))
    write(base, "launch/nodes.launch", LAUNCH.format("node.py"))
    write(base, "node.py", "#!/usr/bin/env python3\n")
    (base / "src/pkg/node.py").chmod(0o755)
    del ros.pipros.environment["ROS_PACKAGE_PATH"]
    return base


def write(workspace: Path, name: str, content: str) -> None:
    file = workspace / "src/pkg" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(content)


def test_launch_tests_unit_tests_and_checks_all_leave_results(ros: RosSystem, workspace: Path) -> None:
    made = ros.pipros.run("catkin_make", "-C", workspace, "run_tests", timeout_s=120)

    assert made.returncode == 0, made.output
    results = workspace / "build/test_results"
    assert sorted(file.name for file in (results / "pkg").iterdir()) == [
        "nosetests-test.test_unit.py.xml",
        "roslaunch-check_launch.xml",
        "rostest-ready__value_25.xml",
        "rosunit-is_ready.xml",
    ]
    summed = ros.pipros.run("catkin_test_results", results)
    assert summed.returncode == 0, summed.output
    assert summed.stdout[-1].startswith("Summary: 5 tests, 0 errors, 0 failures")


def test_failures_are_named_by_catkin_test_results(ros: RosSystem, workspace: Path) -> None:
    write(workspace, "test/ready.test", READY.replace("expected: 25", "expected: 26"))
    write(workspace, "test/test_unit.py", UNIT.replace("SUM", "3"))
    write(workspace, "launch/nodes.launch", LAUNCH.format("gone.py"))

    made = ros.pipros.run("catkin_make", "-C", workspace, "run_tests_pkg", timeout_s=120)

    assert made.returncode == 0, made.output
    summed = ros.pipros.run("catkin_test_results", workspace / "build/test_results")
    assert summed.returncode == 1
    assert summed.stdout[-1].startswith("Summary: 5 tests, 0 errors, 3 failures")
    assert "cannot find node [gone.py] in package [pkg]" in made.output


def test_unit_tests_run_without_pytest_too(tmp_path: Path) -> None:
    (tmp_path / "test_sums_of_a_folder.py").write_text(UNIT.replace("SUM", "3"))
    results = tmp_path / "results.xml"

    assert run_unittests([str(tmp_path), str(results)]) == 1

    suite = ElementTree.parse(results).getroot()  # noqa: S314
    assert (suite.attrib["tests"], suite.attrib["failures"]) == ("2", "1")
