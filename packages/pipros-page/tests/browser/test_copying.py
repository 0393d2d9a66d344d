"""Messages, values and rows are copied; tables are saved."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

TWIST = "{linear: {x: 0.5, y: 0.0, z: 0.0}, angular: {x: 0.0, y: 0.0, z: -1.25}}"


@pytest.fixture
def tab(ros: RosSystem, open_tab: OpenTab) -> Tab:
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "/cmd_vel", "geometry_msgs/Twist", TWIST, "__name:=driver")
    ros.wait_for_publisher("/cmd_vel")
    tab = open_tab(Page(ros), "topics//cmd_vel")
    tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    expect(tab.locator(".message")).to_contain_text("-1.25")
    expect(tab.locator("tr[data-name='/cmd_vel']")).to_contain_text("/driver")
    tab.evaluate(NOTE_COPIED)
    return tab


# Notes the titles and texts of elements that say for a second that something was copied.
NOTE_COPIED = """() => {
  window.noted = [];
  new MutationObserver((changes) => {
    for (const { target } of changes) {
      if (!(target instanceof Element)) continue;
      if (target.matches(".copied") || target.textContent === "copied") {
        window.noted.push(`${target.title}: ${target.textContent}`);
      }
    }
  }).observe(document.body, { subtree: true, childList: true, attributes: true, attributeFilter: ["class"] });
}"""


def wait_for_note(tab: Tab, text: str) -> None:
    wait_until(lambda: text in tab.evaluate("window.noted"), 30, lambda: str(tab.evaluate("window.noted")))


def copied(tab: Tab) -> str:
    return str(tab.evaluate("navigator.clipboard.readText()")).replace("\r\n", "\n")


def test_a_message_is_copied_as_yaml_and_json(tab: Tab) -> None:
    tab.get_by_role("button", name="YAML").click()
    wait_for_note(tab, "Copy as YAML: copied")
    assert "angular: \n  x: 0.0\n  y: 0.0\n  z: -1.25" in copied(tab)
    tab.get_by_role("button", name="JSON").click()
    wait_for_note(tab, "Copy as JSON: copied")
    assert json.loads(copied(tab))["linear"] == {"x": 0.5, "y": 0.0, "z": 0.0}


def test_the_name_of_a_field_copies_its_value(tab: Tab) -> None:
    tab.locator(".message button.key", has_text="z:").last.press("Enter")
    wait_for_note(tab, "Copy the value: z:")
    assert copied(tab) == "-1.25"


def test_a_row_is_copied_with_the_keyboard(tab: Tab) -> None:
    tab.locator("tr[data-name='/cmd_vel']").focus()
    tab.keyboard.press("Control+c")
    assert copied(tab).split("\t")[:3] == ["/cmd_vel", "geometry_msgs/Twist", "/driver"]


def test_a_table_is_saved_as_csv(tab: Tab) -> None:
    with tab.expect_download() as download:
        tab.locator(".tab-topics").get_by_role("button", name="CSV").click()
    lines = Path(download.value.path()).read_text().splitlines()
    assert lines[0] == "Topic,Type,Publishers,Subscribers,Rate,Bandwidth"
    assert any(line.startswith("/cmd_vel,geometry_msgs/Twist,/driver,") for line in lines)
