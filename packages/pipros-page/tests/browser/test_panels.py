"""Views side by side: arranging them, what they share, and layouts that are stored and opened."""

import json
import re
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest
from playwright.sync_api import Locator, expect
from playwright.sync_api import Page as Tab

from tests.browser.chromium import OpenTab, go_to, keep_screenshots
from tests.browser.every_tab import names_of_tabs
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIZE, SMALL_SIZE = re.compile("96 . 64"), re.compile("8 . 4")
TWO_PLOTS = "panels/row(plot//imu/angular_velocity/x~plot//imu/angular_velocity/y)"
FOUR = (
    "panels/column(row(plot//imu/angular_velocity/x~images//front/image_raw)*60"
    "~row(images//camera/image_raw~console)*40)"
)


def panel(tab: Tab, name: str, number: int = 0) -> Locator:
    return tab.get_by_role("region", name=name, exact=True).nth(number)


def layout_of(tab: Tab) -> str:
    """Return the layout in the address, without the sizes."""
    # Not `tab.url`, which changes only while Playwright handles events.
    return re.sub(r"\*[\d.]+", "", unquote(tab.evaluate("location.hash")[1:]))


def expect_layout(tab: Tab, text: str) -> None:
    wait_until(lambda: layout_of(tab) == text, 30, lambda: f"the address is {layout_of(tab)}, not {text}")


def left_of(locator: Locator) -> float:
    box = locator.bounding_box()
    assert box is not None
    return box["x"]


def test_several_plots_and_images_show_data_at_once(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, FOUR)
    expect(tab.locator(".panel")).to_have_count(4)
    expect(panel(tab, "Plot").locator(".legend")).to_contain_text(re.compile(r"x: -?\d"))
    expect(panel(tab, "Images", 0)).to_contain_text(SIZE)
    expect(panel(tab, "Images", 1)).to_contain_text(SMALL_SIZE)
    expect(panel(tab, "Console").locator(".entry").first).to_be_visible()
    keep_screenshots(tab, "panels")
    tab.reload()
    expect(panel(tab, "Images", 1)).to_contain_text(SMALL_SIZE)
    expect_layout(tab, re.sub(r"\*[\d.]+", "", FOUR))


def test_panels_are_split_enlarged_and_closed(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/console")
    console = panel(tab, "Console")
    console.get_by_role("button", name="Split: another panel below").click()
    expect(tab.locator(".panel")).to_have_count(2)
    panel(tab, "Console", 1).get_by_label("View", exact=True).select_option("tf")
    expect(panel(tab, "TF")).to_contain_text("wheel_left")
    expect_layout(tab, "panels/column(console~tf)")
    panel(tab, "TF").get_by_role("button", name="Enlarge").click()
    expect(console).to_be_hidden()
    panel(tab, "TF").get_by_role("button", name="Enlarge").click()
    expect(console).to_be_visible()
    panel(tab, "TF").get_by_role("button", name="Close", exact=True).click()
    expect(tab.locator(".panel")).to_have_count(1)
    tab.go_back()
    expect(panel(tab, "TF")).to_contain_text("wheel_left")


def test_a_panel_is_dragged_to_an_edge_of_another(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(console~tf)")
    expect(panel(tab, "TF")).to_contain_text("wheel_left")
    box = panel(tab, "TF").bounding_box()
    assert box is not None
    panel(tab, "Console").get_by_role("button", name="Move Console").hover()
    tab.mouse.down()
    tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] - 20, steps=5)
    expect(panel(tab, "TF")).to_have_attribute("data-drop", "below")
    tab.mouse.up()
    expect_layout(tab, "panels/column(tf~console)")
    expect(panel(tab, "TF")).not_to_have_attribute("data-drop", "below")


def test_panels_are_moved_and_resized_with_the_keyboard(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(console~tf)")
    expect(panel(tab, "TF")).to_contain_text("wheel_left")
    panel(tab, "Console").get_by_role("button", name="Move Console").press("ArrowRight")
    expect_layout(tab, "panels/row(tf~console)")
    expect(panel(tab, "Console").get_by_role("button", name="Move Console")).to_be_focused()
    before = left_of(panel(tab, "Console"))
    border = tab.get_by_role("separator")
    border.press("ArrowLeft")
    border.press("ArrowLeft")
    wait_until(lambda: left_of(panel(tab, "Console")) < before, 30, "the moved border")
    expect(border).to_have_attribute("aria-valuenow", "46")


def test_a_border_is_dragged(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(console~tf)")
    expect(panel(tab, "TF")).to_contain_text("wheel_left")
    tab.get_by_role("separator").hover()
    tab.mouse.down()
    tab.mouse.move(300, 300, steps=3)
    tab.mouse.up()
    wait_until(lambda: left_of(panel(tab, "TF")) == pytest.approx(300, abs=6), 30, "the place of the panel")
    wait_until(lambda: "*25~" in unquote(tab.evaluate("location.hash")), 30, "the new sizes in the address")


RANGE = """panel => {
  const over = panel.querySelector(".u-over").getBoundingClientRect();
  return [over.left, over.top, over.width, over.height];
}"""


def drag_over(tab: Tab, plot: Locator) -> None:
    """Zoom a plot to the last part of its time axis."""
    left, top, width, height = plot.evaluate(RANGE)
    tab.mouse.move(left + width * 0.9, top + height / 2)
    tab.mouse.down()
    tab.mouse.move(left + width * 0.95, top + height / 2, steps=4)
    tab.mouse.up()


def labels(plot: Locator) -> str:
    """Return a picture of the time axis, which changes as long as the plot follows."""
    return str(plot.locator("canvas").evaluate("canvas => canvas.toDataURL()"))


def is_still(tab: Tab, plot: Locator) -> bool:
    """Return whether a plot stays unchanged while new samples arrive."""
    before = labels(plot)
    legend = plot.locator(".legend")
    value = legend.inner_text()
    wait_until(lambda: legend.inner_text() != value, 30, "a new sample")
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return labels(plot) == before


def test_linked_plots_zoom_together_and_follow_again(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, TWO_PLOTS)
    first, second = panel(tab, "Plot", 0), panel(tab, "Plot", 1)
    for plot in (first, second):
        expect(plot.locator(".legend")).to_contain_text(re.compile(r": -?\d"))
    assert not is_still(tab, second)
    drag_over(tab, first)
    expect(second.locator(".legend .at")).to_contain_text("at ")  # the cursor, too
    tab.mouse.move(5, 5)
    wait_until(lambda: is_still(tab, second), 30, "the zoom of the other plot")
    first.locator(".u-over").dblclick()
    tab.mouse.move(5, 5)
    wait_until(lambda: not is_still(tab, second), 30, "the other plot to follow")
    tab.get_by_label("Link time axes").uncheck()
    drag_over(tab, first)
    tab.mouse.move(5, 5)
    assert not is_still(tab, second)


def test_a_number_in_one_panel_leads_to_the_plot_beside(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(topics//imu~plot)")
    panel(tab, "Topics").get_by_title("Plot /imu/angular_velocity/y").click()
    expect(panel(tab, "Plot").locator(".legend")).to_contain_text(re.compile(r"y: -?\d"))
    expect_layout(tab, "panels/row(topics//imu~plot//imu/angular_velocity/y)")
    panel(tab, "Topics").get_by_title("Plot /imu/angular_velocity/x").click()
    expect(panel(tab, "Plot").locator(".legend .curve")).to_have_count(2)


def test_any_tab_is_added_to_the_panels(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/console")
    expect(panel(tab, "Console").locator(".entry").first).to_be_visible()
    go_to(tab, "Images")
    tab.get_by_label("Topic", exact=True).select_option("/front/image_raw")
    link = tab.get_by_role("link", name="Add this view to the panels")
    expect(link).to_have_attribute("href", re.compile("image_raw"))
    link.click()
    expect(panel(tab, "Images")).to_contain_text(SIZE)
    expect_layout(tab, "panels/row(console~images//front/image_raw)")
    tab.get_by_label("Add a panel").select_option("nodes")
    expect(panel(tab, "Nodes")).to_contain_text("/robot")
    expect_layout(tab, "panels/row(column(console~nodes)~images//front/image_raw)")


def test_the_first_view_that_is_added_is_added_once(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "plot//imu/angular_velocity/x")
    tab.get_by_role("link", name="Add this view to the panels").click()
    expect_layout(tab, "panels/plot//imu/angular_velocity/x")


def test_hidden_panels_pause_and_curves_go_on(robot: RosSystem, page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(topics//battery~plot//imu/angular_velocity/x)")
    expect(panel(tab, "Topics").get_by_role("meter")).to_be_visible()
    expect(panel(tab, "Plot").locator(".legend")).to_contain_text(re.compile(r": -?\d"))
    go_to(tab, "Publish")
    expect(tab.locator(".panels")).to_be_hidden()

    def subscribers(topic: str) -> str:
        return "\n".join(robot.pipros.run("rostopic", "info", topic).stdout)

    wait_until(lambda: "rqt_graph" not in subscribers("/battery"), 60, "the end of the subscription")
    assert "rqt_graph" in subscribers("/imu")
    go_to(tab, "Overview")
    wait_until(lambda: "rqt_graph" in subscribers("/battery"), 60, "the subscription of the panel")


def test_layouts_are_stored_for_all_browsers(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(console~tf)")
    tab.get_by_role("button", name="Layout ▾").click()
    tab.keyboard.type("driving\n")
    expect(tab.get_by_label("Stored layouts").locator("option")).to_have_text(["Open a layout", "driving"])
    other = open_tab(page, "panels/graph")
    other.get_by_role("button", name="Layout ▾").click()
    other.get_by_label("Stored layouts").select_option("driving")
    expect(panel(other, "TF")).to_be_visible()
    expect_layout(other, "panels/row(console~tf)")
    other.get_by_role("button", name="Delete", exact=True).click()
    expect(other.get_by_label("Stored layouts").locator("option")).to_have_text(["No layouts stored"])


def test_layouts_are_exported_and_imported(robot: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    page = Page(robot, "--read-only")
    tab = open_tab(page, "panels/row(console~tf//base>camera)")
    expect(tab.get_by_text("Delete", exact=True)).to_be_disabled()
    with page.connect() as browser:
        answer = browser.act("save_layout", name="x", panels="graph")
    assert "may not store layouts" in answer["error"]
    with tab.expect_download() as download:
        tab.keyboard.press("o")
        tab.get_by_role("button", name="Export").click()
    file = tmp_path / "mine.json"
    download.value.save_as(file)
    other = open_tab(page, "panels/graph")
    other.get_by_label("Layout file").set_input_files(file)
    expect(panel(other, "TF")).to_be_visible()
    # Frames have no leading slash.
    expect_layout(other, "panels/row(console~tf/base>camera)")
    file.write_text("{}")
    other.get_by_label("Layout file").set_input_files(file)
    expect(other.get_by_role("alert").first).to_have_text(
        "mine.json is not a layout file: pipros_layout must be 1, and panels a string"
    )
    expect(panel(other, "TF")).to_be_visible()


def test_a_malformed_layout_is_explained(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(console~nonsense)")
    expect(tab.get_by_role("alert").first).to_contain_text("names an unknown view, nonsense")


def test_arguments_with_signs_survive_the_address(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(params/a!28b!29!7e~console)")
    expect(panel(tab, "Parameters").get_by_label("Search parameters")).to_have_value("a(b)~")


def test_a_launch_file_opens_a_layout_and_a_perspective(robot: RosSystem, open_tab, tmp_path) -> None:
    layout = tmp_path / "driving.json"
    layout.write_text(json.dumps({"pipros_layout": 1, "panels": "row(console*70~tf*30)"}))
    page = Page(robot, "--perspective-file", layout, command="rqt")
    tab = open_tab(page, page.place)
    expect(panel(tab, "TF")).to_be_visible()
    running = {"running-plugins": {"type": "repr", "repr": "{'rqt_top/Top': [1], 'rqt_shell/Shell': [1]}"}}
    old = tmp_path / "old.perspective"
    old.write_text(json.dumps({"keys": {}, "groups": {"pluginmanager": {"keys": running}}}))
    launch = tmp_path / "rqt.launch"
    launch.write_text(
        '<launch><node pkg="rqt_gui" type="rqt_gui" name="rqt" output="screen" '
        f'args="--no-browser --perspective-file {old}"/></launch>'
    )
    process = robot.pipros.start("roslaunch", launch)
    process.wait_for("the page has no tab for rqt_shell")
    assert unquote(Page.of(process).place) == "panels/nodes"
    process.press_ctrl_c()


CONTENTS = {
    "Graph": ".vertex", "Topics": "tbody tr", "Plot": ".note", "Console": ".entry",
    "Parameters": ".params li", "Nodes": "tbody tr", "Images": "select[aria-label=Topic] option >> nth=1",
    "TF": "tbody tr", "Scene": "canvas", "Diagnostics": "tbody tr", "Services": "thead",
    "Publish": "textarea", "Actions": "thead", "Teleop": ".stick", "Reconfigure": ".servers",
    "Fleet": "thead", "Bags": ".note", "ROS 2": ".note", "Acts": ".note",
}  # fmt: skip


def test_the_view_of_every_tab_can_be_a_panel(page: Page, open_tab: OpenTab) -> None:
    names = sorted(names_of_tabs() - {"panels", "launches"})  # the panels themselves, and a part of the nodes
    for half in (names[::2], names[1::2]):
        views = f"row({'~'.join(half[::2])})~row({'~'.join(half[1::2])})"
        tab = open_tab(page, f"panels/column({views})", size=(1800, 1000))
        count = views.count("~") + 1
        expect(tab.locator(".panel")).to_have_count(count)
        shown = [name for name in CONTENTS if panel(tab, name).count()]
        assert len(shown) == count, f"add a title to CONTENTS for each tab of {half}"
        for name in shown:
            expect(panel(tab, name).locator(CONTENTS[name]).first).to_be_attached()
        titles = set(tab.get_by_role("tab").all_inner_texts()) - {"Overview"}
        assert titles <= CONTENTS.keys(), "add what a new tab shows to CONTENTS"
        keep_screenshots(tab, f"panels-of-{shown[0]}")


# Lists that are redrawn: elements are kept, and clicks hit what they were meant for.


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


# What a user cannot use in narrow panels: controls below "…", those outside of their panel, and small texts.
HIDDEN = """() => [...document.querySelectorAll(".panel :is(button, input, textarea, .stick, .legend span)")]
  .filter((each) => {
    const panel = each.closest(".panel").getBoundingClientRect();
    const { right, bottom, width } = each.getBoundingClientRect();
    const more = each.closest(".toolbar.full")?.querySelector(".more");
    const isBelow = more && more !== each && right > more.getBoundingClientRect().left;
    const isSmall = each.matches("textarea") && width < 180;
    const isOutside = right > panel.right || bottom > panel.bottom || isSmall;
    return each.checkVisibility({ visibilityProperty: true }) && (isBelow || isOutside);
  }).map((each) => each.outerHTML.slice(0, 150))"""
LONG = "=" + "%2B".join(f"m.angular_velocity.{axis}" for axis in "xyz" * 9)


def test_narrow_panels_show_their_controls(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, f"panels/row(plot//imu{LONG}~teleop~publish)")
    expect(panel(tab, "Plot").locator(".legend")).to_contain_text(re.compile(r": -?\d"))
    panel(tab, "Plot").get_by_role("button", name="Controls of this view").click()
    for width in (1280, 960, 1440):
        tab.set_viewport_size({"width": width, "height": 800})
        tab.wait_for_function(f"() => ({HIDDEN})().length === 0")
