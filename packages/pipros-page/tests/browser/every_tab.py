"""A system with data for every tab of the page, and the way through all tabs in one browser page."""

import sys
from collections.abc import Iterator
from pathlib import Path

from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.test_bags_tab import make_bag
from tests.support.environments import source
from tests.support.page import Page
from tests.support.ros import RosSystem

ROBOT = Path(__file__).parent / "programs" / "robot_program.py"
REPORTS = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
rospy.init_node("reporter")
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
rate = rospy.Rate(5)
while not rospy.is_shutdown():
    link = [KeyValue("messages", "10"), KeyValue("lost", "7")]
    passed = [KeyValue("topics: to_ros2: /scan", "9.5/s, 3 dropped: too long")]
    diagnostics.publish(DiagnosticArray(status=[
        DiagnosticStatus(1, "/Fleet/operator/robot1", "7 lost", "", link),
        DiagnosticStatus(0, "/ROS 2/gateway", "", "", passed),
    ]))
    rate.sleep()
"""
LAUNCH = '<launch><node pkg="rospy_tutorials" type="talker.py" name="talker"/></launch>'
TABS = {
    "graph/node:%2Frobot": "aside h3",
    "graph/events:": "aside h2",
    "topics/%2Fimu": "aside .message li",
    "plot/show:statistics,line:0.5,%2Fimu%2Fangular_velocity%2Fx;d;r": ".statistics td",
    "console": ".entry",
    "params": ".params li",
    "reconfigure": ".servers",
    "nodes": "tbody tr",
    "launches": "tbody tr",
    "images/%2Ffront%2Fimage_raw%3Bwith%3D%2Fcamera%2Fimage_raw": "canvas",
    "tf/base_link>camera": ".pair dl",
    "scene": ".scene-canvas",
    "diagnostics/%2FMotors%2Fright": "aside table",
    "fleet": "tbody tr",
    "ros2": "tbody tr",
    "acts": ".note",
    "services/%2Frobot%2Fget_loggers": "aside details",
    "actions": ".bar",
    "publish": ".form",
    "teleop": ".stick",
    "panels/row(plot/%2Fimu%2Fangular_velocity%2Fx~column(topics~console))": ".entry",
    "bags/run.bag": ".timeline .thumbnail",  # the last one: from then on, the other tabs show the bag
}
"""Places, and what they show once their data have come."""
OPEN_DETAILS = "document.querySelectorAll('.recorder details').forEach((each) => { each.open = true; })"


def names_of_tabs() -> set[str]:
    """Return the names of all tabs and their sections: each has a file in the page."""
    return {file.stem for file in source("pipros_page/page/tabs").iterdir()}


def page_with_every_tab(ros: RosSystem, folder: Path) -> Page:
    """Start a system and its page, with control. `folder` gets a launch file and a bag."""
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, ROBOT, "robot")
    ros.pipros.start(sys.executable, "-c", REPORTS)
    (folder / "talker.launch").write_text(LAUNCH)
    ros.pipros.start("roslaunch", folder / "talker.launch")
    ros.wait_for_publisher("/imu")
    make_bag(folder / "run.bag")
    return Page(ros, "--control", "--bags", folder)


def visited(tab: Tab) -> Iterator[str]:
    """Go to one place after the other, and yield it once it shows data and all of its controls."""
    assert names_of_tabs() <= {place.partition("/")[0] for place in TABS}, "add a place of each tab to TABS"
    for place, element in TABS.items():
        tab.evaluate("(place) => { location.hash = place; }", place)
        if place.startswith("panels"):
            expect(tab.get_by_label("Add a panel")).to_be_visible()
            choice = tab.get_by_label("Panel", exact=True)
            if choice.is_visible():  # a phone shows one panel at a time
                choice.select_option(index=2)
        expect(tab.locator(f"#view > .tab-{place.partition('/')[0]} {element}").first).to_be_visible()
        tab.evaluate(OPEN_DETAILS)
        yield place
