"""The case study and packages of users, on genuine ROS."""

import os
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support import errand
from tests.support.case_study import (
    WORKSPACE,
    create_message,
    make_workspace_and_package,
    write_nodes_test_and_launch_file,
)
from tests.support.catkin import CatkinWorkspace
from tests.support.environments import EXAMPLES
from tests.support.patrol import PACKAGES, SAID
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until

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


# The battery monitor of `examples/` on genuine ROS, built by genuine catkin; and half of it on each side.
def test_the_rostest_passes_on_genuine_ros(ros: RosSystem) -> None:
    ended = ros.genuine.run("rostest", "vehicle_battery", "battery.test", timeout_s=300)

    ended.check(0, " * TESTS: 3")


def test_the_tests_of_the_logic_pass_on_genuine_ros(ros: RosSystem) -> None:
    tests = EXAMPLES / "vehicle_battery" / "test"

    ended = ros.genuine.run("python3", "-m", "unittest", "discover", "-s", tests, "-p", "test_[as]*.py")

    ended.check(0, "Ran 21 tests")


@pytest.mark.parametrize("driver_is_genuine", [True, False])
def test_driver_and_monitor_of_two_sides_work_together(ros: RosSystem, driver_is_genuine: bool) -> None:
    sides = (ros.genuine, ros.pipros) if driver_is_genuine else (ros.pipros, ros.genuine)
    ros.serve_master()

    monitor = sides[1].start("rosrun", "vehicle_battery", "battery_monitor")
    sides[0].start("rosrun", "vehicle_battery", "battery_driver", "_source:=simulated", "_percentage:=0.05")

    monitor.wait_for("battery critical: 5 %")
    wait_until(lambda: ros.publishers("/diagnostics"), 30, "diagnostics")
    answer = sides[0].run("rosservice", "call", "/battery_monitor/acknowledge")
    assert "success: True" in answer.stdout, answer.output


# A workspace created with pipros, then built and tested by genuine catkin and genuine ROS.
def test_genuine_catkin_builds_it_and_genuine_rostest_passes(ros: RosSystem) -> None:
    del ros.pipros.environment["ROS_PACKAGE_PATH"]
    base = ros.home / WORKSPACE
    terminal = ros.pipros.open_terminal()
    make_workspace_and_package(terminal)
    create_message(terminal, base / "src/composiv_tryouts")
    write_nodes_test_and_launch_file(terminal, base / "src/composiv_tryouts")

    underlay = {"CMAKE_PREFIX_PATH": "/usr", "ROS_PACKAGE_PATH": "/usr/share"}
    made = ros.genuine.run("catkin_make", "-C", base, timeout_s=300, **underlay)

    assert made.returncode == 0, made.output
    assert "-- composiv_tryouts: 1 messages, 0 services" in made.stdout
    assert (base / "devel/lib/python3/dist-packages/composiv_tryouts/msg/_BatteryLevel.py").exists()
    tested = ros.genuine.run(
        "bash",
        "-c",
        f". {base}/devel/setup.bash && export ROS_PACKAGE_PATH=$ROS_PACKAGE_PATH:/usr/share && "
        "which rostest && rostest composiv_tryouts composiv_tryout.launch",
        timeout_s=100,
        **underlay,
    )
    assert tested.returncode == 0, tested.output
    assert tested.stdout[0] == "/usr/bin/rostest"
    assert "[composiv_tryouts.rosunit-test_talker/test_talker_publishing][passed]" in tested.stdout


# A workspace that genuine catkin built, used from pipros: C++ nodes beside Python ones.
LAUNCH = """
<launch>
  <node pkg="cpp_battery" type="battery_talker" name="talker" ns="robot"/>
  <node pkg="cpp_battery" type="battery_listener" name="listener" ns="robot" output="screen"/>
  <node pkg="composiv_tryouts" type="composiv_listener.py" name="python_listener" ns="robot" output="screen"/>
</launch>
"""


@pytest.fixture
def sourced(ros: RosSystem, catkin_workspace: CatkinWorkspace) -> RosSystem:
    """Return the variables after `source devel/setup.bash` in the environment of pipros."""
    for name in ("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH"):
        ros.pipros.environment[name] = catkin_workspace.variables[name]
    return ros


def test_rosrun_finds_and_starts_a_cpp_node(sourced: RosSystem) -> None:
    sourced.serve_master()
    sourced.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py")

    heard = sourced.pipros.start("rosrun", "cpp_battery", "battery_listener")

    heard.wait_for(r"^heard %25 from /talker_node$")


def test_roslaunch_starts_cpp_and_python_nodes_and_ends_both(sourced: RosSystem) -> None:
    file = sourced.home / "both.launch"
    file.write_text(LAUNCH)

    launch = sourced.pipros.start("roslaunch", file)

    launch.wait_for(r"^heard %\d+ from /robot/talker$")
    launch.wait_for(r"Battery level of vehicle: %\d+")
    launch.press_ctrl_c()
    assert launch.wait() == 0


def test_the_generated_modules_of_the_workspace_work_with_our_genpy(sourced, catkin_workspace) -> None:
    modules = catkin_workspace.folder / "devel/lib/python3/dist-packages"
    asked = (
        "import composiv_tryouts.msg._BatteryLevel as generated, genpy; m = generated.BatteryLevel('%25'); "
        "print(generated.__file__, isinstance(m, genpy.Message), m)"
    )

    ended = sourced.pipros.run("python3", "-c", asked, PYTHONPATH=str(modules))

    file = modules / "composiv_tryouts/msg/_BatteryLevel.py"
    assert ended.stdout == [f'{file} True battery: "%25"'], ended.output


# The realistic packages of tests.graph, with half of their nodes on genuine ROS.


PAIRS = [("pipros", "genuine"), ("genuine", "pipros"), ("genuine", "genuine")]


@pytest.mark.parametrize(("base", "patrol"), PAIRS)
def test_a_robot_with_actions_and_transforms_patrols(plain_ros: RosSystem, base: str, patrol: str) -> None:
    sides = with_packages(plain_ros)
    plain_ros.serve_master()

    sides[base].start("rosrun", "patrol", "base.py")
    ended = sides[patrol].run("rosrun", "patrol", "patrol.py", timeout_s=120)

    assert ended.stdout == SAID, ended.output


@pytest.mark.parametrize(("world", "machine"), PAIRS)
def test_a_state_machine_runs_an_errand(plain_ros: RosSystem, world: str, machine: str) -> None:
    sides = with_packages(plain_ros)
    # Genuine ROS finds Python code in built packages only.
    sides["genuine"].environment["PYTHONPATH"] = str(errand.SOURCES)
    plain_ros.serve_master()

    attempts = 4 if machine == "genuine" else 1
    ended = run_errand(sides, world, machine, 120 if attempts == 1 else 40)
    while ended is None and (attempts := attempts - 1):
        ended = run_errand(sides, world, machine, 40)
    assert ended is not None

    assert [line for line in ended.stdout if line in errand.SAID] == errand.SAID, ended.output


def run_errand(sides: dict[str, Side], world: str, machine: str, timeout_s: float) -> Process | None:
    """Return the program after its end, or None if it did not end.

    On a busy machine, genuine actionlib loses results that arrive before it tracks the goal, and waits for
    ever: "Got a transition callback on a goal handle that we're not tracking".
    """
    served = sides[world].start("rosrun", "state_machines", "world.py")
    errand_process = sides[machine].start("rosrun", "state_machines", "errand.py")
    try:
        errand_process.wait(timeout_s)
    except AssertionError:
        errand_process.end()
        served.end()
        return None
    return errand_process


def with_packages(ros: RosSystem) -> dict[str, Side]:
    """Return both sides by name, with the packages on their paths."""
    sides = {"pipros": ros.pipros, "genuine": ros.genuine}
    for side in sides.values():
        paths = (str(PACKAGES), side.environment["ROS_PACKAGE_PATH"])
        side.environment["ROS_PACKAGE_PATH"] = os.pathsep.join(paths)
    return sides
