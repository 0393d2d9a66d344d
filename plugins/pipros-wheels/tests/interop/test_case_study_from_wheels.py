"""The case study installed by pip, outside of any workspace, with genuine nodes on the other side."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until
from tests.support.wheels import Installed, build_pipros, repack_requirements

pytestmark = pytest.mark.timeout(600)  # pip writes the 2,600 files of pipros

HEARD = r"Battery level of vehicle: %\d+"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """A new environment with pipros and the wheels of both packages, with their tests."""
    wheels = tmp_path_factory.mktemp("wheels")
    build_pipros(wheels)
    repack_requirements("pipros", wheels)
    made = Installed(tmp_path_factory.mktemp("environment"), wheels, tmp_path_factory.mktemp("home"))
    made.pip("install", "--quiet", "pipros-wheels")
    made.run("pipros", "wheel", "--whole", EXAMPLES, "-o", wheels)
    made.pip("install", "--quiet", *wheels.glob("ros1_*.whl"))
    return made


@pytest.fixture
def wheels(installed: Installed, ros: RosSystem, bare_tools: Path) -> Iterator[Side]:
    """Programs of the environment. No variable of ROS is set but the address of the master."""
    variables = {
        "HOME": str(ros.home), "PATH": f"{installed.programs}:{bare_tools}", "ROS_MASTER_URI": ros.master_uri,
        "LANG": "C.UTF-8", "PYTHONUNBUFFERED": "1",
    }  # fmt: skip
    side = Side(variables, ros.home)
    yield side
    side.close()


def test_launched_nodes_talk_to_genuine_ones(ros: RosSystem, wheels: Side) -> None:
    launch = wheels.start("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")
    ros.wait_for_publisher("/battery_topic")
    heard = ros.genuine.start_node("composiv_tryouts", "composiv_listener.py", "__name:=genuine_listener")
    heard.wait_for(HEARD)
    launch.press_ctrl_c()
    assert launch.wait() == 0, launch.output


def test_a_genuine_talker_is_heard(ros: RosSystem, wheels: Side) -> None:
    ros.serve_master()
    ros.genuine.start_node("composiv_tryouts", "composiv_talker.py")
    heard = wheels.start_node("composiv_tryouts", "composiv_listener.py")
    heard.wait_for(HEARD)


def test_driver_and_monitor_work_with_a_genuine_monitor_and_driver(ros: RosSystem, wheels: Side) -> None:
    ros.serve_master()
    for sides in ((wheels, ros.genuine), (ros.genuine, wheels)):
        driver = sides[0].start(
            *("rosrun", "vehicle_battery", "battery_driver", "_source:=simulated", "_percentage:=0.05")
        )
        monitor = sides[1].start("rosrun", "vehicle_battery", "battery_monitor")
        monitor.wait_for("battery critical: 5 %")
        for process in (driver, monitor):
            process.press_ctrl_c()
            process.wait()
        wait_until(lambda: not ros.publishers("/battery_state"), 30, "no publisher")


@pytest.mark.parametrize(
    ("package", "file"), [("composiv_tryouts", "composiv_tryout.launch"), ("vehicle_battery", "battery.test")]
)
def test_the_tests_of_the_wheels_pass(wheels: Side, package: str, file: str) -> None:
    ended = wheels.run("rostest", package, file, timeout_s=120)
    assert ended.returncode == 0, ended.output
    assert " * FAILURES: 0" in ended.output
    assert " * TESTS: 0" not in ended.output
