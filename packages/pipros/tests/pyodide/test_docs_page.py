"""The guide about the tab in Chromium: blocks are run, changed and stopped, and a bag is listed."""

import functools
import html
import http.server
import re
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from std_msgs.msg import String

import rosbag
import rospy
from tests.browser.chromium import running_chromium, steady_network  # noqa: F401 # the latter is a fixture
from tests.support import documents
from tests.support.environments import REPOSITORY

DOCS = REPOSITORY / "docs"
STARTED_WITHIN_MS = 200_000

pytestmark = pytest.mark.timeout(400)


def as_html(text: str) -> str:
    """Return the page as MkDocs writes it, as far as its script uses it."""
    return re.sub(
        r"^```python\n(.*?)^```$",
        lambda block: f'<div class="highlight"><pre><code>{html.escape(block[1])}</code></pre></div>',
        text,
        flags=re.MULTILINE | re.DOTALL,
    )


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with running_chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory, pyodide_files: Path) -> Iterator[str]:
    site = tmp_path_factory.mktemp("site")
    shutil.copytree(DOCS / "in-browser", site / "in-browser")
    shutil.copytree(pyodide_files, site / "in-browser" / "files", dirs_exist_ok=True)
    (site / "guides").mkdir()
    text = documents.as_on_site(
        documents.text_of("guides/tab.md"), documents.page("guides/tab.md"), "guides/tab.md"
    )
    (site / "guides/index.html").write_text(as_html(text))
    handler = functools.partial(_Quiet, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/guides/"
        server.shutdown()
        thread.join()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *args: object) -> None:
        pass


def test_the_page_runs_python_and_lists_a_bag(chromium: Browser, address: str, tmp_path: Path) -> None:
    page = chromium.new_page()
    requested: list[str] = []
    page.on("request", lambda request: requested.append(request.url))
    page.goto(address)
    blocks = page.locator(".in-browser")
    expect(blocks).to_have_count(4)

    run(page, 0)
    expect(blocks.nth(0).locator("pre")).to_contain_text(
        "9f195f881246fdfa2798d1d3eebca84a", timeout=STARTED_WITHIN_MS
    )
    blocks.nth(1).locator("textarea").fill("print(1 / 0)")
    run(page, 1)
    expect(blocks.nth(1).locator("pre")).to_contain_text("ZeroDivisionError: division by zero")

    with rosbag.Bag(tmp_path / "mine.bag", "w") as bag:
        bag.write("/mine", String("dropped"), rospy.Time(3))
    page.locator("#bag-file").set_input_files(tmp_path / "mine.bag")
    expect(blocks.nth(3).locator("pre")).to_contain_text('data: "dropped"')

    blocks.nth(1).locator("textarea").fill("print('turning')\nwhile True: pass")
    run(page, 1)
    expect(blocks.nth(1).locator("pre")).to_contain_text("turning")
    blocks.nth(1).get_by_role("button", name="Stop").click()
    expect(blocks.nth(1).get_by_role("button", name="Run")).to_be_enabled()
    assert all(url.startswith(address.removesuffix("guides/")) for url in requested)


def run(page: Page, number: int) -> None:
    page.locator(".in-browser").nth(number).get_by_role("button", name="Run").click()
