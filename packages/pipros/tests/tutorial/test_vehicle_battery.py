"""The battery monitor in `examples/`: the commands of its README, its tests and its bag."""

import os
import re
import shutil
from pathlib import Path

import pytest

from tests.support.environments import EXAMPLES, REPOSITORY, VENV_BIN
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PACKAGE = EXAMPLES / "vehicle_battery"


@pytest.mark.timeout(300)
def test_its_own_tests_pass_in_pytest(ros: RosSystem, tmp_path: Path) -> None:
    shutil.copy(REPOSITORY / "pyproject.toml", tmp_path)  # whose pytest settings are ignored
    tests = shutil.copytree(PACKAGE, tmp_path / "vehicle_battery") / "test"

    ended = ros.pipros.run(VENV_BIN / "python", "-m", "pytest", "-q", tests, timeout_s=280)

    assert ended.returncode == 0, ended.output
    counted = re.search(r"(\d+) passed", ended.output)
    assert counted, ended.output
    assert int(counted[1]) >= 24, ended.output  # those of battery.test among them


def test_catkin_make_builds_and_installs_it_without_cmake(ros: RosSystem, tmp_path: Path) -> None:
    workspace = tmp_path / "catkin_ws"
    shutil.copytree(EXAMPLES, workspace / "src")

    built = ros.pipros.run("catkin_make", "-C", workspace, "install", PATH=f"{VENV_BIN}{os.pathsep}/nowhere")
    assert built.returncode == 0, built.output
    shutil.rmtree(workspace / "src")

    line = "from vehicle_battery.cfg.MonitorConfig import defaults; print(defaults['critical'])"
    script = f'. {workspace}/install/setup.sh && python3 -c "{line}"'
    ended = ros.pipros.run("sh", "-c", script, ROS_PACKAGE_PATH="")
    assert ended.stdout == ["0.1"], ended.output


@pytest.mark.timeout(300)
def test_the_rostest_passes(ros: RosSystem) -> None:
    ended = ros.pipros.run("rostest", "vehicle_battery", "battery.test", timeout_s=280)

    ended.check(0, " * TESTS: 3")


def test_a_simulated_battery_warns_and_is_acknowledged(ros: RosSystem) -> None:
    arguments = ("source:=simulated", "speed:=10", "percentage:=0.2")
    launched = ros.pipros.start(
        "roslaunch", "vehicle_battery", "battery.launch", *arguments, "-p", str(ros.port)
    )
    launched.wait_for(r"battery low: 20 %")

    wait_until(lambda: ros.publishers("/battery_warning"), 30, "a publisher of warnings")
    warning = ros.pipros.run("rostopic", "echo", "-n", "1", "/battery_warning")
    called = ros.pipros.run("rosservice", "call", "/battery_monitor/acknowledge")
    level = ros.pipros.run("rostopic", "echo", "-n", "1", "/battery_topic")
    changed = ros.pipros.run(
        "rosrun", "dynamic_reconfigure", "dynparam", "set", "battery_monitor", "critical", "0.5"
    )
    after = ros.pipros.run("rosparam", "get", "/battery_monitor/critical")

    assert "level: 1" in warning.stdout, warning.output
    assert "success: True" in called.stdout, called.output
    assert re.fullmatch(r'battery: "%\d+"', level.stdout[0]), level.output
    assert changed.returncode == 0, changed.output
    assert after.stdout == ["0.25"]  # not above `low`


def test_the_driver_lists_the_batteries(ros: RosSystem) -> None:
    ros.serve_master()

    ended = ros.pipros.run("rosrun", "vehicle_battery", "battery_driver", "_source:=BAT77")

    ended.check(1, "BAT77 is not a battery of this computer")


@pytest.mark.parametrize("words", [(), ("a.bag", "b.bag")])
def test_record_discharge_prints_its_usage(ros: RosSystem, words: tuple[str, ...]) -> None:
    ended = ros.pipros.run("rosrun", "vehicle_battery", "record_discharge", *words)

    assert (ended.returncode, ended.stderr) == (2, ["usage: record_discharge FILE.bag"])


def test_record_discharge_writes_the_bag(ros: RosSystem) -> None:
    ended = ros.pipros.run("rosrun", "vehicle_battery", "record_discharge", "again.bag")

    assert ended.stdout == ["again.bag: 120 minutes from full to empty"], ended.output
    assert (ros.home / "again.bag").read_bytes() == (PACKAGE / "bags" / "discharge.bag").read_bytes()
