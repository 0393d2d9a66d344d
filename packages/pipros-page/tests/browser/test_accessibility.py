"""Every tab is usable with a screen reader, as far as axe-core can determine."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.chromium import OpenTab
from tests.browser.every_tab import page_with_every_tab, visited
from tests.support.npm import INSTALL, MODULES
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


def test_axe_finds_nothing_serious_in_any_tab(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    if not AXE.exists():
        pytest.skip(f"axe-core is not on this machine: {INSTALL}")
    tab = open_tab(page_with_every_tab(ros, tmp_path), "graph")
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    found = {}
    for place in visited(tab):
        tab.emulate_media(color_scheme="light")
        passed, serious = tab.evaluate(RULES, None)
        assert passed > 10, place
        tab.emulate_media(color_scheme="dark")
        coloured, dark = tab.evaluate(RULES, ["color-contrast"])
        assert coloured == 1 or dark, place
        if serious or dark:
            found[place] = serious + dark
    assert found == {}
