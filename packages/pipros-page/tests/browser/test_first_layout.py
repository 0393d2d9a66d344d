"""Where the page begins, the layout Robot, tabs without data, and panels on a phone."""

import re
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, go_to, keep_screenshots
from tests.support import page_bundle
from tests.support.npm import INSTALL
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def test_the_page_begins_with_the_robot_and_then_at_the_last_view(robot: RosSystem, open_tab) -> None:
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


def test_the_scene_shows_the_robot_and_what_it_sees_without_a_click(robot: RosSystem, open_tab) -> None:
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


# How much a browser requests before it shows something: one bundle; three.js comes with a scene.


class Transfers:
    """The files that a tab has received, and their sizes as transferred, heads included."""

    def __init__(self, tab: Tab) -> None:
        self.bytes = 0
        self.paths: list[str] = []
        session = tab.context.new_cdp_session(tab)
        session.on("Network.requestWillBeSent", self._note_request)
        session.on("Network.loadingFinished", self._note_bytes)
        session.send("Network.enable")

    def _note_request(self, event: dict[str, Any]) -> None:
        self.paths.append(urlsplit(event["request"]["url"]).path)

    def _note_bytes(self, event: dict[str, Any]) -> None:
        self.bytes += event["encodedDataLength"]


def test_a_graph_needs_few_requests_and_a_scene_one_library_more(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    page = Page(ros)
    tab = open_tab(page, "graph")
    tab.goto("about:blank")
    transfers = Transfers(tab)
    tab.goto(page.url_of("graph"))
    expect(tab.locator(".tab-graph")).to_contain_text("Nothing to show")
    assert len(transfers.paths) + 1 <= 12, transfers.paths  # and the WebSocket
    assert transfers.bytes <= 150_000
    assert not any("three" in path for path in transfers.paths)
    tab.goto(page.url_of("scene"))
    expect(tab.locator(".tab-scene canvas").first).to_be_visible()
    wait_until(lambda: tab.evaluate("!!document.querySelector('.tab-scene').scene"), 60, "the scene")
    assert "/bundle/three.js" in transfers.paths
    assert len(transfers.paths) + 1 <= 12, transfers.paths
    assert transfers.bytes <= 600_000


def test_developers_get_the_modules_themselves(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    page = Page(ros)
    tab = open_tab(page, "graph")
    tab.goto("about:blank")
    transfers = Transfers(tab)
    tab.goto(page.url_of("graph").replace("/#", "/index.html#"))
    expect(tab.locator(".tab-graph")).to_contain_text("Nothing to show")
    assert "/tabs/graph.js" in transfers.paths
    assert "/bundle/app.js" not in transfers.paths


def test_the_bundle_is_what_esbuild_makes_of_the_sources() -> None:
    if not page_bundle.ESBUILD.exists():
        pytest.skip(f"esbuild is not on this machine: {INSTALL}")
    assert page_bundle.differences() == []
