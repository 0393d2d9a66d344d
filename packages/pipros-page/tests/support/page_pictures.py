#!/usr/bin/env python3
"""Takes the pictures of the documentation, in docs/pictures: `script/generate pictures [NAME…]`, all or some.

`script/generate pictures sheet [FOLDER [VIEW…]]` calls `take_all` instead. The pictures `graph`, `plot` and
`bags` show a small robot, which consists of programs in `tests.browser.programs` and of relays. Chromium,
Playwright and Pillow are needed.
"""

import importlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from xml.sax.saxutils import escape

from PIL import Image
from playwright.sync_api import Browser, expect, sync_playwright

from pipros.basics.env import DEFAULT_MASTER_URI
from pipros_libraries.reconfigure.cfg_file import module_contents, read
from tests.browser.test_reconfigure_tab import CFG
from tests.support.browser import find_chromium
from tests.support.environments import REPOSITORY
from tests.support.page import Page
from tests.support.page_sheet import addresses, empty_system, take_sheet
from tests.support.ros import RosSystem

SECONDS = 8
COLUMNS, ROWS = 96, 22
LETTER, LINE, EDGE = 7.25, 18, 14
"""Sizes (pixels) of a letter, a line and the margin."""
REST_S = 3.0
"""How long the end is shown before the picture begins again."""
_CODES = re.compile(r"\x1b\]2;.*?\x07|\x1b\[[\d;]*m")
STYLE = """
svg { font: 12px ui-monospace, "DejaVu Sans Mono", Consolas, monospace; }
rect { fill: #16202b; } text { fill: #dfe7ee; white-space: pre; }
.typed { fill: #8fe388; } .bold { font-weight: 700; }
.lines text { animation: 1s step-end infinite; }
@media (prefers-reduced-motion) { * { animation: none !important; } }
"""


def printed() -> list[tuple[float, str]]:
    """Run the demo. Return its lines, each with the time in seconds at which it was printed."""
    with empty_system() as (ros, _):
        environment = {**ros.pipros.environment, "PYTHONUNBUFFERED": "1"}
        command = [str(REPOSITORY / "script" / "demo"), f"--seconds={SECONDS}"]
        begin = time.monotonic()
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as demo:
            assert demo.stdout is not None
            lines = [(time.monotonic() - begin, line.rstrip("\n")) for line in demo.stdout]
        names = {
            f"export ROS_MASTER_URI={ros.master_uri} && ": "", ros.master_uri: DEFAULT_MASTER_URI,
            str(REPOSITORY): "~/pipros", str(ros.home): "~", os.uname().nodename: "robot",
        }  # fmt: skip
    for name, shown in names.items():
        lines = [(when, line.replace(name, shown)) for when, line in lines]
    return lines


def draw(lines: list[tuple[float, str]]) -> str:
    """Return the picture (SVG). Programs that show no animations show the last lines."""
    rows = [(0.0, "typed", "$ script/demo")]
    for when, line in lines:
        kind = "bold" if "\x1b[1m" in line else ""
        text = _CODES.sub("", line)
        rows += [(when, kind, text[at : at + COLUMNS]) for at in range(0, max(len(text), 1), COLUMNS)]
    whole = rows[-1][0] + REST_S
    width, height = COLUMNS * LETTER + 2 * EDGE, ROWS * LINE + 2 * EDGE
    shift = max(0, len(rows) - ROWS) * LINE
    styles = [STYLE, f".lines, .lines text {{ animation-duration: {whole:.1f}s; }}"]
    moves = ["0% { transform: none; }"]
    texts = []
    for number, (when, kind, text) in enumerate(rows):
        percent = f"{100 * when / whole:.2f}%"
        if number >= ROWS:
            moves.append(f"{percent} {{ transform: translateY(-{(number - ROWS + 1) * LINE}px); }}")
        name = f"a{number}"
        styles.append(f"@keyframes {name} {{ 0% {{ opacity: 0; }} {percent}, 100% {{ opacity: 1; }} }}")
        y = EDGE + (number + 0.75) * LINE
        texts.append(
            f'<text class="{kind}" style="animation-name:{name}" x="{EDGE}" y="{y}">{escape(text)}</text>'
        )
    styles.append(f"@keyframes scroll {{ {' '.join(moves)} }}")
    styles.append(
        f".lines {{ animation: scroll {whole:.1f}s step-end infinite; transform: translateY(-{shift}px); }}"
    )
    return "\n".join((
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height}">',
        "<title>The terminal while script/demo runs</title>", f"<style>{''.join(styles)}</style>",
        f'<clipPath id="screen"><rect y="{EDGE}" width="{width:.0f}" height="{ROWS * LINE}"/></clipPath>',
        f'<rect width="{width:.0f}" height="{height}" rx="8"/>',
        '<g clip-path="url(#screen)"><g class="lines">', *texts, "</g></g>", "</svg>\n",
    ))  # fmt: skip


def take_demo(file: Path) -> None:
    """Write the picture of a run."""
    file.write_text(draw(printed()), encoding="utf-8")


PICTURE_FOLDER = REPOSITORY / "docs" / "pictures"
EXAMPLE = REPOSITORY / "examples" / "navigation"
GOALS = ("{x: 2.0, y: -3.0}", "{x: -0.5, y: 0.0}")
GOALS_HZ, BETWEEN_S = "0.08", 6.0
"""The robot drives to each goal again and again, to one of them halfway through the period of the other."""
PROGRAMS = REPOSITORY / "packages" / "pipros-page" / "tests" / "browser" / "programs"
SIZE = {"width": 1000, "height": 560}
RELAYS = {
    "estimator": ("/imu", "/odometry/imu"), "planner": ("/odometry/imu", "/plan"),
    "detector": ("/front/image_raw", "/detections"), "charger": ("/battery", "/charging"),
    "display": ("/detections", "/shown"),
}  # fmt: skip
# The name of the picture, the place, the expected element, and the one to click first.
PICTURES = (
    ("graph", "graph", "text >> text=Hz", ""),
    ("plot", "plot/%2Fimu%2Fangular_velocity%2Fx%3Ay", ".u-over", ""),
    ("bags", "bags/run.bag", ".timeline .thumbnail >> nth=5", ".timeline .area"),
)
BATTERY_PICTURE = ("battery", "graph/topic:%2Fbattery_state", "[role=meter]", "")
OVERVIEW_PICTURE = ("overview", "", ".scene-canvas", "")
FILLING_S = 40
"""How long curves, logs and histories collect data before their pictures are taken."""
RECORDED_S = 20
COLOURS = 160
LARGEST_BYTES = 200_000


@contextmanager
def robot() -> Iterator[RosSystem]:
    """Start the system shown in the pictures."""
    with empty_system() as (ros, _):
        ros.pipros.start_master()
        ros.pipros.start(sys.executable, PROGRAMS / "robot_program.py", "robot")
        cfg = ros.home / "Tuning.cfg"
        cfg.write_text(CFG)
        (ros.home / "module.json").write_text(json.dumps(module_contents(read(cfg))))
        ros.pipros.start(sys.executable, PROGRAMS / "tuned_program.py", "drive", ros.home / "module.json")
        ros.wait_for_publisher("/battery")
        for name, topics in RELAYS.items():
            ros.pipros.start("rosrun", "topic_tools", "relay", *topics, f"__name:={name}")
        place = (*"001000", "base_link", "laser")  # 1 m above base_link, not rotated
        ros.pipros.start("rosrun", "tf2_ros", "static_transform_publisher", *place, "__name:=laser_frame")
        ros.wait_for_publisher("/tf_static")
        yield ros


@contextmanager
def battery() -> Iterator[RosSystem]:
    """Start the battery monitor from examples/, as in the README."""
    arguments = ("source:=simulated", "speed:=60", "percentage:=0.5")
    with empty_system() as (ros, port):
        ros.pipros.start("roslaunch", "-p", str(port), "vehicle_battery", "battery.launch", *arguments)
        ros.wait_for_publisher("/battery_state")
        yield ros


@contextmanager
def navigation() -> Iterator[RosSystem]:
    """Start examples/navigation, whose robot drives to a goal."""
    with empty_system() as (ros, port):
        environment = ros.pipros.environment
        environment["ROS_PACKAGE_PATH"] = str(EXAMPLE)
        environment["PATH"] = os.pathsep.join((environment["PATH"], os.environ["PATH"]))  # has Chromium
        ros.pipros.start(
            "roslaunch", "-p", str(port), "navigation_example", "navigation.launch", "rviz:=false"
        )
        ros.wait_for_publisher("/map")
        ros.wait_for_publisher("/plan")
        for place in GOALS:
            goal = f"{{header: {{frame_id: map}}, pose: {{position: {place}, orientation: {{w: 1.0}}}}}}"
            topic = ("/move_base_simple/goal", "geometry_msgs/PoseStamped")
            ros.pipros.start("rostopic", "pub", "-r", GOALS_HZ, *topic, goal)
            time.sleep(BETWEEN_S)
        yield ros


def take_scene(file: Path) -> None:
    """Take a picture of examples/navigation in rviz, obliquely from above."""
    with navigation() as ros:
        view = (EXAMPLE / "navigation.rviz").read_text()  # from directly above, without perspective
        oblique = r"rviz/Orbit\1Distance: 11, Pitch: 0.75, Yaw: 4.4}"
        changed = ros.home / "orbit.rviz"
        changed.write_text(re.sub("rviz/TopDownOrtho(.*)Scale: 60.*", oblique, view))
        options = ("--png", file, "--size", "1000x560", "--timeout", "30")
        done = ros.pipros.run("rviz", "-d", changed, *options, timeout_s=120)
    assert done.returncode == 0, done.output


def reduce_colours(file: Path) -> None:
    """Reduce a picture to `COLOURS` colours."""
    with Image.open(file) as image:
        image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)


def take(ros: RosSystem, pictures: Sequence[tuple[str, str, str, str]], browser: Browser) -> None:
    """Take pictures of a running system once all tabs have received data."""
    with tempfile.TemporaryDirectory() as bags:
        if any(name == "bags" for name, *_ in pictures):
            bag = Path(bags) / "run.bag"
            ros.pipros.run("rosbag", "record", "-a", f"--duration={RECORDED_S}", "-O", bag, timeout_s=60)
        page, tabs = Page(ros, "--control", "--bags", bags), []
        for _, place, *_ in pictures:
            context = browser.new_context(viewport=SIZE, color_scheme="light")  # type: ignore[arg-type]
            tabs.append(context.new_page())
            tabs[-1].goto(page.url_of(place))
        tabs[0].wait_for_timeout(FILLING_S * 1000)
        for tab, (name, _, sight, click) in zip(tabs, pictures, strict=True):
            tab.bring_to_front()
            if click:
                tab.locator(click).first.click()
            tab.locator(sight).first.wait_for()
            tab.wait_for_timeout(500)
            tab.screenshot(path=PICTURE_FOLDER / f"{name}.png")


def take_tab(browser: Browser, file: Path) -> None:
    """Take a picture of the tab of pipros-tab: three terminals beside a turtle that draws a square."""
    own = importlib.import_module("tests.pyodide.test_tab_page")
    with tempfile.TemporaryDirectory() as folder:
        importlib.import_module("tests.support.pyodide_files").write_tab(Path(folder))
        command = [str(Path(sys.executable).with_name("pipros")), "serve", "--tab", folder, "--port", "0"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
            assert server.stderr is not None
            with own.opened(browser, server.stderr.readline().split()[-1]) as page:
                page.set_viewport_size({"width": 1280, "height": 720})
                own.begin(page, "roscore")
                own.shows(page, "started core service")
                own.begin(page, "rosrun turtlesim turtlesim_node", 1)
                expect(own.picture(page, "turtlesim").get_by_text("The arrow keys steer")).to_be_visible()
                own.begin(page, "rosrun turtlesim draw_square", 2)
                expect(own.terminal(page, 2).get_by_text("Reached goal")).to_have_count(5)
                page.screenshot(path=file)
            server.terminate()


def take_all(folder: Path, names: Sequence[str]) -> None:
    """Take pictures of the named views, or of all of them, in all sizes and colours, and join them."""
    with sync_playwright() as playwright, robot() as ros, addresses(ros) as views:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=["--no-sandbox"])
        take_sheet({name: views[name] for name in names or views}, browser, folder)
        browser.close()


def main() -> None:
    if sys.argv[1:2] == ["sheet"]:
        take_all(Path(sys.argv[2] if sys.argv[2:] else "sheet"), sys.argv[3:])
        return
    pages = ((robot, PICTURES), (battery, (BATTERY_PICTURE,)), (navigation, (OVERVIEW_PICTURE,)))
    names = sys.argv[1:] or [*(name for _, its in pages for name, *_ in its), "scene", "tab", "demo"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=["--no-sandbox"])
        for system, its_pictures in pages:
            wanted = [picture for picture in its_pictures if picture[0] in names]
            if wanted:
                with system() as ros:
                    take(ros, wanted, browser)
        if "tab" in names:
            take_tab(browser, PICTURE_FOLDER / "tab.png")
        browser.close()
    if "scene" in names:
        take_scene(PICTURE_FOLDER / "scene.png")
    if "demo" in names:
        take_demo(PICTURE_FOLDER / "demo.svg")
    for name in names:
        (file,) = PICTURE_FOLDER.glob(f"{name}.*")
        if file.suffix == ".png":
            reduce_colours(file)
        print(f"{file.relative_to(REPOSITORY)} is up to date: {file.stat().st_size // 1000} kB")
        if file.stat().st_size > LARGEST_BYTES:
            raise SystemExit(f"{file} has {file.stat().st_size} bytes; the limit is {LARGEST_BYTES}")


if __name__ == "__main__":
    main()
