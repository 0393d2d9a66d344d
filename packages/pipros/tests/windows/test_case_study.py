"""The case study with Windows's programs, alone and in one system with programs of Linux."""

import os
import signal

import pytest
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support import browser, windows
from tests.support.environments import EXAMPLES
from tests.support.genuine import missing_packages
from tests.support.page import ADDRESS, Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until
from tests.support.windows import DRIVE, WindowsProgram
from tests.windows.conftest import StartOnWindows

pytestmark = pytest.mark.timeout(500)  # on busy processors, building a workspace takes minutes under Wine


def ends_with_nothing_left(program: WindowsProgram, seconds: float = 30) -> int:
    """Return a program's exit code, after checking that no Python of Windows is still running."""
    code = program.wait(seconds)
    wait_until(lambda: not windows.running(), 10, lambda: f"the end of {windows.running()}")
    return code


def test_rostest_passes_and_leaves_no_node(start: StartOnWindows) -> None:
    test = start("rostest", "composiv_tryouts", "composiv_tryout.launch")
    assert ends_with_nothing_left(test, 120) == 0, test.output
    assert "RESULT: SUCCESS" in test.output


def test_ctrl_c_ends_roslaunch_with_its_nodes_and_master(start: StartOnWindows) -> None:
    launch = start("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")
    launch.wait_for("Battery level of vehicle: %25")
    launch.type("\x03")
    assert ends_with_nothing_left(launch) == 0, launch.output


def test_a_killed_roslaunch_leaves_no_node_and_no_master(start: StartOnWindows) -> None:
    launch = start("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")
    launch.wait_for(r"listener-3\]")
    launcher = next(
        number
        for line, number in windows.running().items()
        if "python.exe C:\\Python311\\Scripts\\roslaunch" in line
    )
    assert len(windows.running()) == 4, "the launcher's .exe, the launcher, and two nodes"
    os.kill(launcher, signal.SIGKILL)
    wait_until(lambda: not windows.running(), 10, lambda: f"the end of {windows.running()}")


@pytest.mark.skipif(bool(missing_packages() or browser.missing()), reason="needs genuine ROS 1 and Chromium")
def test_windows_linux_and_genuine_ros_are_one_system(ros, start: StartOnWindows, open_tab: OpenTab) -> None:
    ros.genuine.start_bare_master()
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(EXAMPLES)
    ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py", "__name:=linux_listener")
    ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py", "__name:=linux_talker")
    start("rosrun", "composiv_tryouts", "composiv_talker.py")
    start("rosrun", "composiv_tryouts", "composiv_listener.py", "__name:=windows_listener")
    start("rostopic", "pub", "-r", "10", "/from_windows", "std_msgs/Int32", "data: 5")
    ros.pipros.start("rostopic", "pub", "-r", "10", "/from_linux", "std_msgs/Int32", "data: 6")
    ros.genuine.start("rostopic", "pub", "-r", "10", "/from_linux", "std_msgs/Int32", "data: 7")
    for side, topic, said in (
        (ros.pipros, "/battery_topic", 'battery: "%25"'), (ros.pipros, "/from_windows", "data: 5"),
        (ros.genuine, "/from_windows", "data: 5"),
    ):  # fmt: skip
        ros.wait_for_publisher(topic)
        heard = side.run("rostopic", "echo", "-n", "2", topic)
        assert heard.returncode == 0, heard.output
        assert heard.stdout.count(said) == 2
        assert topic in side.run("rostopic", "list").stdout
    heard_there = start("rostopic", "echo", "/from_linux")
    wait_until(lambda: {"data: 6", "data: 7"} <= set(heard_there.lines), 90, "pipros and genuine rospy")
    served_there = start("rqt_graph", "--no-browser")
    for page in (Page(ros), Page.at(served_there.wait_for(ADDRESS)[0])):
        tab = open_tab(page, "graph")
        for node in ("talker_node", "windows_listener", "linux_talker", "linux_listener"):
            expect(tab.locator(f'[data-key="node:/{node}"]')).to_be_visible()
        tab.locator('[data-key="topic:/battery_topic"]').click()
        expect(tab.locator("aside .message")).to_contain_text('battery: "%25"')
    keep_screenshots(tab, "graph-windows")


def test_a_bag_is_recorded_until_ctrl_c_and_read(ros: RosSystem, start: StartOnWindows) -> None:
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "-r", "10", "/numbers", "std_msgs/Int32", "data: 5")
    record = start("rosbag", "record", "-O", r"C:\temp\numbers", "/numbers")
    active = DRIVE / "temp" / "numbers.bag.active"
    wait_until(lambda: active.exists() and active.stat().st_size > 4500, 60, "messages in the bag")
    record.type("\x03")
    assert record.wait(30) == 0, record.output
    info = start("rosbag", "info", "-y", "-k", "topics", r"C:\temp\numbers.bag")
    assert info.wait(30) == 0
    assert "topic: /numbers" in info.output
    assert not active.exists()
