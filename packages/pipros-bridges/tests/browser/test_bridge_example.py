"""The page in examples/browser, from a local web server; as a file it is refused."""

import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
from playwright.sync_api import Browser, expect

from pipros.basics.env import Environment
from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.environments import REPOSITORY
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.rosbridge import rosbridge_server
from tests.support.waiting import wait_until

STRING: Any = load_message_class("std_msgs/String")


class QuietHandler(SimpleHTTPRequestHandler):
    """A web server for the files of this repository that logs nothing."""

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        del format, args


@pytest.fixture
def site() -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(QuietHandler, directory=str(REPOSITORY))) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_the_example_shows_and_publishes_messages(
    chromium: Browser, ros: RosSystem, site: str, caplog: pytest.LogCaptureFixture
) -> None:
    ros.serve_master()
    environment = Environment(master_uri=ros.master_uri)
    inbox = Inbox()
    with (
        Node("bridge", environment=environment, limits=process_limits()._replace(login_s=60.0)) as bridge,
        Node("robot", environment=environment) as robot,
        rosbridge_server(bridge) as url,
    ):
        robot.advertise("/chatter", STRING, latch=True).publish(STRING("from the robot"))
        received = robot.subscribe("/chatter", STRING, inbox)
        tab = chromium.new_page()
        tab.goto(f"file://{REPOSITORY}/examples/browser/index.html?bridge={url}")
        expect(tab.locator("#state")).to_have_text(f"no connection to {url}")
        assert "python -m http.server" in caplog.text
        assert "websocket_null_origin:=true" in caplog.text
        tab.goto(f"{site}/examples/browser/index.html?bridge={url}")
        expect(tab.locator("li")).to_have_text(["from the robot"])
        wait_until(lambda: received.connection_count == 2, 30, "the links from the robot and from the page")
        tab.locator("input").fill("from the page")
        tab.locator("button").click()
        expect(tab.locator("li").first).to_have_text("from the page")
        wait_until(lambda: inbox.messages[-1].data == "from the page", 30, "the message from the page")
        tab.close()
