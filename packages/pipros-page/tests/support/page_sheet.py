"""A contact sheet of all views and of the pages of nodes: `script/generate pictures sheet`."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

from PIL import Image, ImageDraw
from playwright.sync_api import Browser
from playwright.sync_api import Page as Tab
from playwright.sync_api import TimeoutError as Waited

from tests.browser.shares import share_of_pictures
from tests.browser.test_opencv_windows import PROGRAM as WINDOWS
from tests.support.environments import make_tool_folder
from tests.support.page import Page
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem

SIZES = {"1440": (1440, 900), "1280": (1280, 800), "800": (800, 900), "390": (390, 844)}
SCHEMES = ("light", "dark")
HEIGHT = 240
"""Height of a picture on the sheet (pixels)."""
GAP = 8
LABEL = 110
PLACES = {
    "overview": "",
    "graph": "graph",
    "graph node": "graph/node:/robot",
    "topics": "topics",
    "topic": "topics//imu",
    "plot": "plot//imu/angular_velocity/x:y",
    "plot empty": "plot",
    "console": "console",
    "params": "params",
    "reconfigure": "reconfigure//drive",
    "nodes": "nodes",
    "launches": "launches",
    "images": "images//front/image_raw",
    "images empty": "images",
    "tf": "tf",
    "tf pair": "tf/base_link>laser",
    "scene": "scene",
    "panels": "panels/row(plot//imu/angular_velocity/x~column(topics~console))",
    "bags": "bags",
    "diagnostics": "diagnostics//Motors/right",
    "services": "services//robot/get_loggers",
    "actions": "actions",
    "publish": "publish",
    "teleop": "teleop",
    "fleet": "fleet",
    "ros2": "ros2",
    "acts": "acts",
    "bag": "bags/run.bag",  # the last one: from then on, the other views show the bag
}
PROGRAMS = {
    "turtlesim": ("rosrun", "turtlesim", "turtlesim_node"),
    "simulator": ("rosrun", "pipros_sim", "sim"),
    "sliders": ("rosrun", "rqt_robot_steering", "rqt_robot_steering", "__name:=steering"),
    "windows": ("python3", "viewer.py"),
}
OPENED = """() => {
  const parts = "#view > .tab:not([hidden]), main > [id]:not(#view, #locked), main form";
  const view = document.querySelector(parts);
  return view !== null && !/Looking at the system|received yet/.test(view.innerText)
    && [...view.querySelectorAll(".panels, .panel > .tab")].every((each) => each.childElementCount > 0);
}"""
"""True once a view has opened, and has data."""
OPENED_MS = 20_000
SETTLED_MS = 2000
SLOWEST_MS = 120_000
"""Maximum time for a picture: a browser without a graphics card shares the processor with other programs."""
RECORDED_S = 10


@contextmanager
def empty_system() -> Iterator[tuple[RosSystem, int]]:
    """Yield a system without processes, and the port of its master."""
    with TemporaryDirectory() as folder:
        home, port = Path(folder), ClaimedPort()
        ros = RosSystem(port.number, home, make_tool_folder(home / "bin"))
        try:
            yield ros, port.number
        finally:
            ros.close()
            port.release()


@contextmanager
def addresses(ros: RosSystem) -> Iterator[Mapping[str, str]]:
    """Start the page and the pages of nodes, and yield the address of each view."""
    with TemporaryDirectory() as bags:
        bag = Path(bags) / "run.bag"
        ros.pipros.run("rosbag", "record", "-a", f"--duration={RECORDED_S}", "-O", bag, timeout_s=300)
        page = Page(ros, "--control", "--bags", bags, command="rqt")
        views = {name: page.url_of(place) for name, place in PLACES.items()}
        with empty_system() as (other, _):
            other.pipros.start_master()
            (other.home / "viewer.py").write_text(WINDOWS)
            for name, words in PROGRAMS.items():
                views[name] = Page.of(other.pipros.start(*words)).url
            yield {**views, "token": f"http://{page.host}/#token=wrong"}


def take_sheet(views: Mapping[str, str], browser: Browser, folder: Path) -> None:
    """Write a picture of each view, size and colour scheme into `folder`, and all of them on `sheet.png`.

    For each picture, the share of camera images, charts, graphs and scenes in its area is printed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for size, scheme in product(SIZES, SCHEMES):
        context = browser.new_context(
            viewport={"width": SIZES[size][0], "height": SIZES[size][1]},
            color_scheme=scheme,  # type: ignore[arg-type]
            has_touch=size == "390",
        )
        context.set_default_timeout(SLOWEST_MS)
        tab = context.new_page()
        for name, address in views.items():
            _go(tab, address)
            tab.screenshot(path=_file(folder, name, size, scheme))
            is_wide = tab.evaluate("document.documentElement.scrollWidth > innerWidth")
            wide = ", too wide" if is_wide else ""
            print(f"{size} {scheme} {name}: {share_of_pictures(tab):.1%}{wide}", flush=True)
        context.close()
    _sheet(folder, list(views), list(product(SCHEMES, SIZES)))


def _go(tab: Tab, address: str) -> None:
    """Open a view: within the same page if possible, so that it has its connection and the data of curves."""
    here, there = urlsplit(tab.url), urlsplit(address)
    place = there.fragment.partition("/")[2]
    if place and here.netloc == there.netloc and "token=wrong" not in address:
        tab.evaluate("(place) => { location.hash = place; }", place)
    else:
        tab.goto("about:blank")
        tab.goto(address)
    with suppress(Waited):
        tab.wait_for_function(OPENED, timeout=OPENED_MS)
    tab.wait_for_timeout(SETTLED_MS)


def _file(folder: Path, name: str, size: str, scheme: str) -> Path:
    return folder / f"{name.replace(' ', '-')}-{size}-{scheme}.png"


def _sheet(folder: Path, names: Sequence[str], columns: Sequence[tuple[str, str]]) -> None:
    widths = [round(SIZES[size][0] * HEIGHT / SIZES[size][1]) for _, size in columns]
    whole = (LABEL + sum(widths) + GAP * len(widths), (HEIGHT + GAP) * len(names))
    sheet = Image.new("RGB", whole, "#888888")
    text = ImageDraw.Draw(sheet)
    for row, name in enumerate(names):
        x, y = LABEL, row * (HEIGHT + GAP)
        text.text((GAP, y + GAP), name, fill="white")
        for (scheme, size), width in zip(columns, widths, strict=True):
            with Image.open(_file(folder, name, size, scheme)) as picture:
                sheet.paste(picture.resize((width, HEIGHT), Image.Resampling.LANCZOS), (x, y))
            x += width + GAP
    sheet.save(folder / "sheet.png", optimize=True)
    print(f"{folder / 'sheet.png'}: {len(names)} views")
