#!/usr/bin/env python3
"""Takes the pictures of the page in docs/. `script/pictures --page [NAME…]` calls it, for all or for some.

`script/pictures --page sheet [FOLDER [VIEW…]]` calls `take_all` instead. The pictures show a small robot,
which consists of programs in `tests.browser.programs` and of relays. The picture `battery` shows the
package vehicle_battery. Chromium, Playwright and Pillow are needed.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, sync_playwright
from playwright.sync_api import Page as Tab

from pipros.reconfigure.cfg_file import module_contents, read
from tests.browser.test_reconfigure_tab import CFG
from tests.support.browser import find_chromium
from tests.support.environments import REPOSITORY
from tests.support.page import Page
from tests.support.page_sheet import addresses, empty_system, take_sheet
from tests.support.ros import RosSystem

PROGRAMS = REPOSITORY / "build" / "tests" / "browser" / "programs"
SIZE = {"width": 1000, "height": 560}
RELAYS = {
    "estimator": ("/imu", "/odometry/imu"),
    "planner": ("/odometry/imu", "/plan"),
    "detector": ("/front/image_raw", "/detections"),
    "charger": ("/battery", "/charging"),
    "display": ("/detections", "/shown"),
}
PANELS = "panels/row(column(plot//imu/angular_velocity/x:y*54~console*46)*62~images//front/image_raw*38)"
# The name of the picture, the tab, the colours, the expected text, and the elements to click first.
PICTURES = (
    ("graph", "graph", "light", "text >> text=Hz", ""),
    ("topic", "graph/topic:%2Fbattery", "dark", "[role=meter]", ""),
    ("plot", "plot/%2Fimu%2Fangular_velocity%2Fx%3Ay", "light", ".u-over", ""),
    ("console", "console", "dark", ".entry >> nth=14", ""),
    ("reconfigure", "reconfigure/%2Fdrive", "light", "text=Wheels", ""),
    ("images", "images/%2Ffront%2Fimage_raw", "dark", ".bar >> text=rgb8", ""),
    ("tf", "tf", "light", "td >> text=wheel_left", ""),
    ("bags", "bags/run.bag", "light", ".timeline .thumbnail >> nth=5", ".timeline .area"),
    ("diagnostics", "diagnostics/%2FMotors%2Fright", "light", ".history .diagnostic-2", ""),
    ("panels", PANELS, "light", ".panel .entry >> nth=5", ""),
    ("teleop", "teleop", "dark", ".figures >> text=no subscribers", "text=Start"),
)
BATTERY_PICTURE = ("battery", "graph/topic:%2Fbattery_state", "light", "[role=meter]", "")
FILLING_S = 40
"""How long curves, logs and histories collect data before their pictures are taken."""
RECORDED_S = 20
COLOURS = 160
LARGEST_BYTES = 150_000


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


def open_tab(browser: Browser, page: Page, place: str, scheme: str) -> Tab:
    context = browser.new_context(viewport=SIZE, color_scheme=scheme)  # type: ignore[arg-type]
    tab = context.new_page()
    tab.goto(page.url_of(place))
    return tab


def small(file: Path) -> None:
    """Reduce a picture to `COLOURS` colours. Raise SystemExit if it is still larger than `LARGEST_BYTES`."""
    with Image.open(file) as image:
        image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
    if file.stat().st_size > LARGEST_BYTES:
        raise SystemExit(f"{file} has {file.stat().st_size} bytes; the limit is {LARGEST_BYTES}")


def take(ros: RosSystem, pictures: Sequence[tuple[str, str, str, str, str]], browser: Browser) -> None:
    """Take pictures of a running system once all tabs have received data."""
    with tempfile.TemporaryDirectory() as bags:
        if any(name == "bags" for name, *_ in pictures):
            bag = Path(bags) / "run.bag"
            ros.pipros.run("rosbag", "record", "-a", f"--duration={RECORDED_S}", "-O", bag, timeout_s=60)
        _take(Page(ros, "--control", "--bags", bags), pictures, browser)


def _take(page: Page, pictures: Sequence[tuple[str, str, str, str, str]], browser: Browser) -> None:
    tabs = {name: open_tab(browser, page, place, scheme) for name, place, scheme, *_ in pictures}
    next(iter(tabs.values())).wait_for_timeout(FILLING_S * 1000)
    for name, _, _, sight, click in pictures:
        tab = tabs[name]
        tab.bring_to_front()
        if click:
            tab.locator(click).first.click()
        tab.locator(sight).first.wait_for()
        tab.wait_for_timeout(500)
        file = REPOSITORY / "docs" / f"page-{name}.png"
        tab.screenshot(path=file)
        small(file)
        print(f"docs/{file.name} is up to date: {file.stat().st_size // 1000} kB")


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
    names = sys.argv[1:] or [picture[0] for picture in (*PICTURES, BATTERY_PICTURE)]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=["--no-sandbox"])
        for system, its_pictures in ((robot, PICTURES), (battery, (BATTERY_PICTURE,))):
            wanted = [picture for picture in its_pictures if picture[0] in names]
            if wanted:
                with system() as ros:
                    take(ros, wanted, browser)
        browser.close()


if __name__ == "__main__":
    main()
