"""The Bags tab: a bag on a timeline, which plays for all tabs."""

import re
import struct
import sys
import zipfile
from pathlib import Path

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import WebSocketRoute, expect

from pipros.msg import load_message_class
from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.connection import Connection
from tests.browser.chromium import OpenTab, go_to, keep_screenshots, show_all_controls
from tests.browser.test_plot_tab import COLUMNS, FIRST
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

BEGIN = 1000
SECONDS = 20
SHOWN_MOMENT = "document.querySelector('.area').getAttribute('aria-valuenow')"

SHADE = "document.querySelector('.tab-images canvas').getContext('2d').getImageData(3, 3, 1, 1).data[0]"


def connect(bag: BagWriter, topic: str, name: str) -> Connection:
    kind = load_message_class(name)
    fields = {"topic": topic, "type": name, "md5sum": kind._md5sum, "message_definition": kind._full_text}
    return bag.add_connection(topic, {key: value.encode() for key, value in fields.items()})


def make_bag(path: Path, *, is_finished: bool = True) -> None:
    """Write 20 s of numbers at 10 Hz, images at 1 Hz, a log entry every 5 s, and a static transform."""
    image, log, frames = map(
        load_message_class, ("sensor_msgs/Image", "rosgraph_msgs/Log", "tf2_msgs/TFMessage")
    )
    transform = load_message_class("geometry_msgs/TransformStamped")
    with path.open("wb") as file:
        bag = BagWriter(file, chunk_bytes=4000)
        numbers = connect(bag, "/number", "std_msgs/Float64")
        images, logs = connect(bag, "/camera", image._type), connect(bag, "/rosout", log._type)
        static = connect(bag, "/tf_static", frames._type)
        link = transform()
        link.header.frame_id, link.child_frame_id, link.transform.rotation.w = "base", "laser", 1.0
        bag.write_message(static, BEGIN, 0, frames([link]))
        for tick in range(SECONDS * 10 + 1):
            second, tenth = divmod(tick, 10)
            stamp = BEGIN + second, tenth * 100_000_000
            bag.write(numbers, *stamp, struct.pack("<d", tick / 10))
            if tenth == 0:
                shade = second * 12
                picture = image(encoding="mono8", width=8, height=6, step=8, data=bytes([shade] * 48))
                bag.write_message(images, *stamp, picture)
            if tick % 50 == 0:
                bag.write_message(logs, *stamp, log(level=2, name="/robot", msg=f"second {second}"))
        if is_finished:
            bag.finish()
        else:
            bag.finish_chunk()


def jump_to(tab: Tab, seconds: str) -> None:
    tab.get_by_label("Jump to").fill(seconds)
    tab.get_by_label("Jump to").press("Enter")
    expect(tab.get_by_label("Moment in the bag")).to_contain_text(f"0:{float(seconds):04.1f} /")


def show_tab(tab: Tab, name: str) -> None:
    go_to(tab, name)


@pytest.fixture
def with_bag(ros: RosSystem, tmp_path: Path) -> RosSystem:
    ros.serve_master()
    make_bag(tmp_path / "run.bag")
    return ros


def test_all_tabs_show_the_moment_of_the_bag(with_bag: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = open_tab(Page(with_bag, tmp_path / "run.bag", command="rqt_bag"), "bags/run.bag")
    expect(tab.locator(".timeline .name")).to_have_count(4)
    expect(tab.locator(".timeline .thumbnail").nth(5)).to_be_visible()
    jump_to(tab, "7.5")
    keep_screenshots(tab, "bags")
    tab.evaluate("location.hash = 'topics//number'")
    expect(tab.locator("aside")).to_contain_text("data: 7.5")
    show_tab(tab, "Images")
    expect(tab.locator(".tab-images .bar")).to_contain_text("6 mono8")
    wait_until(lambda: tab.evaluate(SHADE) == 7 * 12, 30.0, "the image of second 7")
    show_tab(tab, "Console")
    expect(tab.locator(".rows")).to_contain_text("second 5")
    expect(tab.locator(".rows")).not_to_contain_text("second 10")
    show_tab(tab, "TF")
    expect(tab.locator(".tab-tf")).to_contain_text("laser")
    expect(tab.locator("#shown-bag")).to_contain_text("0:07.5 run.bag")
    for title in ("Publish", "Services", "Actions", "Teleop", "Parameters"):
        show_tab(tab, title)
        note = tab.locator(f".tab-{title.lower().replace('parameters', 'params')} .running-note")
        expect(note).to_have_text("This view acts on the running system, not on the open bag run.bag.")


def test_the_address_holds_the_moment_and_the_timeline_zooms(with_bag: RosSystem, open_tab, tmp_path) -> None:
    tab = open_tab(Page(with_bag, "--bags", tmp_path), "bags/run.bag@7.5")
    moment = tab.get_by_label("Moment in the bag")
    expect(moment).to_contain_text("0:07.5 /")
    tab.get_by_role("button", name="Next message").click()
    wait_until(lambda: tab.evaluate("location.hash") == "#bags/run.bag@7.6", 30, "the moment in the address")
    ticks, images = tab.locator(".timeline .tick"), tab.locator(".timeline .thumbnail")
    expect(ticks).to_have_text(["0:00.0", "0:05.0", "0:10.0", "0:15.0"])
    timeline = tab.get_by_role("slider", name="Moment")
    for _ in range(4):
        timeline.press("+")
    expect(ticks).to_have_text(["0:07.0", "0:08.0", "0:09.0", "0:10.0"])
    expect(images.first).to_be_visible()
    keep_screenshots(tab, "bags-zoomed")
    box = timeline.bounding_box()
    tab.mouse.move(box["x"] + 10, box["y"] + 10)
    tab.mouse.wheel(600, 0)
    expect(ticks.first).not_to_have_text("0:07.0")
    tab.mouse.wheel(0, 600)
    expect(ticks).to_have_text(["0:10.0", "0:15.0"])
    timeline.press("0")
    expect(ticks).to_have_text(["0:00.0", "0:05.0", "0:10.0", "0:15.0"])
    expect(moment).to_contain_text("0:07.6 /")


def test_a_bag_plays_pauses_and_steps(with_bag: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = open_tab(Page(with_bag, "--bags", tmp_path), "bags")
    tab.get_by_role("link", name="run.bag").click()
    moment = tab.get_by_label("Moment in the bag")
    expect(moment).to_contain_text("0:00.0 / 0:20.0")
    tab.get_by_role("button", name="Next message").click()
    expect(moment).to_contain_text("0:00.1")
    tab.locator(".timeline [data-topic='/number']").first.uncheck()
    tab.get_by_role("button", name="Next message").click()
    expect(moment).to_contain_text("0:01.0")
    tab.get_by_role("button", name="Previous message").click()
    expect(moment).to_contain_text("0:00.0")
    tab.get_by_label("Speed").select_option("0.5")  # it does not end within 40 s
    tab.get_by_role("button", name="Play", exact=True).click()
    wait_until(lambda: float(tab.evaluate(SHOWN_MOMENT)) > 1, 30.0, "the bag to play")
    tab.get_by_role("button", name="Pause", exact=True).click()
    expect(tab.get_by_role("button", name="Play", exact=True)).to_be_visible()
    tab.get_by_role("slider", name="Moment").press("End")
    expect(moment).to_contain_text("0:20.0 /")
    tab.get_by_role("slider", name="Moment").press(" ")  # plays from the beginning again
    wait_until(lambda: float(tab.evaluate(SHOWN_MOMENT)) < 19, 30.0, "the beginning")
    tab.get_by_role("button", name="Close the bag").click()
    expect(tab.locator("#shown-bag")).to_be_hidden()
    expect(tab.get_by_role("button", name="Close the bag")).to_be_hidden()


def test_a_plot_follows_the_bag(with_bag: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = open_tab(Page(with_bag, "--bags", tmp_path), "bags/run.bag")
    jump_to(tab, "4")
    tab.get_by_label("Speed").select_option("0.25")  # it does not end within 64 s
    show_tab(tab, "Plot")
    tab.get_by_label("Topic and field").fill("/number/data")
    tab.get_by_label("Topic and field").press("Enter")
    expect(tab.locator(".legend")).to_contain_text("/number/data: 4")
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) > 0.9, 30, "the curve of 20 s")
    keep_screenshots(tab, "plot-bag")
    chart = tab.locator(".u-over").bounding_box()
    assert chart is not None
    for share, value in ((0.5, r"(9|10|11)\b"), (0.2, "4")):  # a click goes to this moment
        tab.mouse.click(chart["x"] + share * chart["width"], chart["y"] + 40)
        tab.mouse.move(0, 0)
        expect(tab.locator(".legend")).to_contain_text(re.compile(f"data: {value}"))
    tab.get_by_role("button", name="Play the bag").click()
    expect(tab.locator(".legend")).to_contain_text(re.compile(r"data: (4\.\d|[5-9]|1\d)"))
    tab.get_by_role("button", name="Pause the bag").click()
    show_all_controls(tab)
    tab.get_by_label("Whole bag").uncheck()
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) < 0.5, 30, "the curve since the jump")
    expect(tab.locator(".legend")).to_contain_text(re.compile(r"data: (4(\.\d)?|[5-9]|1\d)"))


def test_a_bag_that_is_still_recorded_is_read(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    ros.serve_master()
    make_bag(tmp_path / "run.bag.active", is_finished=False)
    tab = open_tab(Page(ros, "--bags", tmp_path), "bags")
    tab.get_by_label("Bag", exact=True).select_option("run.bag.active")
    expect(tab.locator(".timeline .name")).to_have_count(4)
    jump_to(tab, "12")
    tab.evaluate("location.hash = 'topics//number'")
    expect(tab.locator("aside")).to_contain_text("data: 12")


def test_a_part_of_a_bag_is_exported(with_bag: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = open_tab(Page(with_bag, "--bags", tmp_path), "bags/run.bag")
    area = tab.get_by_role("slider", name="Moment")
    jump_to(tab, "10")
    tab.get_by_role("button", name="Export", exact=True).click()  # asks, because the whole bag may be large
    with tab.expect_download():
        tab.get_by_role("button", name=re.compile(r"^Export the whole bag \(.* kB\)\?$")).click()
    expect(tab.get_by_role("button", name="Export", exact=True)).to_be_enabled()
    area.press("Shift+ArrowRight")  # a hundredth of 20 s
    tab.locator(".timeline [data-topic='/rosout']").first.uncheck()
    files = {}
    for form in ("bag", "csv", "images"):
        tab.get_by_label("Format").select_option(form)
        with tab.expect_download() as download:
            tab.get_by_role("button", name="Export selection").click()
        files[form] = Path(download.value.path())
    with BagReader(files["bag"]) as bag:
        stamps = [(topic, time.to_sec()) for topic, _, time, _ in bag.messages()]
    assert sorted(stamps) == [("/camera", 1010), ("/number", 1010), ("/number", 1010.1), ("/number", 1010.2)]
    tables, images = zipfile.ZipFile(files["csv"]), zipfile.ZipFile(files["images"])
    rows = tables.read("number.csv").decode().splitlines()
    assert rows == ["%time,field.data", "1010000000000,10.0", "1010100000000,10.1", "1010200000000,10.2"]
    assert images.namelist() == ["camera/000000_1010.000000000.png"]
    assert images.read(images.namelist()[0]).startswith(b"\x89PNG")


NUMBERS = """
import rospy
from std_msgs.msg import Float64
rospy.init_node("numbers")
one, other = (rospy.Publisher(name, Float64, queue_size=10) for name in ("/one", "/other"))
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    one.publish(1.0)
    other.publish(2.0)
    rate.sleep()
"""


def test_chosen_topics_are_recorded_and_the_bag_is_opened(ros: RosSystem, open_tab, tmp_path) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", NUMBERS)
    ros.wait_for_publisher("/other")
    tab = open_tab(Page(ros, "--bags", tmp_path, "--control"), "bags")
    tab.get_by_text("Record", exact=True).click()
    tab.get_by_label("Name of the recording").fill("run")
    tab.get_by_label("All topics").uncheck()
    tab.get_by_label("Filter the topics").fill("one")
    tab.get_by_label("/one").check()
    keep_screenshots(tab, "bags-record")
    tab.get_by_role("button", name="Start recording").click()
    state = tab.locator(".recording")
    expect(state).to_contain_text(re.compile(r"Recording run\.bag: 1 topic, [1-9]\d+ messages"))
    keep_screenshots(tab, "bags-recording")
    tab.get_by_role("button", name="Stop recording").click()
    expect(state).to_contain_text("Recorded run.bag")
    tab.get_by_role("button", name="Open", exact=True).click()
    expect(tab.locator(".timeline .name")).to_contain_text("/one")


def test_the_form_to_record_has_its_place_before_the_system_was_observed(ros, open_tab, tmp_path) -> None:
    held: list[str | bytes] = []

    def forward(socket: WebSocketRoute) -> None:
        """Forward all requests but that of the form, as if the first observation never ended."""
        server = socket.connect_to_server()
        socket.on_message(lambda text: (held.append if '"recording"' in str(text) else server.send)(text))

    ros.serve_master()
    make_bag(tmp_path / "run.bag")
    tab = open_tab(Page(ros, "--bags", tmp_path), "topics")
    tab.route_web_socket("**/live", forward)
    tab.reload()
    tab.evaluate("location.hash = 'bags'")
    tab.get_by_role("link", name="run.bag").click()
    expect(tab.locator(".timeline .name").first).to_be_visible()
    expect(tab.locator(".recorder summary")).to_be_visible()
    assert held


def test_a_page_without_control_does_not_record(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros, "--bags", tmp_path), "bags")
    tab.get_by_text("Record", exact=True).click()
    expect(tab.get_by_role("button", name="Start recording")).to_be_disabled()
    expect(tab.locator(".recorder .note")).to_contain_text("Start it with --control")
