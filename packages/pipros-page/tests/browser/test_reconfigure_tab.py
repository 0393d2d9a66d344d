"""Parameters that change while a node runs, on the page: servers of pipros and genuine ROS."""

import json
import sys
from pathlib import Path

import pytest
from playwright.sync_api import expect

from pipros_libraries.reconfigure.cfg_file import module_contents, read
from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.genuine import missing_packages
from tests.support.page import Page
from tests.support.processes import Process
from tests.support.ros import RosSystem

PROGRAM = Path(__file__).parent / "programs" / "tuned_program.py"
SIDES = ["pipros"] if missing_packages() else ["pipros", "genuine"]
CFG = """
PACKAGE = "tuning"
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
sizes = [gen.const("Small", int_t, 0, "A small one"), gen.const("Large", int_t, 2, "A large one")]
gen.add("size", int_t, 1, "How large the robot is", 0, 0, 2, edit_method=gen.enum(sizes, "Sizes"))
gen.add("gain", double_t, 2, "Of the controller, 1/s", 1.5, -10, 10)
gen.add("free", double_t, 4, "Without bounds", 1.0)
gen.add("name", str_t, 8, "What the robot is called", "robot")
gen.add("on", bool_t, 16, "Whether it drives", True)
inner = gen.add_group("Wheels", type="collapse", state=True)
inner.add("count", int_t, 32, "How many", 4, 0, 9)
together = inner.add_group("Limits", type="apply")
together.add("speed", double_t, 64, "The largest, m/s", 0.5, 0, 3)
exit(gen.generate(PACKAGE, "tuning", "Tuning"))
"""

# the elements of settings that are wider than their place on a phone
CUT_OFF = """() => {
  const isCut = (each) => each.matches(".about, .label") && each.scrollWidth > each.clientWidth + 1;
  const isOutside = (each) => each.getBoundingClientRect().right > 390;
  return [...document.querySelectorAll(".setting *")].filter((each) => isCut(each) || isOutside(each))
    .map((each) => each.outerHTML);
}"""


@pytest.fixture
def module(tmp_path: Path) -> Path:
    """Return the contents of the configuration's module as JSON."""
    cfg = tmp_path / "Tuning.cfg"
    cfg.write_text(CFG)
    file = tmp_path / "module.json"
    file.write_text(json.dumps(module_contents(read(cfg))))
    return file


def start(ros: RosSystem, side: str, module: Path) -> Process:
    python = sys.executable if side == "pipros" else "/usr/bin/python3"
    process: Process = getattr(ros, side).start(python, PROGRAM, side, module)
    process.wait_for("'gain': 1.5")
    return process


@pytest.mark.parametrize("side", SIDES)
def test_each_kind_of_parameter_is_changed_on_the_page(ros, open_tab, module: Path, side: str) -> None:
    ros.serve_master()
    server = start(ros, side, module)
    tab = open_tab(Page(ros, "--control", command="rqt_reconfigure"), f"reconfigure/%2F{side}")
    gain = tab.get_by_label("gain", exact=True)
    expect(gain).to_have_value("1.5")
    tab.set_viewport_size({"width": 390, "height": 844})
    expect(gain).to_be_visible()
    tab.set_viewport_size({"width": 800, "height": 700})
    gain.fill("-99")
    gain.press("Enter")
    expect(gain).to_have_value("-10")  # the server clips the value to its bounds
    slider = tab.get_by_label("gain, slider")
    slider.fill("4")
    server.wait_for("'gain': 4.0")
    slider.press("ArrowRight")
    expect(gain).not_to_have_value("4")
    tab.get_by_label("size", exact=True).select_option("Large (2)")
    server.wait_for("'size': 2")
    odd = ("rosrun", "dynamic_reconfigure", "dynparam", "set", f"/{side}", "size", "1")
    ros.pipros.run(*odd)
    size = tab.get_by_label("size", exact=True)
    expect(size.locator("option:checked")).to_have_text("1 (not in the list)")
    tab.get_by_label("on", exact=True).click()  # an earlier update may show the old value for a moment
    server.wait_for("'on': False")
    name = tab.get_by_label("name", exact=True)
    name.fill('<b>"r2"</b>')
    name.press("Tab")
    server.wait_for("""'name': '<b>"r2"</b>'""")
    tab.get_by_label("count, slider").press("End")
    server.wait_for("'count': 9")
    speed = tab.get_by_label("speed", exact=True)
    speed.fill("2.5")
    speed.press("Tab")
    tab.get_by_role("button", name="Apply").click()
    server.wait_for("'speed': 2.5")
    tab.get_by_role("button", name="Reset count to 4").click()
    server.wait_for("'count': 4")
    state = tab.get_by_label("State of Wheels")
    expect(state).to_be_checked()
    free = tab.get_by_label("free", exact=True)
    free.fill("much")
    free.press("Enter")
    expect(tab.get_by_role("alert").first).to_contain_text("can't set parameter 'free'")
    expect(free).to_have_value("1")
    tab.set_viewport_size({"width": 390, "height": 844})
    assert tab.evaluate(CUT_OFF) == []


def test_without_control_parameters_are_read_only(ros: RosSystem, open_tab: OpenTab, module: Path) -> None:
    ros.serve_master()
    for side in SIDES:
        start(ros, side, module)
    tab = open_tab(Page(ros), "reconfigure")
    expect(tab.locator(".servers")).to_contain_text("".join(f"/{side}" for side in sorted(SIDES)))
    tab.get_by_role("button", name="/pipros").click()
    gain = tab.get_by_label("gain", exact=True)
    expect(gain).to_have_value("1.5")
    assert tab.locator(".settings :is(input, select):not(:disabled)").count() == 0
    client = "import rospy; from dynamic_reconfigure.client import Client; rospy.init_node('c')"
    ros.pipros.run(sys.executable, "-c", f"{client}; Client('/pipros').update_configuration({{'gain': 7}})")
    expect(gain).to_have_value("7")
    keep_screenshots(tab, "reconfigure")


def test_the_end_of_a_server_is_reported(ros: RosSystem, open_tab: OpenTab, module: Path) -> None:
    ros.serve_master()
    server = start(ros, "pipros", module)
    tab = open_tab(Page(ros), "reconfigure/%2Fpipros")
    expect(tab.get_by_label("gain", exact=True)).to_have_value("1.5")
    server.press_ctrl_c()
    server.wait()
    expect(tab.get_by_role("alert").first).to_have_text("/pipros is no longer offered.")
