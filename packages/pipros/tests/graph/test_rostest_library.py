"""rostest as a library: the unittest class of a launch file, and a launch for tests."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.support.programs import make_programs
from tests.support.ros import RosSystem

FILE = """<launch>
  <node pkg="programs" type="sleeper" name="s"/>
  <test pkg="programs" type="cases.py" test-name="aa"/>
  <test pkg="programs" type="nope" test-name="bb"/>
</launch>"""

CASES = f"""#!{sys.executable}
import unittest, rosunit
class Cases(unittest.TestCase):
    def test_one(self): pass
    def test_two(self): self.fail("no")
rosunit.unitrun("programs", "cases", Cases)
"""

CREATE = """
import rostest.runner, sys, unittest
kind = rostest.runner.createUnitTest("programs", sys.argv[1])
result = unittest.TestResult()
unittest.TestLoader().loadTestsFromTestCase(kind)(result)
results = rostest.runner.getResults()
print(">", result.testsRun, [test.id().rpartition(".")[2] for test, _ in result.failures])
print(">", results.num_tests, results.num_failures, [case.name for case in results.test_case_results])
print(">", [test.test_name for test in rostest.runner.getConfig().tests])
"""

PARENT = """
import roslaunch.config, roslaunch.core, rostest.rostest_parent, sys
config = roslaunch.config.load_config_default([sys.argv[1]], None)
parent = rostest.rostest_parent.ROSTestLaunchParent(config, [sys.argv[1]])
parent.setUp()
started, failed = parent.launch()
print(">", started, failed, parent.master.is_running())
slow = roslaunch.core.Test("t", "programs", "sleeper", "t", time_limit=0.2)
for test in (config.tests[1], slow):
    try:
        parent.run_test(test)
    except roslaunch.core.RLException as error:
        print(">", error)
master = parent.master
parent.tearDown()
print(">", master.is_running())
"""


@pytest.fixture
def package(ros: RosSystem) -> Path:
    programs = {"sleeper": "#!/bin/sh\nexec sleep 1000\n", "cases.py": CASES}
    folder = make_programs(ros.home / "src" / "programs", programs)
    (folder / "t.test").write_text(FILE)
    return folder


def run(ros: RosSystem, package: Path, script: str) -> list[str]:
    ended = ros.pipros.run(
        sys.executable, "-c", script, package / "t.test", ROS_PACKAGE_PATH=str(package.parent)
    )
    assert ended.returncode == 0, ended.output
    return [line[2:] for line in ended.stdout if line.startswith("> ")]


def test_a_launch_file_becomes_a_class_of_cases(ros: RosSystem, package: Path) -> None:
    assert run(ros, package, CREATE) == [
        "2 ['testbb']",
        "2 1 ['programs.rosunit-aa/test_one', 'programs.rosunit-aa/test_two']",
        "['aa', 'bb']",
    ]


def test_a_launch_for_tests_has_a_master_and_time_limits(ros: RosSystem, package: Path) -> None:
    assert run(ros, package, PARENT) == [
        "['s-1'] [] True",
        "test [bb] failed to launch",
        "max time [0.2s] allotted for test [t] of type [programs/sleeper]",
        "False",
    ]
