"""Interactions with the tabs: curves, logs, images, frames and diagnostics."""

import re
import sys
from pathlib import Path

from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots, show_all_controls
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAMS = Path(__file__).parent / "programs"


def numbers_in(tab: Tab, selector: str) -> list[float]:
    return [float(text) for text in re.findall(r": (-?[\d.]+)", tab.locator(selector).inner_text())]


def test_curves_pause_zoom_follow_and_are_saved(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "plot/%2Fimu%2Fangular_velocity%2Fx%3Ay")
    legend = tab.locator(".legend")
    expect(legend).to_contain_text(
        re.compile(r"/imu/angular_velocity/x: -?\d.*/imu/angular_velocity/y: -?\d")
    )

    samples: list[str | bytes] = []
    tab.on("websocket", lambda socket: socket.on("framereceived", lambda text: samples.append(text)))
    tab.reload()

    def wait_for_samples() -> str:
        """Wait until the browser has received more samples, and return what it shows."""
        most = len(samples) + 5
        wait_until(lambda: bool(legend.inner_text()) and len(samples) > most, 30, "further samples")
        return legend.inner_text()

    def go_on() -> None:
        before = legend.inner_text()
        wait_until(lambda: legend.inner_text() != before, 30, "values that go on")

    go_on()
    tab.get_by_role("button", name="Pause").click()
    assert wait_for_samples() == wait_for_samples()
    tab.get_by_role("button", name="Resume").click()
    go_on()

    chart = tab.locator(".u-over").bounding_box()
    assert chart is not None
    right, middle = chart["x"] + chart["width"], chart["y"] + chart["height"] / 2
    tab.mouse.move(right - 3, middle)
    expect(tab.locator(".legend .at")).to_have_text(re.compile(r"at \d\d:\d\d:\d\d"))
    ticks = tab.locator(".chart canvas").first

    tab.get_by_label("Time span").select_option("10 s")
    tab.mouse.move(right - 60, middle)
    tab.mouse.down()
    tab.mouse.move(right - 20, middle, steps=4)
    expect(tab.locator(".u-select")).not_to_have_css("width", "0px")
    tab.mouse.up()
    tab.get_by_label("Lowest value").fill("-2")
    tab.get_by_label("Lowest value").press("Tab")
    tab.get_by_label("Highest value").fill("2")
    tab.get_by_label("Highest value").press("Tab")
    expect(ticks).to_be_visible()
    with tab.expect_download() as download:
        show_all_controls(tab)
        tab.get_by_role("button", name="CSV").click()
    lines = Path(download.value.path()).read_text().splitlines()
    assert lines[0] == "time,field,value"
    assert {line.split(",")[1] for line in lines[1:]} == {
        "/imu/angular_velocity/x",
        "/imu/angular_velocity/y",
    }
    assert all(-1.0 <= float(line.split(",")[2]) <= 1.0 for line in lines[1:])
    tab.get_by_role("button", name="Remove /imu/angular_velocity/x").click()
    expect(legend).not_to_contain_text("angular_velocity/x")
    assert "angular_velocity/y" in tab.url


FRAMES = """async () => {
  const log = document.querySelector(".log");
  const times = [];
  let last = await new Promise(requestAnimationFrame);
  for (let i = 0; i < 60; i += 1) {
    log.scrollTop = ((i * 7919) % 60) / 60 * log.scrollHeight;
    const now = await new Promise(requestAnimationFrame);
    times.push(now - last);
    last = now;
  }
  return times.sort((a, b) => a - b);
}"""


def test_the_console_holds_100_000_entries_and_stays_fluid(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros), "console")
    tab.wait_for_selector(".log", state="attached")  # hidden while there are no entries
    ros.pipros.start(sys.executable, PROGRAMS / "log_program.py")
    count = tab.locator(".bar .count")
    expect(count).to_have_text(re.compile(r"^1\d{5} of 1\d{5}"), timeout=200_000)
    frames = tab.evaluate(FRAMES)
    print(f"frames while scrolling: median {frames[30]:.0f} ms, longest {frames[-1]:.0f} ms")
    assert tab.locator(".entry").count() < 100  # the document contains only visible rows
    assert frames[30] < 1000
    tab.get_by_label("Fatal").uncheck()
    tab.get_by_label("Info").uncheck()
    expect(count).to_have_text(re.compile(r"^[67]\d{4} of 1\d{5}"))
    tab.get_by_label("Filter by text").fill("/78$/")  # a hundredth of all: old entries are dropped
    expect(count).to_have_text(re.compile(r"^\d{1,4} of 1\d{5}"))
    expect(tab.locator(".entry").last).to_contain_text(re.compile(r"entry \d*78$"))
    tab.locator(".log").press("ArrowUp")
    expect(tab.locator("aside")).to_contain_text("busy.py:")
    tab.locator(".log").press("Escape")
    expect(tab.locator("aside")).to_be_hidden()


COLOURS = "[[255,0,0],[0,255,0],[0,0,255],[255,255,255]]"
GREYS = "[[0,0,0],[85,85,85],[170,170,170],[255,255,255]]"
CORNERS = """([expected, size]) => {
  const canvas = document.querySelector("canvas");
  if (canvas.width !== size) return false;
  const context = canvas.getContext("2d");
  const corners = [[0, 0], [size - 1, 0], [0, size - 1], [size - 1, size - 1]];
  return corners.every(([x, y], i) => [...context.getImageData(x, y, 1, 1).data].slice(0, 3)
    .every((value, part) => Math.abs(value - JSON.parse(expected)[i][part]) <= 4));
}"""


def wait_for_corners(tab: Tab, expected: str, topic: str) -> None:
    wait_until(lambda: tab.evaluate(CORNERS, [expected, 4]), 30, f"the colours of {topic}")


def test_images_have_their_colours_in_each_encoding(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAMS / "image_program.py")
    ros.wait_for_publisher("/image/compressed")
    tab = open_tab(Page(ros), "images/%2Fimage%2Frgb8")
    choice = tab.get_by_label("Topic")
    expect(choice.locator("option")).to_have_count(21)
    for topic in choice.locator("option").all_inner_texts():
        choice.select_option(topic)
        expect(tab.locator(".bar")).to_contain_text(
            topic.removeprefix("/image/").removesuffix("_depth"), ignore_case=True
        )
        wait_for_corners(tab, GREYS if re.search("mono|c1|depth", topic) else COLOURS, topic)
    with tab.expect_download() as download:
        tab.get_by_role("button", name="Save PNG").click()
    assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")


def test_the_user_chooses_an_image_unless_there_is_only_one(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    pub = ("rostopic", "pub", "-r", "10")
    ros.pipros.start(*pub, "/a", "sensor_msgs/Image", "{encoding: unknown9, width: 1, height: 1}")
    ros.wait_for_publisher("/a")
    tab = open_tab(Page(ros), "images")
    expect(tab.locator(".error")).to_have_text("cannot show images with the encoding [unknown9]")
    expect(tab.locator(".note")).to_be_hidden()
    ros.pipros.start(
        *pub, "/b", "sensor_msgs/Image", "{encoding: mono8, width: 1, height: 1, step: 1, data: [7]}"
    )
    expect(tab.get_by_label("Topic").locator("option")).to_have_count(2)  # the server knows both
    tab.reload()
    expect(tab.locator(".note")).to_contain_text("Choose a topic: there are 2 image topics.")
    expect(tab.locator("canvas")).to_be_hidden()
    tab.get_by_role("button", name="/b", exact=True).click()
    expect(tab.locator(".bar")).to_contain_text("mono8")
    expect(tab.locator(".note")).to_be_hidden()


INKED = """() => {
  const canvas = document.querySelector(".topic-picture");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.some((value, at) => at % 4 === 3 && value > 0);
}"""


def test_scans_are_pictures_and_other_messages_curves_of_what_changes(robot, page, open_tab) -> None:
    scan = "{angle_increment: 0.1, range_max: 9, ranges: [1, 1.2, 1.4, 1.6, 1.8, 2, 2.2]}"
    robot.pipros.start("rostopic", "pub", "-r", "10", "/scan", "sensor_msgs/LaserScan", scan)
    robot.wait_for_publisher("/scan")
    tab = open_tab(page, "topics//scan")
    expect(tab.get_by_role("img", name="Picture of the newest message")).to_be_visible()
    assert tab.evaluate(INKED)
    curve = tab.get_by_label("Field of the curve")
    expect(curve).to_be_hidden()
    keep_screenshots(tab, "topic-scan")
    tab.evaluate("location.hash = 'topics//imu'")
    expect(curve).to_have_value(re.compile("angular_velocity"))
    expect(tab.locator(".topic-picture")).to_be_hidden()


def test_frames_without_updates_are_shown_as_old(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    robot = ros.pipros.start(sys.executable, PROGRAMS / "robot_program.py", "robot")
    ros.pipros.start("rosrun", "tf2_ros", "static_transform_publisher", *(*"001000", "base_link", "laser"))
    ros.wait_for_publisher("/tf_static")
    tab = open_tab(Page(ros), "tf")
    row = tab.locator("tr", has_text="wheel_left")
    expect(row).to_contain_text(re.compile(r"base_link/robot\d+\.\d+ Hz0\.\d s"))
    expect(tab.locator("tr", has_text="laser")).to_contain_text("static")
    expect(tab.locator("svg.canvas")).to_contain_text("laser")
    robot.kill()
    expect(row).to_contain_text(re.compile(r"stale([3-9]|\d\d+)\.\d s"))
    expect(tab.locator('[data-key="frame:wheel_left"].stale')).to_be_visible()
    expect(tab.locator(".corner")).to_contain_text(re.compile(r", \d stale"))


def test_a_pair_of_frames_has_its_transform_and_its_chain(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    place = (*"123", "1.5708", *"00")
    for parent, child in (("base", "arm"), ("arm", "hand"), ("moon", "crater")):
        numbers = place if child == "arm" else tuple("000000")
        ros.pipros.start("rosrun", "tf2_ros", "static_transform_publisher", *numbers, parent, child)
        ros.wait_for_publisher("/tf_static")
    tab = open_tab(Page(ros), "tf")
    expect(tab.locator("tr[data-name='crater']")).to_be_visible()
    tab.get_by_label("Pose of frame").fill("hand")
    tab.get_by_label("In frame").fill("base")
    tab.get_by_label("In frame").press("Tab")
    pair = tab.get_by_role("region", name="Transform")
    expect(pair).to_contain_text(re.compile(r"Translation \(m\)1 +2 +3.*\(°\)0 +0 +90", re.DOTALL))
    expect(pair).to_contain_text(re.compile(r"hand ← arm \(\S+, static\) ← base"))
    keep_screenshots(tab, "tf-pair")
    tab.reload()
    expect(pair).to_contain_text("90")
    tab.get_by_label("In frame").fill("moon")
    tab.get_by_label("In frame").press("Tab")
    expect(pair.locator(".error")).to_contain_text("not part of the same tree")


def test_diagnostics_have_values_and_a_history(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "diagnostics")
    expect(tab.locator(".bar")).to_contain_text(re.compile(r"OK: [23]Warning: 1"))  # the list is complete
    tab.get_by_role("button", name=re.compile("^right")).click()
    side = tab.locator("aside")
    expect(side).to_contain_text("temperature41")
    expect(side.locator(".history .diagnostic-0").first).to_be_visible()
    expect(side.locator(".history .diagnostic-2").first).to_be_visible()
