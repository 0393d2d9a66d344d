"""ROS in a tab of Chromium: terminals, files that survive a reload, programs that fail or never end.

Its server sends no headers for shared memory, as static hosts do, or it is `pipros serve --tab`.
"""

from __future__ import annotations

import contextlib
import functools
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, FrameLocator, Locator, Page, expect

from tests.browser.chromium import running_chromium, steady_network  # noqa: F401 # the latter is a fixture
from tests.pyodide.conftest import pyodide_files  # noqa: F401 # a fixture
from tests.support.case_study import (
    SOURCE,
    WORKSPACE,
    create_message,
    look_at_the_graph,
    make_workspace_and_package,
    write_nodes_test_and_launch_file,
)
from tests.support.pyodide_files import TAB_FILES
from tests.support.reading import assert_in_order, without_escapes
from tests.support.waiting import wait_until
from tests.tutorial.words import (
    FAILED_ROSTEST,
    HEARD,
    LAUNCH,
    LISTENER,
    PASSED_ROSTEST,
    PASSED_TEST,
    ROSTEST,
    SAID,
    TALKER,
    TEST,
)

pytestmark = pytest.mark.timeout(600)
expect.set_options(timeout=60_000)

STARTED_WITHIN_MS = 240_000
"""Several workers may start Pyodide at the same time, on a busy machine."""

PACKAGE = f"{WORKSPACE}/src/composiv_tryouts"
IS_AT_END = "(screen) => Math.abs(screen.parentElement.scrollTop) < 40"
LINES = "(screen) => [...screen.children].map((line) => line.textContent)"
IS_KEPT = """async () => {
  const done = (request) => new Promise((resolve) => { request.onsuccess = () => resolve(request.result); });
  const database = await done(indexedDB.open("pipros-tab", 1));
  const file = await done(database.transaction("files").objectStore("files").get("/home/student/.bashrc"));
  database.close();
  return file !== undefined && new TextDecoder().decode(file[1]).includes("devel/setup.bash");
}"""
"""Whether the database has the file that was written last."""
MARK_IMAGE = """async () => {
  const cache = await caches.open("pipros-tab-image");
  const [place] = await cache.keys();
  if (!place) return false;
  const image = await (await cache.match(place)).blob();
  const [head] = (await image.slice(0, 4_000_000).text()).split("\\n", 1);
  const about = JSON.parse(head);
  about.files.push(["/kept", 0o040755, null], ["/kept/in_the_cache", 0o100644, 0]);
  const rest = image.slice(new TextEncoder().encode(head).length);
  await cache.put(place, new Response(new Blob([JSON.stringify(about), rest])));
  return true;
}"""
"""Adds an empty file to the kept image; returns whether there is one."""
REFUSE = """const { put } = IDBObjectStore.prototype;
IDBObjectStore.prototype.put = function (...given) { put.apply(this, given); return this.add(...given); }
0"""
"""Makes each write of the database fail, as a full one does."""
PASTE = """(input, text) => {
  const clipboardData = new DataTransfer();
  clipboardData.setData("text", text);
  input.dispatchEvent(new ClipboardEvent("paste", { clipboardData, cancelable: true }));
}"""
COLOURS = "(spans) => spans.map((span) => getComputedStyle(span).color)"
PRINTER = "import itertools\nfor number in itertools.count():\n    print('number', number)\n"
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
    """Return a folder like that of `script/generate tab`, without copies."""
    for file in TAB_FILES:
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
    assert entry.locator("input").bounding_box()["width"] > 200  # type: ignore[index] # also after a long prompt
    entry.locator("input").press("Enter")


def shows(page: Page, text: str, number: int = 0) -> None:
    expect(terminal(page, number)).to_contain_text(text, timeout=STARTED_WITHIN_MS)


def write(page: Page, path: str, text: str) -> None:
    """Write a file in the editor."""
    page.once("dialog", lambda dialog: dialog.accept(path))
    page.get_by_role("button", name="New file").click()
    page.get_by_role("textbox", name="Text of the file").fill(text)
    assert page.get_by_label("Editor").bounding_box()["height"] < 700  # type: ignore[index] # also of a long file
    page.get_by_role("button", name="Save").click()
    page.get_by_role("button", name="Close").click()


class TypedTerminal:
    """A terminal of the page, as `tests.support.case_study` uses one."""

    def __init__(self, page: Page, number: int = 0) -> None:
        self._page, self._number = page, number
        self._screen = terminal(page, number).locator(".screen")

    def run(self, line: str) -> tuple[int, str]:
        """Type a line. Return its exit code and what it printed."""
        begin(self._page, f"{line}; echo $?", self._number)
        entry = terminal(self._page, self._number).locator(".entry")
        expect(entry).to_contain_text("$", timeout=STARTED_WITHIN_MS)
        lines = self._screen.evaluate(LINES)[:-2]  # without the line that is to be written, and the prompt
        echo = max(at for at, text in enumerate(lines) if text.endswith(f"$ {line}; echo $?"))
        *printed, code = lines[echo + 1 :]
        return int(code), "".join(f"{text}\n" for text in printed)


class TypedFile:
    """A file or folder of the page, as `tests.support.case_study` uses a path."""

    def __init__(self, typed: TypedTerminal, page: Page, path: str) -> None:
        self._typed, self._page, self._path = typed, page, path

    def __truediv__(self, name: str) -> TypedFile:
        return TypedFile(self._typed, self._page, f"{self._path}/{name}")

    def read_text(self) -> str:
        return self._typed.run(f"cat ~/{self._path}")[1]

    def write_text(self, text: str) -> None:
        write(self._page, self._path, text)


def picture(page: Page, program: str) -> FrameLocator:
    """Return the page of a program, in its frame."""
    return page.frame_locator(f"iframe[title={program}]")


def interrupt(page: Page, number: int) -> None:
    terminal(page, number).locator("input").press("Control+c")


def test_the_case_study_in_a_tab(page: Page) -> None:
    typed: Any = TypedTerminal(page)
    package: Any = TypedFile(typed, page, PACKAGE)
    shows(page, "Nothing is installed")
    expect(page.locator("#steps li.done")).to_have_count(0)
    assert "catkin_make" in typed.run("help")[1]
    make_workspace_and_package(typed)
    create_message(typed, package)
    assert typed.run("rosmsg show composiv_tryouts/BatteryLevel") == (0, "string battery\n\n")
    write_nodes_test_and_launch_file(typed, package)
    working = package / "scripts/composiv_talker.py"
    text = working.read_text()
    working.write_text("#!/usr/bin/env python3\nimport rospy\nrospy.init_node(\n")
    write(page, "busy.py", BUSY)
    begin(page, TALKER)
    shows(page, "SyntaxError: '(' was never closed")
    working.write_text(text)
    run_tests(typed, package / "launch/composiv_tryout.launch")
    begin(page, f"{LAUNCH} --screen")
    expect(terminal(page, 0)).to_contain_text(re.compile(HEARD), timeout=STARTED_WITHIN_MS)
    interrupt(page, 0)
    begin(page, f"echo {SOURCE} > ~/.bashrc; echo written")
    shows(page, "written")

    wait_until(lambda: page.evaluate(IS_KEPT))
    wait_until(lambda: page.evaluate(MARK_IMAGE))
    page.once("dialog", lambda dialog: dialog.accept("late.txt"))
    page.get_by_role("button", name="New file").click()
    page.get_by_role("textbox", name="Text of the file").fill("not saved yet")
    page.reload()
    begin(page, "cat late.txt; ls /kept; roscore")
    shows(page, "not saved yet")
    shows(page, "in_the_cache")
    shows(page, "started core service [/rosout]")
    begin(page, TALKER, 1)
    expect(terminal(page, 1)).to_contain_text(re.compile(SAID), timeout=STARTED_WITHIN_MS)
    begin(page, LISTENER, 2)
    expect(terminal(page, 2)).to_contain_text(re.compile(HEARD), timeout=STARTED_WITHIN_MS)
    page.get_by_role("button", name="New terminal").click()
    look: Any = TypedTerminal(page, 3)
    look_at_the_graph(look)
    expect(page.locator("#steps li")).to_have_count(15)
    expect(page.locator("#steps li:not(.done)")).to_have_count(0)
    code, report = look.run(TEST)
    assert code == 0
    assert report.partition(".xml\n")[2] == without_escapes(PASSED_TEST)
    interrupt(page, 2)

    begin(page, "python3 ~/busy.py", 2)
    shows(page, "computing", 2)
    interrupt(page, 2)
    shows(page, "The program still runs. Stop, above, ends it at once.", 2)
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
    begin(page, "rosrun turtlesim turtle_teleop_key", 1)
    shows(page, "'q' to quit", 1)
    wait_until(lambda: turtle_moves(page, 1))
    terminal(page, 1).locator("input").press("q")
    begin(page, "rosnode list", 1)


def turtle_moves(page: Page, number: int) -> bool:
    """Press an arrow key. Return whether the turtle has left its first place."""
    terminal(page, number).locator("input").press("ArrowUp")
    return not picture(page, "rqt_plot").get_by_text("/turtle1/pose/x: 5.54").is_visible()


def run_tests(typed: Any, launch: Any) -> None:
    """Figure 11, red, then green, as on a machine (`tests/tutorial/test_4_5_launch_file.py`)."""
    text = launch.read_text()
    launch.write_text("".join(line for line in text.splitlines(True) if "composiv_talker.py" not in line))
    code, red = typed.run(ROSTEST)
    assert code == 2
    assert_in_order(red, [re.sub(r"\\x1b\\\[[\d;]+m", "", pattern) for pattern in FAILED_ROSTEST])
    launch.write_text(text)
    code, green = typed.run(ROSTEST)
    assert code == 0, green
    assert without_escapes(PASSED_ROSTEST) in green


def test_a_program_that_prints_without_end_delays_nothing_else(classroom: Page) -> None:
    page = classroom
    write(page, "printer.py", PRINTER)
    begin(page, "python3 printer.py")
    expect(terminal(page, 0)).to_contain_text(re.compile(r"number \d{5}"), timeout=STARTED_WITHIN_MS)
    begin(page, "echo another terminal", 1)
    shows(page, "student@tab:~$ echo another terminalanother terminal", 1)
    screen = terminal(page, 0).locator(".screen")
    interrupt(page, 0)
    begin(page, "echo the printer has ended")
    shows(page, "KeyboardInterrupt")
    wait_until(lambda: screen.evaluate(IS_AT_END))
    lines = screen.evaluate(LINES)
    numbers = (re.fullmatch(r"number (\d+)", line) for line in lines)  # Ctrl-C may cut the last one
    printed = [int(number[1]) for number in numbers if number]
    assert printed == list(range(printed[0], printed[-1] + 1))
    page.get_by_role("button", name="New terminal").click()
    expect(page.locator(".terminal")).to_have_count(4)
    wait_until(lambda: screen.evaluate(IS_AT_END))


def test_start_anew_removes_the_files_after_a_question(classroom: Page) -> None:
    write(classroom, "notes.txt", "a note")
    name = classroom.locator("#files").get_by_text("notes.txt")
    expect(name).to_be_visible()
    classroom.once("dialog", lambda dialog: dialog.dismiss())
    classroom.get_by_role("button", name="Start anew").click()
    expect(name).to_be_visible()
    with classroom.expect_navigation():
        classroom.once("dialog", lambda dialog: dialog.accept())
        classroom.get_by_role("button", name="Start anew").click()
    expect(classroom.get_by_role("button", name="Start anew")).to_be_enabled()
    expect(name).to_have_count(0)


def test_two_tabs_say_that_they_share_files(classroom: Page) -> None:
    expect(classroom.get_by_role("button", name="New file")).to_be_enabled()
    expect(classroom.get_by_role("status")).to_be_empty()
    with classroom.context.new_page() as second:
        second.goto(classroom.url)
        expect(second.get_by_role("status")).to_contain_text("Another tab has these files open.")


def test_buttons_wait_for_the_page(chromium: Browser, folder: Path) -> None:
    page = chromium.new_page(java_script_enabled=False)
    page.goto((folder / "index.html").as_uri())
    for name in ("New terminal", "New file", "Download files"):
        expect(page.get_by_role("button", name=name)).to_be_disabled()
    page.close()


def test_the_editor_helps_and_what_a_tab_lacks_is_one_clear_error(classroom: Page) -> None:
    page = classroom
    assert page.evaluate("crossOriginIsolated")
    begin(page, "gcc --version; rostopc; python3")
    shows(page, "gcc: command not foundrostopc: command not found. Did you mean rostopic")
    shows(page, "python3: a browser tab has no interactive Python; write a file, and run it")
    entry = terminal(page, 1).locator(".entry input")
    entry.fill("mkdir ")
    entry.evaluate(PASTE, 'made\r\ncd made; echo "a: 1\nb: 2" > two\nls \\\n..; cat t')
    expect(entry).to_have_value("ls ..; cat t")
    entry.press_sequentially("wo")
    entry.press("Enter")
    shows(page, "madea: 1b: 2", 1)
    entry.evaluate(PASTE, "echo 'c: 3\nd: 4'")
    shows(page, "c: 3d: 4", 1)
    begin(page, "ls < made")
    shows(page, "bash: < is not available in a browser tab")
    begin(page, "printenv ROS_IP > made/ip; env | grep MASTER | head -1")
    shows(page, "ROS_MASTER_URI=http://127.0.0.1:11311/")
    begin(page, "python3 -c 'for line in range(30): print(line)' | grep 2 | tail -n 1; echo code $?")
    shows(page, "29code 0")
    for wrong, why in (
        ("made", "made is a folder: add"),
        ("~/../x", "is not a path"),
        ("made/ip/x", "is below"),
    ):
        page.once("dialog", lambda dialog, name=wrong: dialog.accept(name))  # type: ignore[misc]
        page.get_by_role("button", name="New file").click()
        expect(page.get_by_role("status")).to_contain_text(why)
    with page.expect_download() as download:
        page.get_by_role("button", name="Download files").click()
    begin(page, "rm -r made; ls")
    page.locator("#open-zip").set_input_files(download.value.path())
    expect(page.get_by_role("status")).to_contain_text(": unpacked 3 files and folders")
    begin(page, "cat made/ip")
    shows(page, "127.0.0.1")
    page.once("dialog", lambda dialog: dialog.accept("edited.py"))
    page.get_by_role("button", name="New file").click()
    editor = page.get_by_role("textbox", name="Text of the file")
    editor.press_sequentially("if True:\nprint('indented')")
    assert editor.bounding_box()["x"] < 60  # type: ignore[index]
    assert len(set(editor.locator("span").evaluate_all(COLOURS))) > 1
    editor.press("Control+s")
    begin(page, "python3 edited.py")
    shows(page, "indented")
    write(page, "endless.py", "for _ in range(50):\n    print('x' * 1000, end='', flush=True)\n")
    begin(page, "python3 endless.py; echo over")
    expect(terminal(page, 0).locator(".screen")).to_contain_text("xover")
    lines = [line.count("x") for line in terminal(page, 0).locator(".screen").evaluate(LINES)]
    assert sum(lines) >= 50_000  # a line without an end is shown as several
    assert max(lines) < 20_000
    page.evaluate(REFUSE)
    write(page, "large.txt", "x" * 100_000)
    expect(page.get_by_role("status")).to_have_text(
        "files are not kept (ConstraintError): download them, and remove some"
    )
    write(page, "threads.py", "import threading\nthreading.Thread(target=print).start()\n")
    begin(page, "python3 threads.py")
    shows(page, "a browser tab has no threads: use rospy.Timer, or a loop with rospy.sleep")
