"""The header with the state of the master, and the filters of the console."""

import json
import re
import sys
from pathlib import Path

import pytest
from playwright.sync_api import Route, expect

from tests.browser.chromium import OpenTab, go_to, keep_screenshots, show_all_controls
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LOG = """
import rospy
rospy.init_node("logger")
rate = rospy.Rate(5)
while not rospy.is_shutdown():
    rospy.loginfo("wheel 1 slips")
    rospy.loginfo("arm moves")
    rospy.loginfo("wheel 2 turns")
    rate.sleep()
"""


def test_a_master_that_does_not_answer_is_shown_in_every_tab(ros: RosSystem, open_tab: OpenTab) -> None:
    master = ros.pipros.start_bare_master()
    tab = open_tab(Page(ros), "services")
    expect(tab.locator("#system")).to_contain_text("127.0.0.1")
    master.kill()
    expect(tab.locator("#system [role=alert]")).to_contain_text("does not answer")


PLACES = """() => [...document.querySelectorAll("#tabs .name, #tabs a")].map(
  (each) => each.getBoundingClientRect().x.toFixed(1)).join()"""


def test_the_head_stands_still(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    tab = open_tab(Page(ros, "--control", command="rqt"), "graph", (1440, 900))
    expect(tab.locator("#system .permit")).to_be_visible()
    go_to(tab, "Nodes")
    expect(tab.locator(".tab-nodes tbody tr").first).to_be_visible()
    before = tab.evaluate(PLACES)
    for title in ("Console", "Topics", "Overview", "Graph"):
        go_to(tab, title)
        expect(tab.get_by_role("tab", selected=True)).to_have_text(title)
        assert tab.evaluate(PLACES) == before
    for count in ("5", "12", "99+"):
        tab.evaluate("(count) => { document.querySelector('#bell span').textContent = count; }", count)
        assert tab.evaluate(PLACES) == before


def test_a_view_that_loads_shows_no_other_one(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    tab = open_tab(Page(ros, command="rqt"), "topics")
    tab.goto(tab.url.replace("/#", "/index.html#"))  # the page whose views are modules, loaded one by one
    expect(tab.locator(".tab-topics tbody tr").first).to_be_visible()
    waiting: list[Route] = []
    tab.route("**/tabs/console.js", lambda route: waiting.append(route))
    go_to(tab, "Console")
    expect(tab.locator("#view > .note")).to_have_text("Loading …")
    expect(tab.locator(".tab-topics")).to_be_hidden()
    waiting[0].continue_()
    expect(tab.locator(".tab-console")).to_be_visible()
    expect(tab.get_by_text("Loading …")).to_have_count(0)
    broken = "throw new Error('it is broken')"
    tab.route("**/tabs/params.js", lambda route: route.fulfill(body=broken, content_type="text/javascript"))
    go_to(tab, "Parameters")
    expect(tab.locator("#view")).to_contain_text("This view could not be loaded: it is broken.")
    expect(tab.get_by_role("button", name="Try again")).to_be_visible()
    go_to(tab, "Topics")
    expect(tab.locator(".tab-topics tbody tr").first).to_be_visible()
    expect(tab.get_by_text("could not be loaded")).to_have_count(0)


def test_the_keys_of_the_graph_are_listed_once(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    tab = open_tab(Page(ros), "graph")
    expect(tab.get_by_role("button", name="Zoom in")).to_be_visible()
    tab.keyboard.press("?")
    keys = tab.locator("#keys dt").all_inner_texts()
    assert len(keys) == len(set(keys))
    assert {"arrows", "-", "+ =", "0", "/"} <= set(keys)
    assert "k" not in keys  # there is no time bar


def test_the_console_is_filtered_by_words_exclusions_and_expressions(ros: RosSystem, open_tab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", LOG)
    tab = open_tab(Page(ros), "console")
    texts = tab.locator(".entry .text")
    expect(texts.filter(has_text="arm moves").first).to_be_visible()
    for typed, is_shown in (
        ("wheel -turns", {"wheel 1 slips"}),
        (r"/wheel \d t/", {"wheel 2 turns"}),
        (r"-/wheel \d/", {"arm moves"}),
        ("/[/", set()),
    ):
        tab.get_by_label("Filter by text").fill(typed)
        for text in ("wheel 1 slips", "arm moves", "wheel 2 turns"):
            count = texts.filter(has_text=text)
            if text in is_shown:
                expect(count.first).to_be_visible()
            else:
                expect(count).to_have_count(0)
    tab.get_by_label("Filter by text").fill("wheel -turns")
    tab.get_by_label("Filter by node").fill("/logger;")
    expect(texts).to_have_count(0)
    tab.get_by_label("Warn").uncheck()
    tab.reload()
    expect(tab.get_by_label("Filter by text")).to_have_value("wheel -turns")
    expect(tab.get_by_label("Filter by node")).to_have_value("/logger;")
    expect(tab.get_by_label("Warn")).not_to_be_checked()
    expect(tab.get_by_label("Info")).to_be_checked()
    tab.get_by_label("Filter by node").fill("/logger")
    expect(texts.filter(has_text="wheel 1 slips").first).to_be_visible()
    expect(texts.filter(has_text="wheel 2 turns")).to_have_count(0)


def test_the_console_begins_with_the_log_of_the_run(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    before = ros.pipros.start(sys.executable, "-c", LOG.replace("slips", "slipped"))

    def written() -> str:
        files = {file.resolve() for file in (ros.home / ".ros" / "log").glob("*/rosout.log")}
        return "".join(file.read_text() for file in files)

    wait_until(lambda: "wheel 1 slipped" in written(), 30, "the log file of the run")
    before.press_ctrl_c()
    before.wait()
    tab = open_tab(Page(ros), "console")
    expect(tab.locator(".entry .text", has_text="wheel 1 slipped").first).to_be_visible()
    count = tab.locator(".bar .count")

    def is_complete() -> bool:
        entries = written().count(" [topics: ")  # its last ones may be written after the node's end
        return count.inner_text() == f"{entries} of {entries}"

    wait_until(is_complete, 30, lambda: f"{count.inner_text()}:\n{written()}")


def test_the_log_is_saved_and_loaded(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", LOG)
    tab = open_tab(Page(ros), "console")
    tab.get_by_label("Filter by text").fill("arm")
    expect(tab.locator(".entry .text").first).to_have_text("arm moves")
    with tab.expect_download() as download:
        show_all_controls(tab)
        tab.get_by_role("button", name="Save").click()
    lines = [json.loads(line) for line in Path(download.value.path()).read_text().splitlines()]
    assert {line["text"] for line in lines} == {"arm moves"}
    saved = tmp_path / "old.jsonl"
    saved.write_text(json.dumps({**lines[0], "text": "arm of last week"}) + "\n")
    tab.get_by_label("Log file").set_input_files(saved)
    expect(tab.locator(".entry .text")).to_have_text(["arm of last week"])
    saved.write_text('{"text": 7}')
    tab.get_by_label("Log file").set_input_files(saved)
    expect(tab.locator(".error").first).to_have_text(
        "old.jsonl cannot be loaded: line 1: level must be a number"
    )


@pytest.mark.parametrize("width", [1024, 390])
def test_all_tabs_can_be_reached_on_a_narrow_window(ros: RosSystem, open_tab: OpenTab, width: int) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros), "graph", size=(width, 700))
    bar = tab.locator("#tabs").bounding_box()
    assert bar is not None
    assert bar["height"] < 50  # one row
    menu = tab.get_by_role("navigation", name="All views")
    for title in ("Overview", "Fleet"):
        tab.get_by_role("button", name="All views").click()
        menu.get_by_role("link", name=title).click()
        expect(menu).to_be_hidden()
        expect(tab.get_by_role("tab", selected=True)).to_have_text(title)
        expect(tab.get_by_role("tab", selected=True)).to_be_in_viewport(ratio=0.9)
    tab.set_viewport_size({"width": 1900, "height": 700})
    expect(tab.get_by_role("button", name="All views")).to_have_text("☰ More")


BEEP = """
import rospy
from std_msgs.msg import Float64
rospy.init_node("beeper")
out = rospy.Publisher("/level", Float64, queue_size=5)
rate = rospy.Rate(20)
for count in range(100000):
    out.publish(count % 7)
    if count % 100 == 20:
        rospy.logerr("beep %d", count)
    rate.sleep()
"""


def test_filters_are_kept_as_rules_and_entries_lead_to_their_moment(ros: RosSystem, open_tab) -> None:
    ros.pipros.start_master()
    page = Page(ros)
    tab = open_tab(page, "plot//level")
    ros.pipros.start(sys.executable, "-c", BEEP)
    expect(tab.locator(".legend")).to_contain_text(re.compile(r"/level: \d"))
    tab.evaluate("location.hash = 'console'")
    expect(tab.locator(".entry", has_text="beep").first).to_be_visible()
    tab.get_by_label("Info").uncheck()
    tab.get_by_label("Filter by text").fill("beep -nothing")
    show_all_controls(tab)
    tab.get_by_role("button", name="Rules").click()
    tab.get_by_label("Name of the rules").fill("only beeps")
    tab.get_by_role("button", name="Save the filters").click()
    expect(tab.get_by_role("button", name="only beeps", exact=True)).to_be_visible()
    other = open_tab(page, "console")
    show_all_controls(other)
    other.get_by_role("button", name="Rules").click()
    other.get_by_role("button", name="only beeps", exact=True).click()
    expect(other.get_by_label("Filter by text")).to_have_value("beep -nothing")
    expect(other.get_by_label("Info")).not_to_be_checked()
    other.get_by_role("button", name="Delete the rules only beeps").click()
    expect(other.locator("aside")).to_contain_text("No rules are saved.")
    tab.locator(".log").press("e")
    expect(tab.locator("aside")).to_contain_text("beep")
    keep_screenshots(tab, "console-moment")
    tab.locator("aside .moment").get_by_role("link", name="Plot").click()
    expect(tab).to_have_url(re.compile("#plot//level$"))
    expect(tab.get_by_role("button", name="Follow")).to_be_visible()
    keep_screenshots(tab, "plot-moment")
    tab.evaluate("location.hash = 'console'")
    tab.locator(".entry", has_text="beep").last.click()  # the other one may be older than a minute by now
    tab.locator("aside .moment").get_by_role("button", name="all views").click()
    expect(tab.locator("#shown-bag")).to_be_visible()


# The bell in the head of the page, and what it names as stale in the tabs.


ARM = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage
rospy.init_node("arm_driver")
transforms = rospy.Publisher("/tf", TFMessage, queue_size=10)
imus = rospy.Publisher("/arm/imu", Imu, queue_size=10)
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
moving = True
def stop(_):
    global moving
    moving = False
rospy.Subscriber("/stop", Empty, stop)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    if moving:
        made = TransformStamped()
        made.header.stamp = rospy.Time.now()
        made.header.frame_id, made.child_frame_id = "base", "hand"
        made.transform.rotation.w = 1
        transforms.publish(TFMessage([made]))
        imus.publish(Imu())
        diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(0, "/Arm/motor", "OK", "", [])]))
    rate.sleep()
"""
LISTENER = """
import rospy
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty
rospy.init_node("listener")
rospy.Subscriber("/arm/imu", Imu, lambda _: None)
rospy.Subscriber("/stop", Empty, lambda _: rospy.logerr("the arm does not answer"))
rospy.spin()
"""


def test_the_bell_lists_what_became_stale_and_errors_and_leads_there(ros: RosSystem, open_tab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", ARM)
    ros.pipros.start(sys.executable, "-c", LISTENER)
    ros.wait_for_publisher("/arm/imu")
    tab = open_tab(Page(ros), "topics")
    bell = tab.locator("#bell")
    row = tab.locator("tr[data-name='/arm/imu']")
    expect(row).to_contain_text(re.compile(r"\d Hz"))
    tab.wait_for_timeout(7000)  # for the intervals of six observations
    ros.pipros.start("rostopic", "pub", "-1", "/stop", "std_msgs/Empty")
    expect(bell).to_have_attribute("aria-label", re.compile(r"[3-9] stale now"))
    expect(row.locator(".stale")).to_have_text("stale")
    assert row.locator(".stale").evaluate("(each) => getComputedStyle(each).color") == "rgb(123, 63, 168)"
    tab.keyboard.press("a")
    menu = tab.get_by_role("group", name="Changes in the last minute")
    for text in ("stale frame hand", "stale topic /arm/imu", "stale component /Arm/motor"):
        expect(menu.get_by_role("link").filter(has_text=text.split(" ", 1)[1]).first).to_contain_text("stale")
    expect(menu).to_contain_text("node /listener the arm does not answer")
    keep_screenshots(tab, "bell")
    menu.get_by_role("link").first.press("ArrowDown")
    expect(menu.get_by_role("link").nth(1)).to_be_focused()
    menu.get_by_role("link").filter(has_text="frame hand").first.press("Enter")
    expect(menu).to_be_hidden()
    expect(tab).to_have_url(re.compile("#tf/hand$"))
    stale = tab.locator("tr[data-name='hand'] .stale").first
    expect(stale).to_have_text("stale")
    keep_screenshots(tab, "stale-frame")
    tab.evaluate("location.hash = 'diagnostics'")
    expect(tab.locator(".badge.diagnostic-3")).to_have_text("Stale: 1")
    keep_screenshots(tab, "stale-component")
    tab.evaluate("location.hash = 'graph/node:/listener'")
    expect(tab.locator("aside .stale")).to_have_text("stale")
    expect(tab.locator(".graph g.link.stale .arrow").first).to_be_attached()
    keep_screenshots(tab, "stale-graph")
