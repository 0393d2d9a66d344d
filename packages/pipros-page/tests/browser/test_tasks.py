"""Fifteen everyday tasks, each done with the keyboard alone and once more with the mouse.

    pytest -s packages/pipros-page/tests/browser/test_tasks.py

prints the keys and the clicks. None may need more than the table in docs/internals/page.md says.
A typed text counts as one key, and not as a click; in a form, it may contain Tab, which leads to the next
field.
"""

import json
import random
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xmlrpc.client import ServerProxy

from playwright.sync_api import Download, Locator, expect
from playwright.sync_api import Page as Tab

from pipros_libraries.reconfigure.cfg_file import module_contents, read
from tests.browser.chromium import go_to, keep_screenshots
from tests.browser.every_tab import ROBOT
from tests.browser.test_bags_tab import make_bag
from tests.support import documents
from tests.support.page import Page
from tests.support.processes import Process
from tests.support.ros import RosSystem

PROGRAM = Path(__file__).parent / "programs" / "tasks_program.py"
CFG = """
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
gen.add("gain", double_t, 1, "Of the controller", 1.5, -10, 10)
exit(gen.generate("tuning", "tuning", "Tuning"))
"""
ARM = """
import rospy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage
rospy.init_node("arm_driver")
transforms = rospy.Publisher("/tf", TFMessage, queue_size=10)
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    arm = TransformStamped(child_frame_id="arm")
    arm.header.stamp, arm.header.frame_id, arm.transform.rotation.w = rospy.Time.now(), "base_link", 1.0
    transforms.publish(TFMessage([arm]))
    rate.sleep()
"""
NODES, TOPICS = 60, 300
MOST_KEYS = 15
MOST_TABS = 12
IS_FOCUSED = "(element) => element === document.activeElement"
IS_DARK = """() => {
  const brightness = (colour) =>
    colour.match(/\\d+/g).slice(0, 3).reduce((sum, each) => sum + Number(each), 0);
  const style = getComputedStyle(document.body);
  return brightness(style.color) - brightness(style.backgroundColor);
}"""


@dataclass
class Hands:
    """What a person does in a tab."""

    tab: Tab
    done: list[str] = field(default_factory=list)
    """The keys, or the clicks; typed texts are quoted."""

    def press(self, *keys: str) -> None:
        for key in keys:
            self.tab.keyboard.press(key)
            self.done.append(key)

    def write(self, text: str) -> None:
        """Type a text at once, because the page may act on parts of it."""
        for number, part in enumerate(text.split("\t")):
            if number:
                self.tab.keyboard.press("Tab")
            if part:  # an empty text would replace what Tab has selected
                self.tab.keyboard.insert_text(part)
        self.done.append(repr(text))

    def tab_to(self, element: Locator) -> None:
        """Press Tab until an element has the focus."""
        for _ in range(MOST_TABS):
            self.press("Tab")
            if element.evaluate(IS_FOCUSED):
                return
        raise AssertionError(f"{MOST_TABS} times Tab does not lead to {element}")

    def click(self, element: Locator) -> None:
        element.click()
        self.done.append("click")

    def choose(self, element: Locator, label: str) -> None:
        """Choose an entry of a list, which is one gesture."""
        element.select_option(label=label)
        self.done.append("click")

    def go_to(self, title: str) -> None:
        go_to(self.tab, title)
        self.done.append("click")

    @property
    def clicks(self) -> int:
        return self.done.count("click")


class World:
    """The system in which the tasks are done, and its page."""

    def __init__(self, ros: RosSystem, folder: Path) -> None:
        self.ros = ros
        ros.pipros.start_master()
        (folder / "Tuning.cfg").write_text(CFG)
        module = folder / "module.json"
        module.write_text(json.dumps(module_contents(read(folder / "Tuning.cfg"))))
        ros.pipros.start(sys.executable, ROBOT, "robot")
        ros.pipros.start(sys.executable, PROGRAM, module)
        ros.pipros.start("rosrun", "actionlib_tutorials", "fibonacci_server")
        for topic in ("/imu", "/speed", "/fibonacci/status"):
            ros.wait_for_publisher(topic)
        (folder / "bags").mkdir()
        make_bag(folder / "bags" / "run.bag")
        self.page = Page(ros, "--control", "--bags", folder / "bags")

    def start_arm(self, tab: Tab) -> None:
        """Publish the frame of an arm until the page shows it, and then end its node."""
        arm: Process = self.ros.pipros.start(sys.executable, "-c", ARM)
        expect(row(tab, "arm")).to_contain_text("Hz")
        arm.kill()
        expect(row(tab, "arm")).to_contain_text("stale")

    def add_nodes(self, tab: Tab) -> None:
        """Register nodes that do not exist, with topics."""
        choice = random.Random(1)  # noqa: S311 - the same graph each time
        with ServerProxy(self.ros.master_uri) as master:
            for topic in range(TOPICS):
                node = choice.randrange(NODES)
                name = f"/ns{node % 6}/node{node}"
                master.registerPublisher(
                    name, f"/ns{node % 6}/topic{topic}", "std_msgs/String", "http://127.0.0.1:9/"
                )
        tab.reload()


def nothing(_: object) -> None:
    """Neither a key nor a click is needed."""


def row(tab: Tab, name: str) -> Locator:
    return tab.locator(f"tr[data-name='{name}']:visible")


@dataclass(frozen=True)
class Task:
    """One task: where it begins, its two ways, and a check of what they lead to."""

    place: str
    by_keys: Callable[[Hands], None]
    by_mouse: Callable[[Hands], None]
    shows: Callable[[Tab], None]
    begin: Callable[[World, Tab], None] = lambda world, tab: None
    size: tuple[int, int] = (1440, 900)


# -- why a topic has no data


def why_by_keys(hands: Hands) -> None:
    expect(row(hands.tab, "/left/image_rect")).to_be_visible()
    hands.press("/")
    hands.write("image_rect")
    hands.press("ArrowDown", "Enter")
    expect(hands.tab.get_by_role("button", name="Why no data on")).to_be_visible()
    hands.press("w")


def why_by_mouse(hands: Hands) -> None:
    hands.click(row(hands.tab, "/left/image_rect"))
    hands.click(hands.tab.get_by_role("button", name="Why no data on"))


def why_shown(tab: Tab) -> None:
    expect(tab.locator(".why:visible [role=status]")).to_contain_text("publish")
    expect(tab.locator(".why:visible li.fails")).to_have_count(1)


# -- two fields against each other, five minutes


def plot_by_keys(hands: Hands) -> None:
    hands.press("/")
    hands.write("/imu/angular_velocity/x:y")
    hands.press("Enter")
    expect(hands.tab.locator(".legend .curve")).to_have_count(2)
    hands.tab_to(hands.tab.get_by_label("Time span"))
    hands.press("5")
    hands.tab_to(hands.tab.get_by_label("X axis"))
    hands.press("End")


def plot_by_mouse(hands: Hands) -> None:
    hands.click(hands.tab.get_by_label("Topic and field"))
    hands.write("/imu/angular_velocity/x:y")
    hands.press("Enter")
    hands.choose(hands.tab.get_by_label("Time span"), "5 min")
    hands.choose(hands.tab.get_by_label("X axis"), "first curve (x-y)")


def plot_shown(tab: Tab) -> None:
    expect(tab.get_by_label("Time span")).to_have_value("300")
    expect(tab.get_by_label("X axis")).to_have_value("xy")
    expect(tab.locator(".legend .curve")).to_have_count(2)
    expect(tab.locator(".chart canvas")).to_be_visible()


# -- two images


def images_shown(tab: Tab) -> None:
    images = tab.get_by_role("region", name="Images")
    expect(images).to_have_count(2)
    for number in range(2):
        expect(images.nth(number)).to_contain_text("rgb8")


# -- a frame that has become stale, and its sender


def stale_shown(tab: Tab) -> None:
    expect(row(tab, "arm")).to_have_attribute("aria-selected", "true")
    expect(row(tab, "arm")).to_contain_text("/arm_driver")
    expect(row(tab, "arm")).to_contain_text("stale")


# -- a parameter and its effect


def parameter_by_keys(hands: Hands) -> None:
    expect(hands.tab.locator(".legend .curve")).to_contain_text("1.5")
    hands.press("b")
    expect(hands.tab.get_by_role("region", name="Plot")).to_be_visible()
    hands.press("v", "r", "e", "Enter")
    expect(hands.tab.locator(".tab-reconfigure .setting")).to_be_visible()
    hands.press("b")
    expect(hands.tab.locator(".panel .setting")).to_be_visible()
    hands.press("ArrowRight", "End")


def parameter_by_mouse(hands: Hands) -> None:
    hands.click(hands.tab.locator("#to-panels"))
    hands.choose(hands.tab.get_by_label("Add a panel"), "Reconfigure")
    slider = hands.tab.get_by_label("gain, slider")
    expect(slider).to_be_visible()
    box = slider.bounding_box()
    assert box is not None
    hands.tab.mouse.click(box["x"] + box["width"] - 1, box["y"] + box["height"] / 2)
    hands.done.append("click")


def parameter_shown(tab: Tab) -> None:
    expect(tab.locator(".panel .legend .curve").filter(has_text="/speed/data")).to_contain_text(
        re.compile(r": (10|9\.\d)")
    )


# -- the console


def console_by_keys(hands: Hands) -> None:
    hands.press("/")
    hands.write("slip")


def console_by_mouse(hands: Hands) -> None:
    hands.click(hands.tab.get_by_label("Filter by text"))
    hands.write("slip")


def console_shown(tab: Tab) -> None:
    expect(tab.locator(".entry .text").first).to_contain_text("wheel slips")
    expect(tab.locator(".entry .text").filter(has_not_text="wheel slips")).to_have_count(0)


# -- a bag: open, play, pause, step, loop, export a part, see the scene at that time


def bag_by_keys(hands: Hands) -> None:
    tab = hands.tab
    expect(tab.get_by_role("link", name="run.bag")).to_be_visible()
    hands.press("ArrowDown", "Enter")
    expect(tab.get_by_role("button", name="Play", exact=True)).to_be_visible()
    hands.press("Space")
    expect(tab.get_by_role("button", name="Pause", exact=True)).to_be_visible()
    hands.press("Space")
    expect(tab.get_by_role("button", name="Play", exact=True)).to_be_visible()
    hands.press(".", "l", "t", "Shift+ArrowRight", "Shift+ArrowRight")
    with tab.expect_download() as part:
        hands.press("x")
    check_part(part.value)
    hands.press("v", "s", "Enter")


def bag_by_mouse(hands: Hands) -> None:
    tab = hands.tab
    hands.click(tab.get_by_role("link", name="run.bag"))
    hands.click(tab.get_by_role("button", name="Play", exact=True))
    hands.click(tab.get_by_role("button", name="Pause", exact=True))
    hands.click(tab.get_by_role("button", name="Next message"))
    hands.click(tab.get_by_label("Loop"))
    box = tab.get_by_role("slider", name="Moment").bounding_box()
    assert box is not None
    tab.keyboard.down("Shift")
    tab.mouse.move(box["x"] + box["width"] * 0.2, box["y"] + 20)
    tab.mouse.down()
    tab.mouse.move(box["x"] + box["width"] * 0.4, box["y"] + 20, steps=4)
    tab.mouse.up()
    tab.keyboard.up("Shift")
    hands.done.append("click")
    with tab.expect_download() as part:
        hands.click(tab.get_by_role("button", name="Export", exact=False).first)
    check_part(part.value)
    hands.go_to("Scene")


def check_part(part: Download) -> None:
    size = Path(part.path()).stat().st_size
    assert part.suggested_filename == "run-part.bag"
    assert 0 < size < 40_000


def bag_shown(tab: Tab) -> None:
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Scene")
    expect(tab.locator(".scene-canvas")).to_be_visible()
    expect(tab.locator("#shown-bag")).to_contain_text("run.bag")


# -- publish at 10 Hz


def publish_by_keys(hands: Hands) -> None:
    hands.press("/")
    hands.write("/wish\t")
    expect(hands.tab.get_by_label("Message in YAML")).to_have_value("data: 0")
    hands.write("\t10\t")
    hands.press("Control+a")
    hands.write("data: =sin(t)")
    hands.press("Control+Enter")


def publish_by_mouse(hands: Hands) -> None:
    hands.click(hands.tab.get_by_label("Topic", exact=True))
    hands.write("/wish\t")
    expect(hands.tab.get_by_label("Message in YAML")).to_have_value("data: 0")
    hands.write("\t10\t")
    hands.press("Control+a")
    hands.write("data: =sin(t)")
    hands.click(hands.tab.get_by_role("button", name="Publish", exact=True))


def publish_shown(tab: Tab) -> None:
    expect(tab.locator("#publishers")).to_have_text("publishing 1")
    expect(tab.locator(".tab-publish p").filter(has_text="/wish")).to_contain_text(
        re.compile(r"10 Hz: [1-9]\d")
    )


# -- a service, and a goal


def service_by_keys(hands: Hands) -> None:
    expect(row(hands.tab, "/reset_odometry")).to_be_visible()
    hands.press("/")
    hands.write("reset")
    hands.press("ArrowDown", "Enter")
    expect(hands.tab.locator("aside dd").last).to_have_text("none")
    hands.press("Control+Enter")


def service_by_mouse(hands: Hands) -> None:
    hands.click(row(hands.tab, "/reset_odometry"))
    hands.click(hands.tab.get_by_role("button", name="Call"))


def service_shown(tab: Tab) -> None:
    expect(tab.locator(".answer")).to_contain_text('message: "reset"')


def goal_by_keys(hands: Hands) -> None:
    expect(row(hands.tab, "/fibonacci")).to_contain_text("Fibonacci")
    hands.press("ArrowDown", "Enter")
    send_goal(hands)
    hands.press("Control+Enter")
    expect(hands.tab.locator(".state-open")).to_have_text("active")
    hands.tab_to(hands.tab.get_by_role("button", name="Cancel all"))
    hands.press("Enter")


def goal_by_mouse(hands: Hands) -> None:
    hands.click(row(hands.tab, "/fibonacci"))
    send_goal(hands)
    hands.click(hands.tab.get_by_role("button", name="Send goal"))
    hands.click(hands.tab.get_by_role("button", name="Cancel /"))


def send_goal(hands: Hands) -> None:
    goal = hands.tab.get_by_label("Goal in YAML")
    expect(goal).to_have_value("order: 0")
    expect(goal).to_be_focused()
    hands.press("Control+a")
    hands.write("order: 300")


def goal_shown(tab: Tab) -> None:
    expect(tab.locator(".state-preempted").first).to_be_visible()


# -- a layout: store it, load the page again, open it in a colleague's browser


def layout_by_keys(hands: Hands) -> None:
    expect(hands.tab.get_by_label("Stored layouts").locator("option")).not_to_have_count(0)
    hands.press("n")
    go_to_colleague(hands)
    hands.press("o", "ArrowDown")


def layout_by_mouse(hands: Hands) -> None:
    hands.click(hands.tab.get_by_role("button", name="Layout ▾"))
    go_to_colleague(hands)
    hands.click(hands.tab.get_by_role("button", name="Layout ▾"))
    hands.choose(hands.tab.get_by_label("Stored layouts"), "drive")


def go_to_colleague(hands: Hands) -> None:
    """Store the layout, load the page again, which keeps it, and then as a browser that does not know it."""
    hands.write("drive")
    hands.press("Enter")
    expect(hands.tab.get_by_label("Stored layouts")).to_have_value("drive")
    hands.tab.reload()
    hands.done.append("F5")
    expect(hands.tab.get_by_role("region")).to_have_count(3)
    hands.tab.evaluate("() => { localStorage.clear(); location.hash = '#panels/topics'; }")
    hands.tab.reload()
    expect(hands.tab.get_by_role("region")).to_have_count(1)
    expect(hands.tab.get_by_label("Stored layouts").locator("option")).to_have_count(2)


def layout_shown(tab: Tab) -> None:
    expect(tab.get_by_role("region")).to_have_count(3)


# -- on a phone, from another view, in the dark, and with many nodes


def phone_by_keys(hands: Hands) -> None:
    expect(row(hands.tab, "/battery")).to_be_visible()
    hands.press("/")
    hands.write("battery")
    hands.press("ArrowDown", "Enter")


def phone_shown(tab: Tab) -> None:
    expect(tab.get_by_role("complementary", name="Topic")).to_contain_text("percentage")
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390


def first_row_by_keys(hands: Hands) -> None:
    hands.press("v", "t", "Enter")
    expect(hands.tab.locator("tbody tr").first).to_be_visible()
    hands.press("ArrowDown")


def first_row_by_mouse(hands: Hands) -> None:
    hands.go_to("Topics")
    hands.click(hands.tab.locator("tbody tr").first)


def first_row_shown(tab: Tab) -> None:
    assert tab.locator("tbody tr").first.evaluate(IS_FOCUSED)


def dark_shown(tab: Tab) -> None:
    expect(tab.locator(".legend .curve")).to_be_visible()
    assert tab.evaluate(IS_DARK) > 300


def many_shown(tab: Tab) -> None:
    for number in range(6):
        expect(tab.locator(f".vertex[data-key*='/ns{number}']").first).to_be_visible()


TASKS = {
    "find out why a topic has no data": Task("topics", why_by_keys, why_by_mouse, why_shown),
    "plot two fields against each other, with a time span of 5 minutes": Task(
        "plot", plot_by_keys, plot_by_mouse, plot_shown
    ),
    "show two images": Task(
        "images",
        lambda hands: hands.press("h"),
        lambda hands: hands.click(hands.tab.get_by_role("tab", name="Overview")),
        images_shown,
    ),
    "find a stale frame and its sender": Task(
        "tf",
        lambda hands: hands.press("ArrowDown", "Enter"),  # the arm is the first frame
        lambda hands: hands.click(row(hands.tab, "arm")),
        stale_shown,
        begin=World.start_arm,
    ),
    "change a parameter and see its effect": Task(
        "plot//speed/data", parameter_by_keys, parameter_by_mouse, parameter_shown
    ),
    "filter the console by text": Task("console", console_by_keys, console_by_mouse, console_shown),
    "open, play, pause, step, loop and export a bag, and show it in the scene": Task(
        "bags", bag_by_keys, bag_by_mouse, bag_shown
    ),
    "publish a topic at 10 Hz": Task("publish", publish_by_keys, publish_by_mouse, publish_shown),
    "call a service": Task("services", service_by_keys, service_by_mouse, service_shown),
    "send and cancel a goal": Task("actions", goal_by_keys, goal_by_mouse, goal_shown),
    "store a layout, reload the page, and open the layout in another browser": Task(
        "panels/row(topics~column(console~tf))", layout_by_keys, layout_by_mouse, layout_shown
    ),
    "see the newest message on a phone": Task(
        "topics",
        phone_by_keys,
        lambda hands: hands.click(row(hands.tab, "/battery")),
        phone_shown,
        size=(390, 844),
    ),
    "go from the graph to the first row of the Topics tab": Task(
        "graph", first_row_by_keys, first_row_by_mouse, first_row_shown
    ),
    "see a curve in dark colours": Task("plot//imu/angular_velocity/x", nothing, nothing, dark_shown),
    "see a graph of 60 nodes and 300 topics": Task(
        "graph", nothing, nothing, many_shown, begin=World.add_nodes
    ),
}


def documented() -> Iterator[tuple[str, tuple[int, int]]]:
    """Yield the tasks of the table in the documentation with their keys and clicks."""
    text = documents.text_of("internals/page.md")
    for name, keys, clicks in re.findall(r"^\| ([^|]+) \| (\d+) \| (\d+) \|", text, re.M):
        yield name, (int(keys), int(clicks))


def test_fifteen_tasks_need_few_keys_and_few_clicks(ros: RosSystem, chromium, open_tab, tmp_path) -> None:
    world = World(ros, tmp_path)
    found: dict[str, tuple[int, int]] = {}
    for name, task in TASKS.items():
        counts: list[int] = []
        for way, unit in ((task.by_keys, "keys"), (task.by_mouse, "clicks")):
            tab = open_tab(world.page, task.place, task.size)
            tab.emulate_media(color_scheme="dark" if "dark" in name else "light")
            expect(tab.locator("#view > .tab").first).to_be_visible()
            task.begin(world, tab)
            hands = Hands(tab)
            way(hands)
            task.shows(tab)
            keep_screenshots(tab, f"task-{len(found)}-{len(counts)}")
            tab.context.close()
            assert unit == "clicks" or not hands.clicks, name
            counts.append(len(hands.done) if unit == "keys" else hands.clicks)
            print(f"{name}: {counts[-1]} {unit}: {' '.join(hands.done)}")
        found[name] = (counts[0], counts[1])
    table: Mapping[str, tuple[int, int]] = dict(documented())
    assert set(table) == set(found)
    assert {
        name: counts
        for name, counts in found.items()
        if counts[0] > table[name][0] or counts[1] > table[name][1]
    } == {}
    assert max(keys for keys, _ in table.values()) <= MOST_KEYS
