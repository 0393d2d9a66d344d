"""Every tab and every page of a node is usable with a screen reader, as far as axe-core can determine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab
from tests.browser.every_tab import page_with_every_tab, visited
from tests.browser.test_silent_server import NODES
from tests.support.npm import INSTALL, MODULES
from tests.support.page import Page
from tests.support.ros import RosSystem

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
