"""Lists that are redrawn: elements are kept, and clicks hit what they were meant for."""

import sys

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab
from tests.support.page import Page
from tests.support.ros import RosSystem

PROGRAM = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
rospy.init_node("reporter")
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
rate = rospy.Rate(20)
count = 0
while not rospy.is_shutdown():
    names = ["/arm", "/pump"] if rospy.has_param("/has_arm") else ["/pump"]
    diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(name=name, message="OK") for name in names]))
    if count % 20 == 0:
        rospy.logwarn("entry %d", count)
    count += 1
    rate.sleep()
"""
MORPH = """async () => {
  const { h, morph } = await import("/dom.js");
  const item = (key, text = key) => h("li", { "data-key": key }, text);
  const list = h("ul", {}, item("b"), item("gone"), item("c"), item("d"));
  const [b, , c, d] = list.children;
  document.body.append(list);
  const changed = h("ul", {}, item("a"), item("b", "new"), item("d"), item("c"), item("c", "again"), "text");
  morph(list, changed);
  const kept = [b, d, c].map((element) => [...list.children].indexOf(element));
  const plain = h("p", {}, h("b", {}, "one"), h("i", {}, "two"));
  const [bold] = plain.children;
  morph(plain, h("p", {}, h("b", {}, "1"), item("x"), "end"));
  return [kept, list.textContent, plain.firstChild === bold, plain.innerHTML];
}"""

TAB_STOP = """async () => {
  const { dataTable } = await import("/table.js");
  const table = dataTable([{ title: "Name", text: (row) => row, order: (row) => row }],
    { label: "Names", keyOf: (row) => row, onChoose: () => {}, sortBy: "Name" });
  document.body.append(table.element);
  const stops = [];
  for (const rows of [["b"], ["b", "a"], ["b", "a", "0"], ["a", "0"]]) {
    table.show(rows);
    if (stops.length === 1) table.element.querySelector("[data-name=b]").focus();
    stops.push([...table.element.querySelectorAll("[tabindex='0']")].map((row) => row.dataset.name).join());
  }
  return stops;
}"""


@pytest.fixture
def reporter(ros: RosSystem) -> RosSystem:
    """A system whose node reports `/pump`, and `/arm` once `/has_arm` is set."""
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", PROGRAM)
    ros.wait_for_publisher("/diagnostics")
    return ros


def test_elements_with_keys_are_kept(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    kept, text, is_same, html = open_tab(Page(ros), "graph").evaluate(MORPH)
    assert (kept, text) == ([1, 2, 3], "anewdcagaintext")
    assert (is_same, html) == (True, '<b>1</b><li data-key="x">x</li>end')


def test_tab_stops_at_the_first_row_until_another_had_the_focus(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    assert open_tab(Page(ros), "graph").evaluate(TAB_STOP) == ["b", "b", "b", "0"]


def press(tab: Tab, selector: str) -> None:
    """Press the button of the mouse on an element, without releasing it."""
    element = tab.locator(selector)
    expect(element).to_be_visible()
    box = element.bounding_box()
    assert box is not None
    tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    tab.mouse.down()


def test_a_click_hits_what_was_pressed_while_the_list_grows(reporter: RosSystem, open_tab: OpenTab) -> None:
    page = Page(reporter)
    tab, other = open_tab(page, "diagnostics"), open_tab(page, "diagnostics")
    tab.locator("#tabs a").first.focus()  # it loses the focus when something else is pressed
    press(tab, "button[data-name='/pump']")
    reporter.pipros.run("rosparam", "set", "/has_arm", "true")
    expect(other.locator("button[data-name='/arm']")).to_be_visible()
    tab.mouse.up()
    expect(tab.locator("aside h2")).to_have_text("/pump")
    expect(tab.locator("button[data-name='/arm']")).to_be_visible()


def test_rows_of_the_log_stay_selected_and_can_be_clicked(reporter: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(reporter), "console", size=(1000, 3000))
    first = tab.locator(".entry .text").first
    first.evaluate("(element) => getSelection().selectAllChildren(element)")
    shown = tab.locator(".entry").count()
    expect(tab.locator(".entry").nth(shown + 1)).to_be_attached()
    assert tab.evaluate("String(getSelection())") == first.text_content()
    tab.evaluate("getSelection().removeAllRanges()")
    first.click()
    expect(tab.locator("aside pre")).to_have_text(first.text_content() or "")
