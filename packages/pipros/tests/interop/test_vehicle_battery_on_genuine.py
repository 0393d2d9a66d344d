"""The battery monitor of `examples/` on genuine ROS, built by genuine catkin; and half of it on each side."""

from __future__ import annotations

import pytest

from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


@pytest.mark.timeout(400)
def test_the_rostest_passes_on_genuine_ros(ros: RosSystem) -> None:
    ended = ros.genuine.run("rostest", "vehicle_battery", "battery.test", timeout_s=300)

    assert ended.returncode == 0, ended.output
    assert " * TESTS: 3" in ended.output


def test_the_tests_of_the_logic_pass_on_genuine_ros(ros: RosSystem) -> None:
    tests = EXAMPLES / "vehicle_battery" / "test"

    ended = ros.genuine.run("python3", "-m", "unittest", "discover", "-s", tests, "-p", "test_[as]*.py")

    assert ended.returncode == 0, ended.output
    assert "Ran 21 tests" in ended.output


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
