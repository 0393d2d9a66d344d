"""Actions in the tabs: control, filters."""

import json
import re
import sys

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import WebSocketRoute, expect

from tests.browser.chromium import OpenTab, go_to, keep_screenshots, start_robot
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def test_with_control_a_parameter_is_set_on_the_page(robot: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(robot, "--control"), "params")
    tab.get_by_label("Name").fill("/robot/from_the_page")
    tab.get_by_label("Value").fill("[1, 2]")
    tab.get_by_role("button", name="Set").click()
    expect(tab.locator(".params")).to_contain_text("from_the_page: [1, 2]")
    robot.pipros.run("rosparam", "set", "/robot/long", "x" * 10_000)
    tab.locator("button[data-name='/robot/long']").click()
    expect(tab.get_by_label("Value")).to_be_focused()
    tab.keyboard.press("Enter")  # an empty value is not written in the place of one that is too long to edit
    tab.get_by_label("Name").fill("/robot/from_the_page")
    tab.get_by_role("button", name="Set").click()
    expect(tab.locator(".params")).to_contain_text('from_the_page: ""')
    assert robot.pipros.run("rosparam", "get", "/robot/long").stdout == ["x" * 10_000]


def test_with_control_a_service_is_called_and_a_message_published(robot: RosSystem, open_tab) -> None:
    page = Page(robot, "--control")
    tab = open_tab(page, "services/%2Frobot%2Fget_loggers")
    tab.get_by_role("button", name="Call").click()
    expect(tab.locator(".answer")).to_contain_text("rosout")
    tab = open_tab(page, "publish")
    tab.get_by_label("Topic").fill("/chatter")
    tab.get_by_label("Type").fill("std_msgs/String")
    tab.get_by_label("Type").press("Tab")
    message = tab.get_by_label("Message in YAML")
    expect(message).to_have_value('data: ""')
    message.fill("data: hello")
    tab.get_by_label("Rate in hertz").fill("")
    tab.get_by_role("button", name="Publish", exact=True).click()
    expect(tab.locator("[aria-label='Rate in hertz']:invalid")).to_have_count(1)
    tab.get_by_label("Rate in hertz").fill("1")
    tab.get_by_role("button", name="Publish", exact=True).click()
    assert robot.pipros.run("rostopic", "echo", "-n1", "/chatter").stdout[0] == 'data: "hello"'


def test_a_late_answer_does_not_replace_that_of_a_newer_question(robot: RosSystem, open_tab: OpenTab) -> None:
    asked: list[str | bytes] = []
    answered: list[int] = []

    def hold_the_first(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()

        def ask(text: str | bytes) -> None:
            if '"action":"service"' in str(text):
                asked.append(text)
            if asked[:1] != [text]:
                server.send(text)

        def answer(text: str | bytes) -> None:
            socket.send(text)
            number = json.loads(text).get("id") if isinstance(text, str) else None
            ids = [json.loads(each)["id"] for each in asked]
            answered.extend({number}.intersection(ids))
            if ids[1:] == [number]:
                server.send(asked[0])

        socket.on_message(ask)
        server.on_message(answer)

    tab = open_tab(Page(robot, "--control"), "topics")
    tab.route_web_socket("**/live", hold_the_first)
    tab.reload()
    for number, each in enumerate(("/nowhere", "/robot/get_loggers"), 1):
        tab.evaluate("(place) => { location.hash = place; }", f"services/{each}")
        wait_until(lambda: tab.title() and len(asked) >= number, 30, "the question")  # noqa: B023
    wait_until(lambda: tab.title() and len(answered) >= 2, 60, "both answers")
    expect(tab.locator("aside:visible")).to_contain_text("Call")
    expect(tab.locator("aside:visible .error")).to_have_count(0)


FAILING = """
import rospy
from std_srvs.srv import SetBool

def fail(_):
    raise ValueError("no grün")

rospy.init_node("gate")
rospy.Service("open", SetBool, fail)
rospy.spin()
"""


def test_errors_and_definitions_of_services_are_readable(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", FAILING)
    ros.pipros.run("rosservice", "info", "/open")
    page = Page(ros, "--control")
    with page.connect() as browser:
        wait_until(lambda: "type" in browser.act("service", name="/open"), 30, "the service")
    tab = open_tab(page, "services/%2Fopen")
    tab.get_by_text("Definition").click()
    expect(tab.locator(".definition pre")).to_contain_text(re.compile(r"bool data.*\n---\nbool success"))
    tab.get_by_role("button", name="Call").click()
    expect(tab.locator(".answer .error")).to_have_text(
        "the service replied with an error: error processing request: no grün"
    )
    tab.get_by_label("Request in YAML").fill("data: [1]")
    tab.get_by_role("button", name="Call").click()
    expect(tab.locator(".answer .error")).to_contain_text(
        "srv file:\nbool data\n---\nbool success", use_inner_text=True
    )


def test_a_topic_has_its_definition_with_comments(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "topics/%2Fimu")
    tab.get_by_text("Definition").click()
    expect(tab.locator(".definition pre")).to_contain_text("geometry_msgs/Quaternion orientation")
    expect(tab.locator(".definition pre")).to_contain_text("#")


def test_the_console_filters(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "console")
    expect(tab.locator(".entry").first).to_be_visible()
    tab.get_by_label("Filter by text").fill("no message has this text")
    expect(tab.locator(".entry")).to_have_count(0)
    tab.get_by_label("Filter by text").fill("SLIPS")
    expect(tab.locator(".entry").first).to_contain_text("Warn")
    tab.locator(".entry").first.click()
    expect(tab.locator("aside")).to_contain_text("robot_program.py")


def test_a_number_leads_to_its_curve_and_keeps_the_focus(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "topics/%2Fimu")
    number = tab.get_by_title("Plot /imu/angular_velocity/y")
    number.focus()
    before = number.inner_text()
    expect(number).not_to_have_text(before)  # newer messages arrived
    expect(number).to_be_focused()
    expect(tab.locator("aside dl")).to_contain_text(re.compile(r"Rate[\d.]+ HzBandwidth[\d.]+ kB/s"))
    tab.keyboard.press("Enter")
    expect(tab.locator(".legend")).to_contain_text(re.compile(r"/imu/angular_velocity/y: -?\d"))


def test_a_node_is_shown_with_its_parameters(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph/node:/robot")
    expect(tab.locator("aside")).to_contain_text("drive/gains: [1.2, 0.0, 0.05]")
    expect(tab.locator("aside")).to_contain_text("/robot/get_loggers")


def press_tab_until(tab: Tab, selector: str) -> None:
    """Press Tab until the element has the focus; scrollable regions and column headers may precede it."""
    for _ in range(12):
        tab.keyboard.press("Tab")
        if tab.evaluate("selector => document.activeElement.matches(selector)", selector):
            return
    raise AssertionError(f"{selector} did not get the focus")


def test_with_control_a_node_is_ended_after_a_second_click(ros: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(start_robot(ros), "--control"), "graph/node:/robot")
    expect(tab.locator("aside")).to_contain_text(re.compile(r"warn: wheel slips: \d+"))
    keep_screenshots(tab, "node")
    tab.get_by_role("button", name="End node").click()
    tab.get_by_role("button", name="Really end /robot?").click()
    expect(tab.locator("aside .error").filter(has_text="no longer knows")).to_be_visible()


def test_without_control_no_node_can_be_ended(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph/node:/robot")
    expect(tab.locator("aside")).to_contain_text("Publications")
    expect(tab.get_by_role("button", name="End node")).to_have_count(0)
    with page.connect() as browser:
        assert "read-only" in browser.act("kill_node", name="/robot")["error"]


def test_the_page_can_be_used_with_keyboard_and_roles(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph")
    expect(tab.get_by_role("heading", level=1)).to_have_text("pipros")
    tab.get_by_role("tab", name="Graph").focus()
    tab.keyboard.press("ArrowRight")
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Scene")
    go_to(tab, "Topics")
    expect(tab.get_by_role("main").get_by_role("tabpanel", name="Topics")).to_be_visible()
    row = tab.get_by_role("row", name="/battery")
    expect(row).to_be_visible()
    press_tab_until(tab, "[aria-label='Filter topics']")
    tab.keyboard.type("/battery")
    expect(tab.locator("tbody tr")).to_have_count(1)
    press_tab_until(tab, "[data-name='/battery']")
    tab.keyboard.press("Enter")
    expect(tab.get_by_role("complementary", name="Topic")).to_contain_text("sensor_msgs/BatteryState")
    expect(tab.get_by_role("meter", name="Level")).to_have_attribute("aria-valuenow", "62.5")
    tab.keyboard.press("Escape")  # the focus is on the row
    expect(tab.get_by_role("complementary", name="Topic")).to_be_hidden()
    expect(tab).to_have_url(re.compile("#topics$"))
    tab.get_by_role("tab", selected=True).focus()
    tab.keyboard.press("End")
    # those of ROS 2 and others have no data
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Acts")
    tab.keyboard.press("Home")
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Overview")


@pytest.mark.parametrize(
    "place", ["graph", "topics", "plot", "console", "params", "reconfigure", "publish", "panels"]
)
def test_each_tab_fits_a_phone(page: Page, open_tab: OpenTab, place: str) -> None:
    tab = open_tab(page, place, size=(390, 800))
    expect(tab.get_by_role("tab", selected=True)).to_be_in_viewport()
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    if place == "console":  # one row of controls, which scrolls
        assert tab.locator("#view .bar").first.bounding_box()["height"] < 60  # type: ignore[index]
    if place == "topics":
        name = tab.locator("[data-name='/front/image_raw'] td").first
        expect(name).to_be_visible()
        assert name.evaluate("(cell) => cell.scrollWidth <= cell.clientWidth")
    keep_screenshots(tab, f"{place}-phone")
