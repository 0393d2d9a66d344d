"""Every action can be reached with the keyboard alone, and with a thumb on a phone."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.conftest import OpenTab, keep_screenshots
from tests.browser.test_accessibility import OPEN_DETAILS
from tests.browser.test_bags_tab import make_bag
from tests.support.page import Page
from tests.support.ros import RosSystem

ROBOT = Path(__file__).parent / "programs" / "robot_program.py"
TABS = {
    "graph/node:%2Frobot": "aside h3",
    "topics/%2Fimu": "aside .message li",
    "plot/%2Fimu%2Fangular_velocity%2Fx;d;r": ".legend .curve",
    "console": ".entry",
    "params": ".params li",
    "reconfigure": "#view",
    "nodes": "tbody tr",
    "images/%2Ffront%2Fimage_raw": "canvas",
    "tf/base_link>camera": ".pair dl",
    "bags/run.bag": ".timeline .thumbnail",
    "diagnostics/%2FMotors%2Fright": "aside table",
    "fleet": "#view",
    "ros2": "#view",
    "services/%2Frobot%2Fget_loggers": "aside textarea",
    "actions": "#view",
    "publish": "#view",
    "teleop": ".stick",
    "panels/row(plot/%2Fimu%2Fangular_velocity%2Fx~column(topics~console))": ".entry",
}
NOTE_CLICKS = """() => {
  const listen = EventTarget.prototype.addEventListener;
  EventTarget.prototype.addEventListener = function (kind, ...rest) {
    if (kind === "click" && this instanceof Element) this.dataset.clicked = "";
    return listen.call(this, kind, ...rest);
  };
}"""
CONTROLS = "a[href], button, input, select, textarea, summary, [tabindex='0']"
# Elements that the mouse can use but the keyboard cannot: those with a listener that neither can have the
# focus # nor contain an element that can. Log entries are selected with the arrow keys, and the plot has
# keys.
MOUSE_ONLY = f"""() => [...document.querySelectorAll("[data-clicked]")].filter((element) =>
  element.checkVisibility() && !element.matches(".entry, .u-wrap, body") && !element.matches("{CONTROLS}")
  && !element.querySelector("{CONTROLS}") && element.childElementCount > 0)
  .map((element) => element.outerHTML.slice(0, 150))"""
# Controls by what a user would call them: elements may be replaced by equal ones in the meantime.
NAME = """(element) => {
  const own = (name) => element.getAttribute(name) ?? "";
  const text = element.matches("button, a.number, summary") ? own("title") || element.textContent : "";
  const keys = [element.tagName, own("aria-label"), own("type"), own("data-name"), own("data-key")];
  return [...keys, own("href"), text.replace(/[0-9.]+/g, "")].join("|");
}"""
WANTED = f"""() => [...document.querySelectorAll("{CONTROLS}")].filter((element) =>
  element.checkVisibility({{ visibilityProperty: true }}) && !element.disabled && element.tabIndex >= 0
  && !element.matches("[role=tab], aside")).map({NAME})"""
FOCUSED = f"() => document.activeElement === document.body ? '' : ({NAME})(document.activeElement)"
IN_TEXT = "p a, li a, dd a, td a, .key, .canvas *, .history *"
SMALL = f"""() => [...document.querySelectorAll("{CONTROLS}")].filter((element) => {{
  if (!element.checkVisibility() || element.matches("{IN_TEXT}")) return false;
  const target = element.type === "checkbox" ? element.closest("label") ?? element : element;
  const {{ width, height }} = target.getBoundingClientRect();
  return width < 39.5 || height < 39.5;
}}).map((element) => element.outerHTML.slice(0, 150))"""
# Tabs that are narrower than their titles, and therefore overlap.
SQUEEZED = """() => [...document.querySelectorAll("[role=tab]")]
  .filter((tab) => tab.scrollWidth > tab.clientWidth).map((tab) => tab.textContent)"""
MOST_STEPS = 250


@pytest.fixture
def page(ros: RosSystem, tmp_path: Path) -> Page:
    """The page of a system with `/robot`, started with `--control`."""
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, ROBOT, "robot")
    ros.wait_for_publisher("/imu")
    make_bag(tmp_path / "run.bag")
    return Page(ros, "--control", "--bags", tmp_path)


def unreached(tab: Tab) -> list[str]:
    """Press Tab until all controls had the focus, and return those that did not get it."""
    tab.evaluate(OPEN_DETAILS)
    tab.wait_for_function(f"() => ({WANTED})().length")
    wanted: set[str] = set(tab.evaluate(WANTED))
    tab.get_by_role("tab", selected=True).focus()
    missing = set(wanted)
    for _ in range(MOST_STEPS):
        tab.keyboard.press("Tab")
        missing.discard(tab.evaluate(FOCUSED))
        if not missing:
            break
    still: Any = tab.evaluate(WANTED)
    return sorted(missing.intersection(still))  # the system changes while the test presses the key


def test_the_keyboard_reaches_every_action(page: Page, open_tab: OpenTab) -> None:
    found = {}
    for place, element in TABS.items():
        tab = open_tab(page, place, size=(1400, 900))
        expect(tab.locator(element).first).to_be_visible()
        tab.add_init_script(f"({NOTE_CLICKS})()")
        tab.reload()
        expect(tab.locator(element).first).to_be_visible()
        problems = tab.evaluate(MOUSE_ONLY) + unreached(tab)
        if problems:
            found[place] = problems
        tab.context.close()
    assert found == {}, "\n".join(f"{place}: {each}" for place, names in found.items() for each in names)


def test_targets_on_a_phone_are_large_enough_for_thumbs(page: Page, open_tab: OpenTab) -> None:
    found = {}
    for place, element in TABS.items():
        tab = open_tab(page, place, size=(390, 800))
        expect(tab.locator(element).first).to_be_attached()
        tab.evaluate(OPEN_DETAILS)
        keep_screenshots(tab, f"phone-{place.partition('/')[0]}")
        small = tab.evaluate(SMALL) + tab.evaluate(SQUEEZED)
        if small:
            found[place] = small
        if tab.evaluate("document.documentElement.scrollWidth") > 390:
            found[f"{place}: width"] = [str(tab.evaluate("document.documentElement.scrollWidth"))]
        tab.context.close()
    assert found == {}, "\n".join(f"{place}: {each}" for place, names in found.items() for each in names)
