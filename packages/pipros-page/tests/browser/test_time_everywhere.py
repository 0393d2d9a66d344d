"""The timeline along the bottom of all tabs: of a bag, with marks and notes, and of the last minute."""

import math
import re
import struct
import sys
from pathlib import Path

import pytest
import yaml
from playwright.sync_api import Locator, expect
from playwright.sync_api import Page as Tab

from pipros.msg import load_message_class
from pipros_tools.bag import BagWriter
from tests.browser.chromium import OpenTab, keep_screenshots
from tests.browser.test_bags_tab import BEGIN, connect, show_tab
from tests.browser.test_reach import AXE, RULES
from tests.support.npm import INSTALL
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SECONDS = 20
ERROR_AT, FAULT_AT = 12, 16
SOURCE = """
import itertools, rospy
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage
rospy.init_node("source")
numbers = rospy.Publisher("/number", Float64, queue_size=10)
unseen = rospy.Publisher("/unseen", Float64, queue_size=10)
frames = rospy.Publisher("/tf", TFMessage, queue_size=10)
for count in itertools.count():
    if rospy.is_shutdown():
        break
    numbers.publish(count / 10)
    unseen.publish(1.0)
    link = TransformStamped()
    link.header.stamp, link.header.frame_id, link.child_frame_id = rospy.Time.now(), "map", "base"
    link.transform.translation.x, link.transform.rotation.w = count / 10, 1.0
    frames.publish([link])
    if count % 10 == 0:
        rospy.loginfo("number %d", count // 10)
    rospy.sleep(0.1)
"""


def make_bag(path: Path) -> None:
    """Write 20 s of numbers at 10 Hz, an error in the log, and a diagnosed fault."""
    log, array = map(load_message_class, ("rosgraph_msgs/Log", "diagnostic_msgs/DiagnosticArray"))
    status = load_message_class("diagnostic_msgs/DiagnosticStatus")
    with path.open("wb") as file:
        bag = BagWriter(file)
        numbers = connect(bag, "/number", "std_msgs/Float64")
        logs, diagnostics = connect(bag, "/rosout", log._type), connect(bag, "/diagnostics", array._type)
        for tick in range(SECONDS * 10 + 1):
            stamp = BEGIN + tick // 10, tick % 10 * 100_000_000
            bag.write(numbers, *stamp, struct.pack("<d", tick / 10))
            if tick % 10 == 0:
                level = 8 if stamp[0] == BEGIN + ERROR_AT else 2
                bag.write_message(logs, *stamp, log(level=level, name="/robot", msg=f"second {tick // 10}"))
                fault = status(
                    level=2 if stamp[0] >= BEGIN + FAULT_AT else 0, name="motor", message="too hot"
                )
                bag.write_message(diagnostics, *stamp, array(status=[fault]))
        bag.finish()


def bar_of(tab: Tab) -> Locator:
    return tab.locator("#time")


def slide_to(tab: Tab, seconds: float) -> None:
    """Drag the thumb of the timeline to this time since the beginning."""
    tab.get_by_role("slider", name="Timeline").fill(str(seconds))


def shown_number(element: Locator) -> float:
    """Return the number of a message or a curve; NaN before there is one."""
    found = re.findall(r"data: ([\d.]+)", element.inner_text())
    return float(found[0]) if found else math.nan


def entries_of(tab: Tab, number: int) -> Locator:
    """Return the entries of a number. The text of a row ends where the time of the next one begins."""
    return tab.locator(".rows .entry .text", has_text=re.compile(rf"^number {number}$"))


def check_accessibility(tab: Tab) -> None:
    if not AXE.exists():
        pytest.skip(f"axe-core is not on this machine: {INSTALL}")
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    for scheme in ("light", "dark"):
        tab.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        passed, serious = tab.evaluate(RULES, None)
        assert passed > 10
        assert serious == []


def test_a_bag_is_scrubbed_in_all_tabs_with_marks_and_a_note(ros: RosSystem, open_tab, tmp_path) -> None:
    ros.serve_master()
    make_bag(tmp_path / "run.bag")
    tab = open_tab(Page(ros, "--bags", tmp_path), "bags/run.bag")
    bar = bar_of(tab)
    expect(bar.get_by_role("button", name="2 marks")).to_be_visible()
    tab.evaluate("location.hash = 'topics//number'")
    slide_to(tab, 7.5)
    expect(tab.locator("aside")).to_contain_text("data: 7.5")
    show_tab(tab, "Console")
    expect(tab.locator(".rows")).to_contain_text("second 7")
    bar.get_by_role("button", name="Next mark").click()
    expect(bar).to_contain_text("0:12.0 run.bag")
    expect(bar.locator(".here")).to_have_text("▼ /robot: second 12")
    expect(tab.locator(".rows .level-8")).to_contain_text("second 12")
    bar.get_by_role("button", name="Next mark").press("Enter")
    expect(bar.locator(".here")).to_have_text("◆ motor: too hot")
    expect(bar.get_by_role("button", name="Next mark")).to_be_disabled()
    slide_to(tab, 3)
    bar.get_by_role("button", name="Note", exact=True).click()
    tab.get_by_label("Text of the note").fill("here it slips")
    tab.get_by_label("Text of the note").press("Enter")
    expect(bar.get_by_role("button", name="3 marks")).to_be_visible()
    expect(bar.locator(".here")).to_have_text("✎ here it slips")
    notes = yaml.safe_load((tmp_path / "run.bag.notes.yaml").read_text())
    assert notes == {"notes": [{"time": BEGIN + 3, "text": "here it slips"}]}
    keep_screenshots(tab, "timeline")
    bar.get_by_role("button", name="3 marks").click()
    keep_screenshots(tab, "timeline-marks")
    check_accessibility(tab)
    tab.locator(".mark-list").get_by_role("button", name="Error in the log").click()
    expect(bar).to_contain_text("0:12.0 run.bag")
    tab.get_by_role("button", name="Delete the note here it slips").click()
    expect(bar.get_by_role("button", name="2 marks")).to_be_visible()
    bar.get_by_role("button", name="Live").click()
    expect(bar).to_be_hidden()
    show_tab(tab, "Bags")
    expect(tab.locator(".tab-bags .choice")).to_contain_text("run.bag")
    assert tab.evaluate("location.hash") == "#bags"
    expect(bar).to_be_hidden()


def test_a_malformed_file_of_notes_is_named_and_kept(ros: RosSystem, open_tab: OpenTab, tmp_path) -> None:
    ros.serve_master()
    make_bag(tmp_path / "run.bag")
    (tmp_path / "run.bag.notes.yaml").write_text("my own notes")
    tab = open_tab(Page(ros, "--bags", tmp_path), "bags/run.bag")
    expect(bar_of(tab).locator("> .error-text")).to_contain_text("run.bag.notes.yaml is not a file of notes")
    bar_of(tab).get_by_role("button", name="Note", exact=True).click()
    tab.get_by_label("Text of the note").fill("here")
    tab.get_by_label("Text of the note").press("Enter")
    expect(tab.locator(".note-form")).to_contain_text("Correct or move it")
    assert (tmp_path / "run.bag.notes.yaml").read_text() == "my own notes"


def test_acting_on_the_robot_while_looking_at_a_bag_asks_first(ros: RosSystem, open_tab, tmp_path) -> None:
    ros.serve_master()
    make_bag(tmp_path / "run.bag")
    tab = open_tab(Page(ros, "--bags", tmp_path, "--control"), "bags/run.bag")
    expect(bar_of(tab)).to_be_visible()
    tab.evaluate("location.hash = 'publish'")
    tab.get_by_label("Topic", exact=True).fill("/chatter")
    tab.get_by_label("Type", exact=True).fill("std_msgs/String")
    dialog = tab.get_by_role("dialog")
    start = tab.locator(".tab-publish").get_by_role("button", name="Publish", exact=True)
    start.click()
    expect(dialog).to_contain_text("They show the bag run.bag. Really publish messages now?")
    expect(dialog.get_by_role("button", name="Cancel")).to_be_focused()
    keep_screenshots(tab, "timeline-ask")
    check_accessibility(tab)
    tab.keyboard.press("Escape")
    expect(tab.locator(".tab-publish")).to_contain_text("not done, because the tabs show the bag run.bag")
    start.click()
    dialog.get_by_role("button", name="Act on the robot").click()
    expect(tab.locator("#publishers")).to_have_text("publishing 1")
    expect(dialog).to_be_hidden()


def test_the_last_minute_is_rewound_in_all_tabs(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", SOURCE)
    ros.wait_for_publisher("/number")
    tab = open_tab(Page(ros), "plot//number/data")
    legend = tab.locator(".legend")
    expect(legend).to_contain_text(re.compile(r"data: (1[4-9]|[2-9]\d)"))
    bar, rewind = bar_of(tab), tab.get_by_role("button", name="Rewind")
    expect(rewind).to_have_attribute("title", re.compile(r"at the last (1[6-9]|[2-9]\d) s \(r\)$"))
    live = shown_number(legend)
    rewind.click()
    expect(bar).to_contain_text("0:00.0 ago")
    expect(rewind).to_be_hidden()

    slider = tab.get_by_role("slider", name="Timeline")
    slider.press("PageUp")
    expect(bar).to_contain_text("0:10.0 ago")
    wait_until(lambda: shown_number(legend) < live - 5, 30, "the value of that moment")
    keep_screenshots(tab, "rewind-plot")
    tab.evaluate("location.hash = 'topics//number'")
    expect(tab.locator(".tab-topics aside")).to_contain_text("data:")
    held = shown_number(tab.locator(".tab-topics aside"))
    show_tab(tab, "Console")
    expect(entries_of(tab, int(held) - 1)).to_have_count(1)
    expect(entries_of(tab, int(held) + 5)).to_have_count(0)
    keep_screenshots(tab, "rewind-console")
    tab.evaluate("location.hash = 'tf/map>base'")
    pose = tab.locator(".pair dl")
    expect(pose).to_contain_text(re.compile(rf"{held:g}|{held - 0.1:g}"))  # it is published after the number
    tab.evaluate("location.hash = 'scene'")
    expect(tab.locator(".scene-canvas")).to_be_visible()
    keep_screenshots(tab, "rewind-scene")
    tab.evaluate("location.hash = 'plot//unseen/data'")
    expect(tab.locator(".legend")).to_contain_text(
        "/unseen/data was not recorded: no view showed it in the recorded time"
    )
    check_accessibility(tab)
    bar.get_by_role("button", name="Live").click()
    expect(bar).to_be_hidden()
    tab.evaluate("location.hash = 'topics//number'")
    wait_until(lambda: shown_number(tab.locator(".tab-topics aside")) > held + 10, 30, "the present value")
    show_tab(tab, "Console")
    entries = tab.locator(".rows")
    wait_until(lambda: int(entries.inner_text().split()[-1]) > held + 10, 30, "the present entries")
    tab.locator(".entry").nth(-2).click()
    tab.get_by_role("button", name="all views", exact=True).click()
    expect(bar).to_contain_text(re.compile(r"0:(0[1-9]|[1-5]\d)\.\d ago"))
    tab.keyboard.press("r")
    expect(bar).to_be_hidden()


def test_a_phone_has_the_timeline_below_and_a_page_without_rewinding_has_no_button(
    ros: RosSystem, open_tab: OpenTab, tmp_path: Path
) -> None:
    ros.serve_master()
    make_bag(tmp_path / "run.bag")
    tab = open_tab(Page(ros, "--bags", tmp_path, "--rewind", "0"), "bags/run.bag", (390, 844))
    expect(bar_of(tab).get_by_role("button", name="2 marks")).to_be_visible()
    tab.evaluate("location.hash = 'topics//number'")
    slide_to(tab, 7.5)
    expect(tab.locator("aside")).to_contain_text("data: 7.5")
    keep_screenshots(tab, "timeline-phone")
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    box = bar_of(tab).bounding_box()
    assert box is not None
    assert box["y"] + box["height"] <= 844
    assert box["height"] < 130
    bar_of(tab).get_by_role("button", name="Live").click()
    expect(bar_of(tab)).to_be_hidden()
    expect(tab.get_by_role("button", name="Rewind")).to_be_hidden()
