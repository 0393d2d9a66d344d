"""ROS in a tab of Chromium: terminals, files that survive a reload, programs that fail or never end.

Its server sends no headers for shared memory, as static hosts do, or it is `pipros serve --tab`.
"""

from __future__ import annotations

import contextlib
import functools
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from playwright.sync_api import Browser, FrameLocator, Locator, Page, expect

from tests.browser.chromium import running_chromium, steady_network  # noqa: F401 # the latter is a fixture
from tests.pyodide.conftest import pyodide_files  # noqa: F401 # a fixture
from tests.support.environments import REPOSITORY
from tests.support.student_edits import EXAMPLE
from tests.support.waiting import wait_until

pytestmark = pytest.mark.timeout(600)
expect.set_options(timeout=60_000)

STARTED_WITHIN_MS = 240_000
"""Several workers may start Pyodide at the same time, on a busy machine."""

TAB_PAGE = REPOSITORY / "packages/pipros-tab/src/pipros/tab/page"
PACKAGE = "ws/src/composiv_tryouts"
TALKER = f"{PACKAGE}/scripts/composiv_talker.py"
IS_KEPT = """async () => {
  const done = (request) => new Promise((resolve) => { request.onsuccess = () => resolve(request.result); });
  const database = await done(indexedDB.open("pipros-tab", 1));
  const file = await done(database.transaction("files").objectStore("files").get("/home/student/.bashrc"));
  database.close();
  return file !== undefined && new TextDecoder().decode(file[1]).includes("ws/devel/setup.bash");
}"""
"""Whether the database has the file that was written last."""
BUSY = "import rospy\nrospy.init_node('busy')\nprint('computing', flush=True)\nwhile True:\n    pass\n"


class Files(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Print nothing."""


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with running_chromium() as browser:
        yield browser


@pytest.fixture
def folder(tmp_path: Path, pyodide_files: Path) -> Path:  # noqa: F811
    """Return a folder like that of `script/pyodide_files.py --tab`, without copies."""
    for file in (*TAB_PAGE.iterdir(), REPOSITORY / "docs/in-browser/start.mjs"):
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "files").symlink_to(pyodide_files)
    return tmp_path


@pytest.fixture
def page(chromium: Browser, folder: Path) -> Iterator[Page]:
    """Open the page of a server that sends no special headers."""
    handler = functools.partial(Files, directory=str(folder))
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with opened(chromium, f"http://localhost:{server.server_address[1]}/") as page:
        yield page
    server.shutdown()
    server.server_close()


@pytest.fixture
def classroom(chromium: Browser, folder: Path) -> Iterator[Page]:
    """Open the page of `pipros serve --tab`."""
    command = [str(Path(sys.executable).with_name("pipros")), "serve", "--tab", str(folder), "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        with opened(chromium, server.stderr.readline().split()[-1]) as page:
            yield page
        server.terminate()
        assert server.wait() == 0


@contextlib.contextmanager
def opened(chromium: Browser, address: str) -> Iterator[Page]:
    """Open the page. An error in it fails the test."""
    context = chromium.new_context(viewport={"width": 1300, "height": 900})
    context.set_default_timeout(STARTED_WITHIN_MS)
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(address)
    yield page
    context.close()
    assert errors == []


def terminal(page: Page, number: int) -> Locator:
    return page.locator(".terminal").nth(number)


def begin(page: Page, line: str, number: int = 0) -> None:
    """Type a line once the terminal has a prompt."""
    entry = terminal(page, number).locator(".entry")
    expect(entry).to_contain_text("$", timeout=STARTED_WITHIN_MS)
    entry.locator("input").fill(line)
    entry.locator("input").press("Enter")


def shows(page: Page, text: str, number: int = 0) -> None:
    expect(terminal(page, number)).to_contain_text(text, timeout=STARTED_WITHIN_MS)


def write(page: Page, path: str, text: str) -> None:
    """Write a file in the editor."""
    page.once("dialog", lambda dialog: dialog.accept(path))
    page.get_by_role("button", name="New file").click()
    page.get_by_role("textbox", name="Text of the file").fill(text)
    page.get_by_role("button", name="Save").click()
    page.get_by_role("button", name="Close").click()


def picture(page: Page, program: str) -> FrameLocator:
    """Return the page of a program, in its frame."""
    return page.frame_locator(f"iframe[title={program}]")


def interrupt(page: Page, number: int) -> None:
    terminal(page, number).locator("input").press("Control+c")


def test_the_case_study_in_a_tab(page: Page) -> None:
    begin(page, "mkdir -p ws/src && cd ws/src && catkin_create_pkg composiv_tryouts rospy roscpp")
    shows(page, "Successfully created files in /home/student/ws/src/composiv_tryouts.")
    for path in ("CMakeLists.txt", "package.xml", "msg/BatteryLevel.msg", "scripts/composiv_listener.py"):
        write(page, f"{PACKAGE}/{path}", (EXAMPLE / path).read_text(encoding="utf-8"))
    write(page, TALKER, "#!/usr/bin/env python3\nimport rospy\nrospy.init_node(\n")
    write(page, "busy.py", BUSY)
    begin(page, "cd ~/ws; catkin_make; chmod +x src/composiv_tryouts/scripts/*.py; source devel/setup.bash")
    begin(page, "rosrun composiv_tryouts composiv_talker.py")
    shows(page, "SyntaxError: '(' was never closed")
    write(page, TALKER, (EXAMPLE / "scripts/composiv_talker.py").read_text(encoding="utf-8"))
    begin(page, "echo source ~/ws/devel/setup.bash > ~/.bashrc; echo written")
    shows(page, "written")

    wait_until(lambda: page.evaluate(IS_KEPT))
    page.reload()
    begin(page, "roscore")
    shows(page, "started core service [/rosout]")
    begin(page, "rosrun composiv_tryouts composiv_talker.py", 1)
    shows(page, ": %25", 1)
    begin(page, "rosrun composiv_tryouts composiv_listener.py", 2)
    shows(page, ": Battery level of vehicle: %25", 2)
    interrupt(page, 2)

    begin(page, "python3 ~/busy.py", 2)
    shows(page, "computing", 2)
    terminal(page, 2).get_by_role("button", name="Stop").click()
    begin(page, "rosnode list", 2)
    shows(page, "/talker_node", 2)

    begin(page, "rqt_graph", 2)
    expect(picture(page, "rqt_graph").get_by_text("/talker_node").first).to_be_visible()
    interrupt(page, 2)
    expect(page.locator("iframe")).to_have_count(0)
    begin(page, "rqt_console &", 2)
    expect(picture(page, "rqt_console").get_by_text("%25").first).to_be_visible()
    begin(page, "rosrun turtlesim turtlesim_node &", 2)
    expect(picture(page, "turtlesim").get_by_text("The arrow keys steer")).to_be_visible()
    begin(page, "rqt_plot /turtle1/pose/x &", 2)
    expect(picture(page, "rqt_plot").get_by_text("/turtle1/pose/x: 5.54")).to_be_visible()

    interrupt(page, 1)
    begin(page, "echo the talker has ended", 1)
    shows(page, "the talker has ended", 1)


def test_what_a_tab_lacks_is_one_clear_error(classroom: Page) -> None:
    page = classroom
    assert page.evaluate("crossOriginIsolated")
    begin(page, "gcc --version; python3")
    shows(page, "gcc: command not found")
    shows(page, "python3: a browser tab has no interactive Python; write a file, and run it")
    begin(page, "ls | wc")
    shows(page, "bash: | is not available in a browser tab")
    write(page, "threads.py", "import threading\nthreading.Thread(target=print).start()\n")
    begin(page, "python3 threads.py")
    shows(page, "a browser tab has no threads: use rospy.Timer, or a loop with rospy.sleep")
