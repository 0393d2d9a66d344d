"""Every tab is usable with a screen reader, as far as axe-core can determine."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import OpenTab
from tests.browser.test_bags_tab import make_bag
from tests.support.npm import INSTALL, MODULES
from tests.support.page import Page
from tests.support.ros import RosSystem

ROBOT = Path(__file__).parent / "programs" / "robot_program.py"
AXE = MODULES / "axe-core" / "axe.min.js"
RULES = """async () => {
  const { passes, violations } = await axe.run();
  const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  const places = (nodes) => nodes.slice(0, 3).map(({ html }) => html.slice(0, 160)).join(" | ");
  return [passes.length, serious.map(({ id, nodes }) => `${id}: ${places(nodes)}`)];
}"""
OPEN_DETAILS = "document.querySelectorAll('.recorder details').forEach((each) => { each.open = true; })"
TABS = {
    "graph/node:%2Frobot": "aside h3",
    "graph/events:": "aside h2",
    "topics/%2Fimu": "aside .message li",
    "plot/%2Fimu%2Fangular_velocity%2Fx;d;r": ".legend",
    "console": ".entry",
    "params": ".params",
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
    "teleop": ".stick",
    "publish": "#view",
    "panels/row(plot/%2Fimu%2Fangular_velocity%2Fx~column(images/%2Ffront%2Fimage_raw~console))": ".entry",
}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious_in_any_tab(
    ros: RosSystem, open_tab: OpenTab, tmp_path: Path, scheme: Literal["light", "dark"]
) -> None:
    if not AXE.exists():
        pytest.skip(f"axe-core is not on this machine: {INSTALL}")
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, ROBOT, "robot")
    ros.wait_for_publisher("/imu")
    make_bag(tmp_path / "run.bag")
    page = Page(ros, "--control", "--bags", tmp_path)
    found = {}
    for place, element in TABS.items():
        tab = open_tab(page, place)
        tab.emulate_media(color_scheme=scheme)
        expect(tab.locator(element).first).to_be_visible()
        tab.evaluate(OPEN_DETAILS)
        tab.evaluate(AXE.read_text(encoding="utf-8"))
        passed, serious = tab.evaluate(RULES)
        assert passed > 10, place
        if serious:
            found[place] = serious
        tab.context.close()
    assert found == {}
