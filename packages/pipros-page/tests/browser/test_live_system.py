"""The page on a system of pipros, rospy and roscpp nodes or, without genuine ROS, of pipros nodes alone."""

import re
import sys
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.catkin import build_once
from tests.support.genuine import missing_packages
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ROBOT = Path(__file__).parent / "programs" / "robot_program.py"
IS_MIXED = not missing_packages()


@pytest.fixture
def mixed(ros: RosSystem) -> RosSystem:
    """`/robot` of pipros, `/genuine_robot` of rospy; a talker, two relays and `/cpp_frames` of roscpp."""
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, ROBOT, "robot")
    topics = ["/imu"]
    if IS_MIXED:
        ros.genuine.environment.update(build_once().variables)
        ros.genuine.start("/usr/bin/python3", ROBOT, "genuine_robot")
        ros.genuine.start("rosrun", "cpp_battery", "battery_talker")
        ros.pipros.start("rostopic", "echo", "/battery_topic", "__name:=listener")
        for name, topic in (("imu", "/imu"), ("image", "/front/image_raw")):
            ros.genuine.start("rosrun", "topic_tools", "relay", topic, f"/cpp/{name}", f"__name:=cpp_{name}")
        frames = ["0", "0", "1", "0", "0", "0", "1", "base_link", "cpp_laser", "__name:=cpp_frames"]
        ros.genuine.start("rosrun", "tf2_ros", "static_transform_publisher", *frames)
        topics += ["/cpp/imu", "/cpp/image", "/battery_topic", "/tf_static"]
    for topic in topics:
        ros.wait_for_publisher(topic)
    return ros


def of_all(pipros: str, mixed: str) -> str:
    return mixed if IS_MIXED else pipros


# Tab, element and expected text, for every kind of node that the tab can show.
TABS = {
    "topics/" + of_all("%2Fbattery", "%2Fbattery_topic"): ("aside", of_all(r"62\.5 %", r"battery: \"%\d+\"")),
    "plot/%2Fimu%2Fangular_velocity%2Fx" + of_all("", "%2C%2Fcpp%2Fimu%2Fangular_velocity%2Fy"): (
        ".legend",
        r"/imu/angular_velocity/x: -?\d" + of_all("", r".*/cpp/imu/angular_velocity/y: -?\d"),
    ),
    "console": (".log", "wheel slips"),
    "params": (".params", of_all("robot/.*", "genuine_robot/.*") + r"wheel_radius: 0\.15"),
    "nodes": ("table", of_all("/robot.*MB", r"/(cpp|g)\w+\d.*MB.*/(cpp|g)\w+\d.*MB")),
    "images/" + of_all("%2Ffront%2Fimage_raw", "%2Fcpp%2Fimage"): (".bar", r"96 . 64 rgb8, camera"),
    "tf": ("table", of_all("", r"cpp_laserbase_link/cpp_framesstatic.*") + "wheel_leftbase_link"),
    "diagnostics/%2FMotors%2Fright": ("aside", "temperature41"),
    "services/" + of_all("%2Frobot", "%2Fcpp_talker") + "%2Fget_loggers": ("aside", "roscpp/GetLoggers"),
    "publish": ("#view", "This page is read-only"),
}


def test_each_tab_shows_data_of_all_kinds_of_nodes(mixed: RosSystem, open_tab: OpenTab) -> None:
    page = Page(mixed)
    for place, (where, words) in TABS.items():
        tab = open_tab(page, place)
        expect(tab.locator(where).first).to_contain_text(re.compile(words, re.DOTALL))
        keep_screenshots(tab, f"{place.partition('/')[0]}")
        tab.context.close()
    tab = open_tab(page, "graph")
    for name in ["robot", *(["genuine_robot", "cpp_talker", "cpp_imu", "listener"] if IS_MIXED else [])]:
        if name != "robot" or IS_MIXED:  # without other nodes, it is connected only to the page
            expect(tab.locator(f'[data-key="node:/{name}"]')).to_be_visible()
    if IS_MIXED:
        expect(tab.locator("svg.canvas")).to_contain_text(re.compile(r"\d Hz"))
        tab.locator('[data-key="node:/cpp_talker"]').click()
        expect(tab.locator("aside")).to_contain_text("to /listener, /battery_topic:")
    keep_screenshots(tab, "system")


# The time, by this machine's clock, at which the vertex gets the shape of an unresponsive node.
WATCH = """() => {
  window.markedAt = 0;
  new MutationObserver(() => {
    const isMarked = document.querySelector('[data-key="node:/talker"] .unreachable') !== null;
    if (!window.markedAt && isMarked) window.markedAt = Date.now();
  }).observe(document.querySelector("svg.canvas"), { subtree: true, childList: true, attributes: true });
}"""


def test_a_killed_talker_is_marked_and_does_not_disturb_other_nodes(ros: RosSystem, open_tab) -> None:
    ros.pipros.start_master()
    side = ros.pipros
    program = ("rostopic", "pub", "-r", "10", "/level", "std_msgs/String", "'%25'", "__name:=talker")
    if IS_MIXED:
        ros.genuine.environment.update(build_once().variables)
        program = ("rosrun", "cpp_battery", "battery_talker", "__name:=talker")
        side = ros.genuine
    talker = side.start(*program)
    topic = of_all("/level", "/battery_topic")
    ros.pipros.start("rostopic", "echo", topic, "__name:=listener").wait_for("%")
    ros.pipros.start("rostopic", "pub", "-r", "10", "/other", "std_msgs/String", "x", "__name:=second")
    ros.pipros.start("rostopic", "echo", "/other", "__name:=third").wait_for("x")
    tab = open_tab(Page(ros), "graph")
    expect(tab.locator('[data-key="node:/talker"]')).to_be_visible()
    expect(tab.locator(f'[data-key="topic:{topic}"]')).to_be_visible()
    tab.evaluate(WATCH)
    begin_ms = tab.evaluate("Date.now()")
    talker.kill()
    wait_until(lambda: tab.evaluate("window.markedAt"), 30, "the mark of a dead node")
    elapsed_s = (tab.evaluate("window.markedAt") - begin_ms) / 1000
    print(f"marked as dead after {elapsed_s:.2f} s")  # 3 s on a quiet machine
    expect(tab.locator('[data-key="node:/talker"]')).to_have_attribute(
        "aria-label", "node /talker, does not answer"
    )
    tab.locator('[data-key="topic:/other"]').click()  # the others continue
    expect(tab.locator("aside .message")).to_contain_text("data")
    expect(tab.locator("aside dl")).to_contain_text(re.compile(r"Rate\d"))
    ros.pipros.run("bash", "-c", "echo y | rosnode cleanup")
    expect(tab.locator('[data-key="node:/talker"] .gone')).to_be_visible()
