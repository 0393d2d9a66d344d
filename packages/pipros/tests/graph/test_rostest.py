"""rostest with real nodes and masters, as a command, as a library, and run by catkin_make."""

import signal
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

import rostest
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros_tools.testing.script_runner import main as run_unittests
from tests.support.environments import REPOSITORY
from tests.support.programs import make_programs
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# rostest with real nodes and masters: start, supervision, interruption and clean-up.


TEST = """#!/usr/bin/env python3
import os, unittest
import rostest, rospy
from tests.support.waiting import wait_until

class T(unittest.TestCase):
    def test_it(self):
        {body}

if __name__ == "__main__":
    rostest.rosrun("pkg", "t", T)
"""
STAYS = "#!/usr/bin/env python3\nimport signal\nsignal.pause()\n"
ENDS = "#!/usr/bin/env python3\nimport os\nopen(os.environ['ENDED'], 'a').write('ended\\n')\n"
WAITS = "open('started', 'w').close(); import signal; signal.pause()"


@pytest.fixture
def package(ros: RosSystem) -> Path:
    folder = ros.home / "ws" / "pkg"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>pkg</name></package>")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder.parent)
    ros.pipros.environment["PYTHONPATH"] = str(REPOSITORY)
    write(folder, "stays.py", STAYS)
    write(folder, "ends.py", ENDS)
    return folder


def write(package: Path, name: str, content: str) -> None:
    (package / name).write_text(content)
    (package / name).chmod(0o755)


def write_test(package: Path, body: str, *, nodes: str = "", attributes: str = "") -> None:
    write(package, "t.py", TEST.format(body=body))
    test = f'<test test-name="t" pkg="pkg" type="t.py" {attributes}/>'
    write(package, "t.test", f"<launch>{nodes}{test}</launch>")


def test_arguments_of_the_command_line_reach_the_launch_file(ros: RosSystem, package: Path) -> None:
    write(package, "t.py", TEST.format(body="self.assertEqual(rospy.get_param('/level'), 25)"))
    write(
        package,
        "t.test",
        '<launch><arg name="level"/><param name="level" value="$(arg level)"/>'
        '<test test-name="t" pkg="pkg" type="t.py"/></launch>',
    )

    assert ros.pipros.run("rostest", "pkg", "t.test", "level:=25").returncode == 0
    unset = ros.pipros.run("rostest", "pkg", "t.test")
    unset.check(1, "requires the 'level' arg to be set")


@pytest.mark.parametrize(
    ("attributes", "name"),
    [('name="a"', "/a"), ('name="a" ns="deep"', "/deep/a"), ('name=""', "/t"), ("", "/t")],
)
def test_the_name_of_a_test_is_that_of_its_node_and_test_name_that_of_its_results(
    ros: RosSystem, package: Path, attributes: str, name: str
) -> None:
    body = (
        f"rospy.init_node('own'); self.assertEqual((rospy.get_name(), rospy.get_param('~p')), ({name!r}, 5))"
    )
    write(package, "t.py", TEST.format(body=body))
    param = '<param name="p" value="5"/>'
    write(
        package, "t.test",
        f'<launch><test test-name="t" pkg="pkg" type="t.py" {attributes}>{param}</test></launch>',
    )  # fmt: skip
    ended = ros.pipros.run("rostest", "pkg", "t.test")
    assert ended.returncode == 0, ended.output
    assert list(Path(ros.pipros.environment["ROS_HOME"]).rglob("rosunit-t.xml"))


def test_two_runs_at_once_do_not_see_each_other(ros: RosSystem, package: Path) -> None:
    write_test(
        package,
        "name = os.environ['NAME']; rospy.set_param('/name', name); open(f'../{name}', 'w').close(); "
        "wait_until(lambda: os.path.exists('../a') and os.path.exists('../b')); "
        "self.assertEqual(rospy.get_param('/name'), name)",
    )

    runs = [
        ros.pipros.start("rostest", "pkg", "t.test", ROS_HOME=str(ros.home / f"home_{name}"), NAME=name)
        for name in "ab"
    ]

    assert [run.wait() for run in runs] == [0, 0], [run.output for run in runs]


def test_a_respawning_node_is_restarted_while_the_test_runs(ros: RosSystem, package: Path) -> None:
    ended = ros.home / "ended"
    write_test(
        package,
        f"wait_until(lambda: open({str(ended)!r}).read().count('ended') >= 3)",
        nodes='<node name="n" pkg="pkg" type="ends.py" respawn="true">'
        f'<env name="ENDED" value="{ended}"/></node>',
    )
    ended.touch()

    run = ros.pipros.run("rostest", "pkg", "t.test")

    assert run.returncode == 0, run.output


def test_the_end_of_a_required_node_fails_the_test(ros: RosSystem, package: Path) -> None:
    write_test(
        package,
        WAITS,
        nodes='<node name="n" pkg="pkg" type="ends.py" required="true">'
        '<env name="ENDED" value="/dev/null"/></node>',
    )

    run = ros.pipros.run("rostest", "pkg", "t.test")

    assert run.returncode == 1
    assert "FAILURE: a required node exited before the test [t] ended" in run.stdout
    assert " * ERRORS: 0" in run.stdout


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_everything_and_does_not_look_like_a_passed_one(ros, package, how) -> None:
    write_test(package, WAITS, nodes='<node name="n" pkg="pkg" type="stays.py"/>')
    run = ros.pipros.start("rostest", "pkg", "t.test")
    wait_until((ros.home / ".ros/started").exists, 60, "the test to run")

    run.send_signal(how)
    assert run.wait() == 130
    assert "SUCCESS" not in run.output
    assert run.stderr[-1] == "rostest was interrupted: no results"
    assert not list((ros.home / ".ros/test_results").rglob("rostest-*.xml"))
    ros.pipros.processes.assert_nothing_left()


def test_a_retry_passes_on_a_fresh_master(ros: RosSystem, package: Path) -> None:
    first = ros.home / "first"
    write_test(
        package,
        f"is_first = not os.path.exists({str(first)!r}); open({str(first)!r}, 'w').close(); "
        "self.assertFalse(rospy.has_param('/left')); rospy.set_param('/left', 1); self.assertFalse(is_first)",
        attributes='retry="1"',
    )

    run = ros.pipros.run("rostest", "pkg", "t.test")

    assert run.returncode == 0, run.output
    assert " * TESTS: 1" in run.stdout


def test_a_master_is_reused_with_and_without_parameters_of_others(ros: RosSystem, package: Path) -> None:
    write_test(package, "self.assertEqual(rospy.get_param('/of_others', 'none'), os.environ['EXPECTED'])")
    with Master(host="127.0.0.1", port=ros.port) as master:
        client = MasterClient(master.uri, "/a_test")
        client.set_param("/of_others", "kept")
        client.set_param("/run_id", "the-run")

        kept = ros.pipros.run("rostest", "-r", "pkg", "t.test", EXPECTED="kept")
        cleared = ros.pipros.run("rostest", "-r", "-c", "pkg", "t.test", EXPECTED="none")

        assert (kept.returncode, cleared.returncode) == (0, 0), kept.output + cleared.output
        assert client.get_param("/run_id") == "the-run"
        client.close()


def test_a_folder_for_results_that_cannot_be_written_is_named(ros: RosSystem, package: Path) -> None:
    write_test(package, "pass")
    blocked = ros.home / "blocked"
    blocked.write_text("a file, no folder")

    run = ros.pipros.run("rostest", "pkg", "t.test", ROS_TEST_RESULTS_DIR=str(blocked))

    assert run.returncode == 1
    assert str(blocked) in run.stderr[-1]
    assert "Traceback" not in run.output


def test_a_file_outside_of_packages_needs_a_package_for_its_results(ros: RosSystem, package: Path) -> None:
    write_test(package, "pass")
    outside = ros.home / "outside.test"
    outside.write_text((package / "t.test").read_text())

    refused = ros.pipros.run("rostest", str(outside))
    named = ros.pipros.run("rostest", "--package=pkg", f"--pkgdir={package}", str(outside))

    assert refused.returncode == 1
    assert "is not inside a ROS package" in refused.stderr[-1]
    assert named.returncode == 0
    name = str(outside.with_suffix("")).replace("/", "_")  # as genuine rostest names it
    assert (ros.home / f".ros/test_results/pkg/rostest-{name}.xml").exists()


def test_publishers_and_subscribers_can_be_queried(monkeypatch: pytest.MonkeyPatch) -> None:
    with Master(host="127.0.0.1", port=0) as master:
        monkeypatch.setenv("ROS_MASTER_URI", master.uri)
        client = MasterClient(master.uri, "/robot/talker")
        client.register_publisher("/level", "std_msgs/String", "http://127.0.0.1:1/")
        client.close()

        assert rostest.is_publisher("/level", "/robot/talker")
        assert rostest.is_publisher("level", "robot/talker")
        assert not rostest.is_publisher("/level", "/other")
        assert not rostest.is_publisher("/other", "/robot/talker")
        assert not rostest.is_subscriber("/level", "/robot/talker")
        with rostest.get_master() as proxy:
            assert proxy.getPid("/a_test")[0] == 1


def test_without_a_master_queries_fail() -> None:
    with pytest.raises(ConnectionError, match="roscore"):
        rostest.is_publisher("/level", "/talker")


# rostest as a library: the unittest class of a launch file, and a launch for tests.


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
def library_package(ros: RosSystem) -> Path:
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


def test_a_launch_file_becomes_a_class_of_cases(ros: RosSystem, library_package: Path) -> None:
    assert run(ros, library_package, CREATE) == [
        "2 ['testbb']", "2 1 ['programs.rosunit-aa/test_one', 'programs.rosunit-aa/test_two']",
        "['aa', 'bb']",
    ]  # fmt: skip


def test_a_launch_for_tests_has_a_master_and_time_limits(ros: RosSystem, library_package: Path) -> None:
    assert run(ros, library_package, PARENT) == [
        "['s-1'] [] True", "test [bb] failed to launch",
        "max time [0.2s] allotted for test [t] of type [programs/sleeper]", "False",
    ]  # fmt: skip


# `catkin_make run_tests` and `catkin_test_results`: the tests declared by a package.


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
def made_workspace(ros: RosSystem) -> Path:
    base = ros.home / "ws"
    made_write(base, "package.xml", MANIFEST)
    made_write(base, "CMakeLists.txt", CMAKE)
    made_write(base, "test/ready.test", READY)
    made_write(base, "test/test_unit.py", UNIT.replace("SUM", "2"))
    made_write(base, "launch/nodes.launch", LAUNCH.format("node.py"))
    made_write(base, "node.py", "#!/usr/bin/env python3\n")
    (base / "src/pkg/node.py").chmod(0o755)
    del ros.pipros.environment["ROS_PACKAGE_PATH"]
    return base


def made_write(workspace: Path, name: str, content: str) -> None:
    file = workspace / "src/pkg" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(content)


def test_launch_tests_unit_tests_and_checks_all_leave_results(ros: RosSystem, made_workspace: Path) -> None:
    made = ros.pipros.run("catkin_make", "-C", made_workspace, "run_tests", timeout_s=120)

    assert made.returncode == 0, made.output
    results = made_workspace / "build/test_results"
    assert sorted(file.name for file in (results / "pkg").iterdir()) == [
        "nosetests-test.test_unit.py.xml", "roslaunch-check_launch.xml", "rostest-ready__value_25.xml",
        "rosunit-is_ready.xml",
    ]  # fmt: skip
    summed = ros.pipros.run("catkin_test_results", results)
    assert summed.returncode == 0, summed.output
    assert summed.stdout[-1].startswith("Summary: 5 tests, 0 errors, 0 failures")


def test_failures_are_named_by_catkin_test_results(ros: RosSystem, made_workspace: Path) -> None:
    made_write(made_workspace, "test/ready.test", READY.replace("expected: 25", "expected: 26"))
    made_write(made_workspace, "test/test_unit.py", UNIT.replace("SUM", "3"))
    made_write(made_workspace, "launch/nodes.launch", LAUNCH.format("gone.py"))

    made = ros.pipros.run("catkin_make", "-C", made_workspace, "run_tests_pkg", timeout_s=120)

    assert made.returncode == 0, made.output
    summed = ros.pipros.run("catkin_test_results", made_workspace / "build/test_results")
    assert summed.returncode == 1
    assert summed.stdout[-1].startswith("Summary: 5 tests, 0 errors, 3 failures")
    assert "cannot find node [gone.py] in package [pkg]" in made.output


def test_unit_tests_run_without_pytest_too(tmp_path: Path) -> None:
    (tmp_path / "test_sums_of_a_folder.py").write_text(UNIT.replace("SUM", "3"))
    results = tmp_path / "results.xml"

    assert run_unittests([str(tmp_path), str(results)]) == 1

    suite = ElementTree.parse(results).getroot()  # noqa: S314
    assert (suite.attrib["tests"], suite.attrib["failures"]) == ("2", "1")
