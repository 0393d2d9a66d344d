"""Access to the page in a browser: the printed address, reloads, further tabs, wrong tokens."""

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from playwright.sync_api import Browser, expect
from playwright.sync_api import Page as Tab

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LOCKED = "This page needs the token of its server"


class Neighbour(ThreadingHTTPServer):
    """Another server on the same host, which records all requests of browsers."""

    def __init__(self) -> None:
        received: list[str] = []

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                received.append(f"{self.requestline}\n{self.headers}")
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.end_headers()
                self.wfile.write(b"<title>neighbour</title>")

            def log_message(self, *_: object) -> None:
                pass

        super().__init__(("127.0.0.1", 0), Handler)
        self.received = received
        self.url = f"http://localhost:{self.server_address[1]}/"


@pytest.fixture
def neighbour() -> Iterator[Neighbour]:
    with Neighbour() as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def page(ros: RosSystem) -> Page:
    ros.pipros.start_master()
    return Page(ros)


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Tab]:
    """A tab of a new window, which knows no token."""
    context = chromium.new_context()
    yield context.new_page()
    context.close()


def expect_open(tab: Tab) -> None:
    expect(tab.locator("#system")).to_contain_text("read-only")
    expect(tab.locator("#locked")).to_be_hidden()


def test_the_token_leaves_the_address_and_a_reload_works(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "topics")
    expect_open(tab)
    assert tab.url == f"http://{page.host}/#topics"
    tab.reload()
    expect_open(tab)
    expect(tab.locator("#tab-topics")).to_have_attribute("aria-selected", "true")
    assert page.token not in tab.evaluate(
        "document.cookie + JSON.stringify(localStorage) + document.documentElement.outerHTML"
    )


def test_a_reload_before_the_server_has_answered_keeps_the_token(page: Page, tab: Tab) -> None:
    opened = []
    tab.route_web_socket("**/live", lambda socket: opened.append(socket))  # a server that does not answer
    tab.goto(page.url_of("topics"))
    wait_until(lambda: opened or tab.wait_for_timeout(10))
    assert tab.url == f"http://{page.host}/#topics"
    tab.route_web_socket("**/live", lambda socket: socket.connect_to_server())
    tab.reload()
    expect_open(tab)
    assert tab.evaluate("Object.keys(sessionStorage)") == ["pipros.token"]


def test_a_second_tab_opens_with_the_printed_address(page: Page, open_tab: OpenTab) -> None:
    first = open_tab(page, "graph")
    expect_open(first)
    second = first.context.new_page()
    second.goto(page.url)
    expect_open(second)
    expect_open(first)


@pytest.mark.parametrize("fragment", ["", "#graph", "#token=wrong/graph", "#code=wrong/graph"])
def test_without_the_right_token_the_page_says_how_to_get_one(page: Page, tab: Tab, fragment: str) -> None:
    tab.goto(f"http://{page.host}/{fragment}")
    expect(tab.locator("#locked")).to_contain_text(LOCKED)
    expect(tab.locator("#system")).to_have_text("no access")
    keep_screenshots(tab, "locked")
    tab.goto(page.url_of("topics"))  # only the fragment differs: the page is not loaded again
    expect_open(tab)
    expect(tab.locator("#tab-topics")).to_have_attribute("aria-selected", "true")


def test_a_shared_address_opens_with_the_token(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph")
    expect_open(tab)  # a login that succeeds later would store the token again
    tab.evaluate("sessionStorage.clear()")
    tab.goto("about:blank")
    tab.goto(f"http://{page.host}/#console/")
    tab.get_by_label("Token or printed address").fill(page.url)
    tab.get_by_role("button", name="Open").click()
    expect_open(tab)
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Console")


def test_a_restarted_server_has_another_token(ros: RosSystem, page: Page, tab: Tab) -> None:
    tab.goto(page.url)
    expect_open(tab)
    page.process.press_ctrl_c()
    page.process.wait()
    expect(tab.locator("#system")).to_contain_text("no connection to the server, trying again")
    again = Page(ros, "--bind", page.host.replace("localhost", "127.0.0.1"))
    expect(tab.locator("#locked")).to_contain_text("The server was restarted")
    tab.goto(again.url)
    expect_open(tab)


def test_an_address_with_a_token_from_a_file_outlives_the_server(ros: RosSystem, tab: Tab, tmp_path) -> None:
    ros.serve_master()
    file = tmp_path / "tokens"
    file.touch(mode=0o600)
    file.write_text("a.token~of-this_robot\n")
    page = Page(ros, "--token-file", file)
    assert page.token == file.read_text().strip()
    tab.goto(page.url)
    expect_open(tab)
    page.process.press_ctrl_c()
    page.process.wait()
    Page(ros, "--token-file", file, "--bind", page.host.replace("localhost", "127.0.0.1"))
    expect_open(tab)
    tab.goto(page.url_of("console"))  # as a bookmark
    expect(tab.get_by_role("tab", selected=True)).to_have_text("Console")
    expect_open(tab)


def test_another_server_on_the_host_gets_no_secret(page: Page, neighbour: Neighbour, open_tab) -> None:
    # The tabs are closed before the neighbour, so that no request for its icon fails.
    tab = open_tab(page, "graph")
    expect_open(tab)
    other = tab.context.new_page()
    other.goto(neighbour.url)
    assert other.title() == "neighbour"
    assert other.evaluate("sessionStorage.length + localStorage.length + document.cookie.length") == 0
    tab.goto(neighbour.url)  # the same tab, with a referrer if there is one
    assert tab.title() == "neighbour"
    assert neighbour.received
    for request in neighbour.received:
        assert "cookie" not in request.lower()
        assert page.token not in request
    assert tab.context.cookies() == []


def test_the_browser_that_a_command_opens_gets_a_code_that_works_once(ros, chromium, tmp_path) -> None:
    opened = tmp_path / "opened.html"
    command = tmp_path / "note-address"
    command.write_text(f'#!/bin/sh\ncp "${{1#file://}}" {opened}.part\nmv {opened}.part {opened}\n')
    command.chmod(0o700)
    ros.pipros.start_master()
    ros.pipros.environment.update(BROWSER=str(command), DISPLAY=":0")
    process = ros.pipros.start("rqt_graph")
    token = process.wait_for(r"#token=([\w-]+)/")[1]
    wait_until(opened.exists, 30, "the page that the browser got")
    assert token not in opened.read_text()
    url = opened.as_uri()
    context = chromium.new_context()
    tab = context.new_page()
    tab.goto(url)
    expect_open(tab)
    tab.reload()
    expect_open(tab)
    context.close()
    context = chromium.new_context()
    tab = context.new_page()
    tab.goto(url)
    expect(tab.locator("#locked")).to_contain_text(LOCKED)
    context.close()
