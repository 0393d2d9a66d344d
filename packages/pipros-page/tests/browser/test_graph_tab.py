"""The Graph and Topics tabs in a browser, with the case study."""

import re
import sys

import pytest
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots, show_all_controls
from tests.support.environments import REPOSITORY
from tests.support.page import Page
from tests.support.processes import Process
from tests.support.ros import RosSystem

EXAMPLES = REPOSITORY / "examples" / "catkin_ws" / "src"


@pytest.fixture
def nodes(ros: RosSystem) -> dict[str, Process]:
    """The case study: a talker, a listener and their master."""
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(EXAMPLES)
    ros.serve_master()
    started = {
        name: ros.pipros.start("rosrun", "composiv_tryouts", f"composiv_{name}.py", f"__name:={name}_node")
        for name in ("talker", "listener")
    }
    ros.wait_for_publisher("/battery_topic")
    ros.wait_for_subscriber("/battery_topic")
    return started


def test_the_case_study_is_drawn_in_the_right_order(ros: RosSystem, nodes, open_tab) -> None:
    tab = open_tab(Page(ros), "graph")
    lefts = []
    for key in ("node:/talker_node", "topic:/battery_topic", "node:/listener_node"):
        vertex = tab.locator(f'[data-key="{key}"]')
        expect(vertex).to_be_visible()
        box = vertex.bounding_box()
        lefts.append(box["x"])
    assert lefts == sorted(lefts)
    assert tab.locator("path.arrow").count() == 2
    tab.locator('[data-key="topic:/battery_topic"]').click()
    expect(tab.locator("aside .message")).to_contain_text('battery: "%25"')
    expect(tab.locator("[role=meter]")).to_have_attribute("aria-valuenow", "25")
    assert "token" not in tab.url
    keep_screenshots(tab, "graph")


def test_a_killed_node_stays_with_its_age_and_is_an_event(ros: RosSystem, nodes, open_tab) -> None:
    tab = open_tab(Page(ros), "graph")
    talker = tab.locator('[data-key="node:/talker_node"]')
    expect(talker).to_be_visible()
    nodes["talker"].kill()
    expect(talker.locator("ellipse.gone")).to_be_visible()
    expect(talker.locator("text.age")).to_have_text(re.compile(r"gone \d+ s ago"))
    expect(tab.locator('[data-key="topic:/battery_topic"]')).to_be_visible()
    assert tab.locator("path.arrow").count() == 2
    keep_screenshots(tab, "graph-gone")
    tab.get_by_role("button", name="Events").click()
    expect(tab.locator("aside .events")).to_contain_text("− node /talker_node")  # noqa: RUF001
    keep_screenshots(tab, "graph-events")


PIPELINE = """
import rospy
from std_msgs.msg import Float32, String
rospy.init_node("pipeline")
rospy.Subscriber("/battery_topic", Float32)
rospy.spin()
"""
# The height on the screen of the smallest name; 0 if a name of a node or topic is hidden.
SMALLEST_NAME = """() => Math.min(...[...document.querySelectorAll("g.vertex text:not(.age)")].map(
  (text) => (text.checkVisibility() && text.textContent ? text.getBoundingClientRect().height : 0)))"""

APART = """() => {
  const boxes = [...document.querySelectorAll("g.vertex > :is(ellipse, rect)")];
  const all = boxes.map((each) => each.getBoundingClientRect());
  const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  return !all.some((one, index) => all.slice(index + 1).some((other) => meet(one, other)));
}"""


def test_all_names_of_a_pipeline_with_a_wrong_type_are_readable(ros: RosSystem, nodes, open_tab) -> None:
    ros.pipros.start(sys.executable, "-c", PIPELINE)
    topic = "/battery_topic"
    for stage in range(8):
        output = f"/stage_{stage}/output"
        ros.pipros.start("rosrun", "topic_tools", "relay", topic, output, f"__name:=stage_{stage}")
        topic = output
    for name in ("alone", "apart"):
        ros.pipros.start("rosrun", "topic_tools", "relay", f"/{name}", f"/{name}/output", f"__name:={name}")
    ros.wait_for_publisher(topic)
    for size in ((1440, 900), (1280, 800), (390, 844)):
        tab = open_tab(Page(ros), "graph", size)
        for name in ("stage_7", "alone", "apart"):
            expect(tab.locator(f'[data-key="node:/{name}"]')).to_be_attached()
        expect(tab.locator("g.label.wrong text")).to_have_count(1)
        tab.wait_for_function(f"({SMALLEST_NAME})() >= 9")
        keep_screenshots(tab, f"pipeline-{size[0]}")
        tab.locator('[data-key="node:/stage_0"]').press("Enter")
        expect(tab.locator("aside h2")).to_be_visible()
        tab.wait_for_function(APART)


NAMESPACES = """
import rospy
from std_msgs.msg import Empty
rospy.init_node("many")
kept = [rospy.Publisher(f"/robot{i % 8}/arm/joint{i}", Empty, queue_size=1) for i in range(200)]
kept += [rospy.Subscriber(f"/robot{i % 8}/arm/joint{i}", Empty) for i in range(200)]
for part in ("goal", "cancel", "status", "feedback", "result"):
    kept.append(rospy.Publisher(f"/pick/{part}", Empty, queue_size=1))
    if part in ("goal", "result"):
        kept.append(rospy.Subscriber(f"/pick/{part}", Empty))
rospy.spin()
"""


def test_namespaces_of_a_large_graph_are_opened_by_a_click(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", NAMESPACES)
    ros.wait_for_subscriber("/pick/result")
    tab = open_tab(Page(ros), "graph")
    expect(tab.locator('[data-key="namespace:/robot3"]')).to_contain_text("/robot3: 25")
    keep_screenshots(tab, "graph-namespaces")
    tab.locator('[data-key="group:/pick (action)"]').click()
    expect(tab.locator("aside li")).to_have_text(["/pick/goal", "/pick/result"])
    tab.locator('[data-key="namespace:/robot3"]').click()
    tab.locator('[data-key="namespace:/robot3/arm"]').click()
    expect(tab.locator('[data-key="topic:/robot3/arm/joint3"]')).to_be_visible()
    tab.get_by_role("button", name="Close namespaces").click()
    expect(tab.locator('[data-key="namespace:/robot3"]')).to_be_visible()
    tab.get_by_role("button", name="Filters").click()
    tab.get_by_label("Actions").uncheck()
    expect(tab.locator('[data-key^="namespace:/pick"]')).to_be_visible()


def test_a_node_is_selected_with_the_keyboard(ros: RosSystem, nodes: dict[str, Process], open_tab) -> None:
    tab = open_tab(Page(ros), "graph")
    tab.locator('[data-key="node:/talker_node"]').press("Enter")
    expect(tab.locator("aside h2")).to_have_text("/talker_node")
    expect(tab.locator("aside")).to_contain_text("composiv_tryouts/BatteryLevel")
    tab.keyboard.press("Escape")
    expect(tab.locator("aside")).to_be_hidden()
    tab.keyboard.press("/")
    tab.keyboard.type("battery")
    expect(tab.locator("g.found")).to_have_count(1)


def test_topics_are_listed_and_shown(ros: RosSystem, nodes: dict[str, Process], open_tab: OpenTab) -> None:
    tab = open_tab(Page(ros), "topics")
    row = tab.locator("tr[data-name='/battery_topic']")
    expect(row).to_contain_text("composiv_tryouts/BatteryLevel")
    row.click()
    expect(tab.locator("aside .message")).to_contain_text("%25")
    keep_screenshots(tab, "topics")


def test_chosen_topics_are_measured_and_shown_as_a_tree(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    for name in ("/robot/arm/level", "/robot/level", "/other"):
        ros.pipros.start("rostopic", "pub", "-r", "10", name, "std_msgs/String", "hello")
        ros.wait_for_publisher(name)
    tab = open_tab(Page(ros), "topics")
    row = tab.locator("tr[data-name='/robot/level']")
    expect(row.locator("td").nth(4)).to_have_text("–")  # noqa: RUF001
    tab.get_by_role("button", name="Measure /robot/level").click()
    expect(row).to_contain_text(re.compile(r"\d\.\d+ Hz\d+(\.\d)? B/s"))
    expect(tab.locator("aside")).to_be_hidden()
    expect(tab.locator("tr[data-name='/other'] td").nth(4)).to_have_text("–")  # noqa: RUF001
    tab.get_by_role("button", name="Stop measuring 1").click()
    expect(row.locator("td").nth(4)).to_have_text("–")  # noqa: RUF001
    tab.get_by_role("button", name="Measure all").click()
    expect(tab.locator("tr[data-name='/robot/arm/level']")).to_contain_text("Hz")
    tab.get_by_label("Tree").check()
    names = tab.locator("tbody tr td:first-child")
    expect(names.filter(has_text="/robot/ (2)")).to_have_count(1)
    keep_screenshots(tab, "topics-tree")
    tab.locator("tr[data-name='/robot/']").click()
    expect(row).to_have_count(0)
    expect(tab.locator("tr[data-name='/other']")).to_be_visible()


def test_a_text_that_is_not_a_percentage_has_no_gauge(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    first = ros.pipros.start("rostopic", "pub", "-r", "10", "/level", "std_msgs/String", "'%25'")
    ros.wait_for_publisher("/level")
    tab = open_tab(Page(ros), "topics/%2Flevel")
    expect(tab.get_by_role("meter")).to_have_attribute("aria-valuenow", "25")
    first.press_ctrl_c()
    first.wait()
    ros.pipros.start("rostopic", "pub", "-r", "10", "/level", "std_msgs/String", "'%112'")
    expect(tab.locator("aside .message")).to_contain_text("%112")
    expect(tab.get_by_role("meter")).to_have_count(0)


def test_markup_in_a_message_stays_text(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    evil = "<img src=x onerror=document.title=1><script>document.title=2</script>"
    ros.pipros.start("rostopic", "pub", "-r", "10", "/evil", "std_msgs/String", f"data: '{evil}'")
    ros.wait_for_publisher("/evil")
    tab = open_tab(Page(ros), "topics/%2Fevil")
    expect(tab.locator("aside .message")).to_contain_text(evil)
    assert (tab.title(), tab.locator("aside img").count()) == ("pipros: Topics", 0)


def test_the_graph_fits_a_phone(ros: RosSystem, nodes: dict[str, Process], open_tab: OpenTab) -> None:
    tab = open_tab(Page(ros), "graph/topic:/battery_topic", size=(390, 800))
    expect(tab.locator("[role=meter]")).to_be_visible()
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    expect(tab.get_by_label("Dead sinks")).to_be_hidden()
    show_all_controls(tab)
    tab.get_by_role("button", name="Filters").click()
    expect(tab.get_by_label("Dead sinks")).to_be_visible()
    tab.get_by_role("button", name="Filters").click()
    keep_screenshots(tab, "graph-phone")


def test_a_lost_server_is_reported(ros: RosSystem, nodes: dict[str, Process], open_tab: OpenTab) -> None:
    page = Page(ros)
    tab = open_tab(page, "graph")
    expect(tab.locator("#system")).to_contain_text("read-only")
    for part in ("svg.canvas", "#to-panels"):
        expect(tab.locator(part)).to_be_visible()  # all files of the tab are loaded
    page.process.press_ctrl_c()
    page.process.wait()
    expect(tab.locator("#system")).to_contain_text("no connection to the server")
    tab.context.close()
