"""Every action can be reached with the keyboard alone, and with a thumb on a phone."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.browser.every_tab import page_with_every_tab, visited
from tests.browser.test_why_no_data import NODES
from tests.support.npm import INSTALL, MODULES
from tests.support.page import Page
from tests.support.ros import RosSystem

NOTE_CLICKS = """() => {
  const listen = EventTarget.prototype.addEventListener;
  EventTarget.prototype.addEventListener = function (kind, ...rest) {
    if (kind === "click" && this instanceof Element) this.dataset.clicked = "";
    return listen.call(this, kind, ...rest);
  };
}"""
CONTROLS = "a[href], button, input, select, textarea, summary, [tabindex='0']"
# Elements that the mouse can use but the keyboard cannot: those with a listener that neither can have the
# focus # nor contain an element that can. Log entries and rows of tables are selected with the arrow keys,
# and the plot has keys.
MOUSE_ONLY = f"""() => [...document.querySelectorAll("[data-clicked]")].filter((element) =>
  element.checkVisibility() && !element.matches(".entry, .u-wrap, body, [role=grid] tr")
  && !element.matches("{CONTROLS}") && !element.querySelector("{CONTROLS}") && element.childElementCount > 0)
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
IN_TEXT = "p a, li a, dd a, td a, .key, .canvas *, .history *"
SMALL = f"""() => [...document.querySelectorAll("{CONTROLS}")].filter((element) => {{
  if (!element.checkVisibility() || element.matches("{IN_TEXT}")) return false;
  const target = element.type === "checkbox" ? element.closest("label") ?? element : element;
  const {{ width, height }} = target.getBoundingClientRect();
  return width < 39.5 || height < 39.5;
}}).map((element) => element.outerHTML.slice(0, 150))"""
# Controls that lie over a drawing, drawings without room, and a head that cuts the name of the view.
OVER = """() => [...document.querySelectorAll(".stage, #tabs")].filter((each) => {
  if (each.id === "tabs") return each.scrollWidth > each.clientWidth;
  const place = (part) => each.querySelector(part).getBoundingClientRect();
  const { top, bottom } = place(".canvas");
  return each.checkVisibility() && place(".corner").top < Math.max(bottom, top + 80);
}).map((each) => each.textContent.slice(0, 150))"""
# Tabs that are narrower than their titles, and therefore overlap; and details that leave a part empty.
SQUEEZED = """() => [...document.querySelectorAll("[role=tab], aside")].filter((each) =>
  each.checkVisibility() && (each.matches("aside") ? each.offsetWidth < innerWidth
    : each.scrollWidth > each.clientWidth)).map((each) => each.textContent.slice(0, 150))"""
# Notes the names of elements in the page when they get the focus: one question for many keys.
NOTE_FOCUS = f"""() => {{
  const name = {NAME};
  window.focused = new Set();
  addEventListener("focusin", (event) => window.focused.add(name(event.target)));
}}"""
MAX_STEPS = 250
STEPS_AT_ONCE = 20


@pytest.fixture
def page(ros: RosSystem, tmp_path: Path) -> Page:
    return page_with_every_tab(ros, tmp_path)


def unreached(tab: Tab) -> list[str]:
    """Press Tab until all controls had the focus, and return those that did not get it."""
    tab.wait_for_function(f"() => ({WANTED})().length")
    wanted: set[str] = set(tab.evaluate(WANTED))
    tab.evaluate("() => window.focused.clear()")
    tab.get_by_role("tab", selected=True).focus()
    missing = wanted
    for _ in range(0, MAX_STEPS, STEPS_AT_ONCE):
        for _ in range(STEPS_AT_ONCE):
            tab.keyboard.press("Tab")
        missing = wanted.difference(tab.evaluate("() => [...window.focused]"))
        if not missing:
            break
    still: Any = tab.evaluate(WANTED)
    return sorted(missing.intersection(still))  # the system changes while the test presses the key


def test_the_keyboard_reaches_every_action(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph", size=(1400, 900))
    tab.add_init_script(f"({NOTE_CLICKS})()")
    tab.reload()
    tab.evaluate(NOTE_FOCUS)
    found = {}
    for place in visited(tab):
        problems = tab.evaluate(MOUSE_ONLY) + unreached(tab)
        if problems:
            found[place] = problems
    assert found == {}, "\n".join(f"{place}: {each}" for place, names in found.items() for each in names)


@pytest.mark.parametrize("size", [(390, 800), (360, 256)])  # the latter is a window at 400 %
def test_targets_on_a_phone_are_large_enough_for_thumbs(
    page: Page, open_tab: OpenTab, size: tuple[int, int]
) -> None:
    tab = open_tab(page, "graph", size=size)
    found = {}
    for place in visited(tab):
        keep_screenshots(tab, f"phone-{place.partition('/')[0]}")
        small = [*tab.evaluate(SMALL), *tab.evaluate(SQUEEZED), *tab.evaluate(OVER)]
        if small:
            found[place] = small
        if tab.evaluate("document.documentElement.scrollWidth") > size[0]:
            found[f"{place}: width"] = [str(tab.evaluate("document.documentElement.scrollWidth"))]
    assert found == {}, "\n".join(f"{place}: {each}" for place, names in found.items() for each in names)


# Every tab and every page of a node is usable with a screen reader, as far as axe-core can determine.


AXE = MODULES / "axe-core" / "axe.min.js"
# Hidden views are checked when they are shown.
# The scheme changes only colours.
RULES = """async (rules) => {
  const context = { include: [["html"]], exclude: [["#view > .tab[hidden]"]] };
  const { passes, violations } = await axe.run(context, rules ? { runOnly: rules } : {});
  const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  const places = (nodes) => nodes.slice(0, 3).map(({ html }) => html.slice(0, 160)).join(" | ");
  return [passes.length, serious.map(({ id, nodes }) => `${id}: ${places(nodes)}`)];
}"""


def load_axe(tab: Tab) -> None:
    if not AXE.exists():
        pytest.skip(f"axe-core is not on this machine: {INSTALL}")
    tab.evaluate(AXE.read_text(encoding="utf-8"))


def violations(tab: Tab, place: str) -> list[str]:
    """Return what is serious, with all rules in light colours, and with the rule of contrast in dark ones."""
    tab.emulate_media(color_scheme="light")
    passed, serious = tab.evaluate(RULES, None)
    assert passed > 10, place
    tab.emulate_media(color_scheme="dark")
    coloured, dark = tab.evaluate(RULES, ["color-contrast"])
    assert coloured == 1 or dark, place
    return [*serious, *dark]


def test_axe_finds_nothing_serious_in_any_tab(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = open_tab(page_with_every_tab(ros, tmp_path), "graph")
    load_axe(tab)
    found = {place: violations(tab, place) for place in visited(tab)}
    assert {place: serious for place, serious in found.items() if serious} == {}


@pytest.mark.parametrize(("command", "content"), NODES.values(), ids=NODES)
def test_axe_finds_nothing_serious_in_pages_of_nodes(
    ros: RosSystem, open_tab: OpenTab, command: Sequence[str], content: str
) -> None:
    ros.serve_master()
    page = Page.of(ros.pipros.start(*command))
    tab = open_tab(page, "")
    expect(tab.locator(content)).to_be_visible()
    expect(tab.locator("#node")).not_to_be_empty()
    load_axe(tab)
    assert violations(tab, content) == []
    other = open_tab(page, "")
    other.goto("about:blank")
    other.goto(f"http://{page.host}/#token=wrong")
    expect(other.locator("#locked")).to_be_visible()
    load_axe(other)
    assert violations(other, "without its token") == []
