"""Where the page begins, the layout Robot, tabs without data, and panels on a phone."""

from __future__ import annotations

import re

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, go_to, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def test_the_page_begins_with_the_robot_and_then_at_the_last_view(
    robot: RosSystem, open_tab: OpenTab
) -> None:
    page = Page(robot, command="rqt")
    tab = open_tab(page, "", (1440, 900))
    expect(tab.get_by_role("region", name="Scene")).to_be_visible()
    assert tab.locator(".panel").count() >= 4
    plot = tab.get_by_role("region", name="Plot")
    expect(plot.locator(".legend")).to_contain_text(re.compile(r"z: -?\d"))
    expect(plot.locator(".subject")).to_contain_text("/imu/")
    expect(tab.get_by_role("region", name="Scene").locator(".subject")).to_have_text("")
    expect(tab.get_by_role("region", name="Images").first).to_contain_text("rgb8")
    expect(tab.get_by_role("region", name="Console").locator(".entry").first).to_be_visible()
    keep_screenshots(tab, "robot-layout")
    go_to(tab, "Topics")
    expect(tab.get_by_role("row", name="/battery")).to_be_visible()
    tab.evaluate("location.hash = ''")
    expect(tab).to_have_url(re.compile("#topics$"))
    go_to(tab, "Overview")
    expect(tab.get_by_role("region", name="Scene")).to_be_visible()
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Overview")
    tab.go_back()
    expect(tab).to_have_url(re.compile("#topics$"))


def test_the_scene_shows_the_robot_and_what_it_sees_without_a_click(
    robot: RosSystem, open_tab: OpenTab
) -> None:
    tab = open_tab(Page(robot, command="rqt"), "scene", (1440, 900))
    scene = "document.querySelector('.tab-scene')?.scene"
    middle = f"{scene}?.view?.get('Target Frame')"
    wait_until(lambda: tab.evaluate(middle) == "base_link", 60, "the scene of the robot")
    assert tab.evaluate(f"{scene}.displays.map((each) => each.config.Class)")[0] == "rviz/Grid"
    assert tab.evaluate("location.hash") == "#scene"  # the address changes only with the user's changes


def test_without_transforms_the_page_begins_with_the_graph(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros, command="rqt"), "")
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Graph")
    expect(tab).to_have_url(re.compile("#graph$"))


def test_tabs_without_data_are_folded_until_they_have_some(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros, "--control"), "graph", (1440, 900))
    more = tab.get_by_role("button", name="All views")
    expect(more).to_have_text("☰ More")
    visible = tab.locator("#tabs a:visible")
    expect(visible).to_have_text(
        [
            "Overview", "Graph", "Scene", "Plot", "Topics", "Console", "Parameters", "Nodes", "Services",
            "Publish",
        ]
        + (["Acts"] if tab.locator("[data-tab=acts]:visible").count() else [])
    )  # fmt: skip
    keep_screenshots(tab, "folded-tabs")
    ros.pipros.start("rostopic", "pub", "-r", "5", "/diagnostics", "diagnostic_msgs/DiagnosticArray", "{}")
    expect(tab.get_by_role("tab", name="Diagnostics")).to_be_visible()
    more.click()
    tab.get_by_role("navigation", name="All views").get_by_role("link", name="Fleet").click()
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Fleet")  # a selected tab is not folded
    go_to(tab, "Graph")
    expect(tab.get_by_role("tab", name="Fleet")).to_be_hidden()


def test_a_phone_shows_one_panel_at_a_time(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "panels/row(topics//tf~column(console~tf))", (390, 800))
    expect(tab.get_by_role("region", name="Topics")).to_be_visible()
    expect(tab.locator(".subject").first).to_have_text("/tf")
    expect(tab.locator(".subject").first).to_be_hidden()  # it would lie over the view
    expect(tab.locator(".panel:visible")).to_have_count(1)
    box = tab.locator(".panel:visible").bounding_box()
    assert box is not None
    assert box["width"] > 380
    tab.get_by_label("Panel", exact=True).select_option(label="3 of 3: TF")
    expect(tab.get_by_role("region", name="TF")).to_contain_text("wheel_left")
    expect(tab.locator(".panel:visible")).to_have_count(1)
    keep_screenshots(tab, "panels-phone")
    tab.set_viewport_size({"width": 1200, "height": 800})
    expect(tab.locator(".panel:visible")).to_have_count(3)
