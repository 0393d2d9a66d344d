"""Fixtures for the page in a real browser.

`PIPROS_SCREENSHOTS=FOLDER` saves pictures of each tab, light and dark."""

import contextlib
import os
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, ConsoleMessage, expect, sync_playwright
from playwright.sync_api import Page as Tab
from playwright.sync_api import TimeoutError as Waited

from tests.graph.shared import shared_ros as shared_ros
from tests.support.browser import find_chromium
from tests.support.environments import file_of_tests
from tests.support.network import steady_interfaces
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

expect.set_options(timeout=60_000)

OpenTab = Callable[..., Tab]
LONGEST_S = 400  # for a test: a browser without a graphics card shares two cores with other tests
OF_A_CONNECTION = "WebSocket connection to "
"""How Chromium's own entries in the console begin when a server has ended, or another login replaces one."""


def pytest_collection_modifyitems(items: Sequence[pytest.Item]) -> None:
    for item in items:  # those of all folders, in each folder that imports this
        if "/tests/browser/" in item.nodeid:
            item.add_marker(pytest.mark.timeout(LONGEST_S))


@pytest.fixture(autouse=True)
def steady_network() -> Iterator[None]:
    """Keep the network interfaces as they are while a browser runs."""
    with steady_interfaces():
        yield


@pytest.fixture
def ros(ros: RosSystem) -> RosSystem:
    """A system whose pages wait for browsers that stall for seconds."""
    ros.pipros.environment["PIPROS_LIMITS"] = "login_s=60"
    return ros


def start_robot(ros: RosSystem) -> RosSystem:
    """Start `roscore`, and the node `/robot` with data for every tab."""
    ros.pipros.environment["PIPROS_LIMITS"] = "login_s=60"
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, file_of_tests("browser/programs/robot_program.py"), "robot")
    ros.wait_for_publisher("/imu")
    return ros


@pytest.fixture(scope="module")
def robot(shared_ros: RosSystem) -> RosSystem:
    """`roscore` and `/robot` for the tests of a file that leave both as they are."""
    return start_robot(shared_ros)


@pytest.fixture(scope="module")
def page(robot: RosSystem) -> Page:
    """The page of `robot`, without options."""
    return Page(robot)


@contextlib.contextmanager
def running_chromium() -> Iterator[Browser]:
    """Start Chromium, and end it. Meanwhile, Playwright runs an event loop in this thread."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=["--no-sandbox"])
        yield browser
        browser.close()


class SharedChromium:
    """Chromium for successive tests of any package: a start takes a second of processor time."""

    def __init__(self) -> None:
        self._started = contextlib.ExitStack()
        self._browser: Browser | None = None

    def browser(self) -> Browser:
        """Return the running browser, started if necessary."""
        if self._browser is None:
            self._browser = self._started.enter_context(running_chromium())
        return self._browser

    def end(self) -> None:
        self._started.close()
        self._browser = None


_CHROMIUM = SharedChromium()


@pytest.fixture
def chromium() -> Browser:
    return _CHROMIUM.browser()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(
    item: pytest.Item, nextitem: pytest.Item | None
) -> Generator[None, object, object]:
    """End Chromium before the first test of another folder, which Playwright's event loop would harm."""
    try:
        return (yield)
    finally:
        if nextitem is None or nextitem.path.parent.name != item.path.parent.name:
            _CHROMIUM.end()


@pytest.fixture
def open_tab(chromium: Browser) -> Iterator[OpenTab]:
    """Open a page at a tab: `open_tab(page, "graph")`. An error in its console fails the test."""
    errors: list[str] = []

    def note(message: ConsoleMessage) -> None:
        if message.type == "error" and not message.text.startswith(OF_A_CONNECTION):
            errors.append(message.text)

    def open_it(page: Page, place: str, size: tuple[int, int] = (1200, 700)) -> Tab:
        context = chromium.new_context(
            viewport={"width": size[0], "height": size[1]}, reduced_motion="reduce"
        )
        context.set_default_timeout(60_000)
        tab = context.new_page()
        tab.on("console", note)
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.goto(page.url_of(place))
        return tab

    yield open_it
    for context in chromium.contexts:
        context.close()
    assert errors == []


def go_to(tab: Tab, title: str) -> None:
    """Click the tab of a view. The pointer opens its group if that has no room for its tabs."""
    link = tab.locator("#tabs a").get_by_text(title, exact=True)
    group = tab.locator("#tabs .group").filter(has=tab.locator(f"a:text-is('{title}')"))

    def is_clicked() -> bool:
        with contextlib.suppress(Waited):
            if not link.is_visible():
                # invisible if the row is drawn meanwhile and has room
                group.locator(".name").hover(timeout=1_000)
            link.click(timeout=10_000)
            return True
        return False

    wait_until(is_clicked, 120, f"a click on the tab {title}")


def show_all_controls(tab: Tab) -> None:
    """Open the rows of controls after the first one."""
    tab.get_by_role("button", name="More controls").click()


def press(tab: Tab, name: str) -> None:
    """Click a button of a toolbar, for which "…" may have to open further rows."""
    button = tab.get_by_role("button", name=name, exact=True)

    def is_pressed() -> bool:
        more = tab.get_by_role("button", name="More controls")
        if not button.is_visible() and more.count() and more.get_attribute("aria-expanded") == "false":
            more.click()
        with contextlib.suppress(Waited):
            button.click(timeout=10_000)
            return True
        return False

    wait_until(is_pressed, 120, f"a click on {name}")


def keep_screenshots(tab: Tab, name: str) -> None:
    """Save a light and a dark picture in the folder PIPROS_SCREENSHOTS."""
    folder = os.environ.get("PIPROS_SCREENSHOTS")
    schemes: tuple[Literal["light", "dark"], ...] = ("light", "dark") if folder else ()
    for scheme in schemes:
        tab.emulate_media(color_scheme=scheme)
        tab.screenshot(path=Path(folder or "") / f"{name}-{scheme}.png")
