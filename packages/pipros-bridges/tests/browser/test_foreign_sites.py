"""A web site in the same browser cannot control a robot through rosbridge."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
from playwright.sync_api import Browser

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_bridges.rosbridge.server import ServerOptions, WebSocketServer
from pipros_bridges.rosbridge.stream_servers import TcpServer
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

STRING: Any = load_message_class("std_msgs/String")
OPERATIONS = [
    {"op": "advertise", "topic": "/cmd_vel", "type": "std_msgs/String"},
    {"op": "publish", "topic": "/cmd_vel", "msg": {"data": "drive"}},
]
BODY = "".join(map(json.dumps, OPERATIONS))


def post(port: int) -> str:
    """Return a page that sends an HTTP request and then has the title `done`."""
    return f"""<script>
      fetch('http://127.0.0.1:{port}/', {{method: 'POST', mode: 'no-cors', body: {json.dumps(BODY)}}})
        .catch(() => 0).then(() => document.title = 'done');
    </script>"""


def frame(port: int) -> str:
    """Return a page that opens a WebSocket from a frame without origin and then has the title `done`."""
    script = f"""<script>
      const socket = new WebSocket('ws://127.0.0.1:{port}/');
      socket.onopen = () => {json.dumps(OPERATIONS)}.forEach((each) => socket.send(JSON.stringify(each)));
      socket.onerror = socket.onopen;
      socket.onclose = () => parent.postMessage('done', '*');
    </script>"""
    script = script.replace("&", "&amp;").replace('"', "&quot;")
    return f"""<script>onmessage = () => document.title = 'done'</script>
      <iframe sandbox="allow-scripts" srcdoc="{script}"></iframe>"""


@pytest.fixture
def site_with() -> Iterator[Callable[[str], str]]:
    """Return the address of a site with a page. Chromium lets no public site reach this machine in a test."""
    with ExitStack() as ends:

        def serve(page: str) -> str:
            class Handler(BaseHTTPRequestHandler):
                def do_GET(self) -> None:
                    self.send_response(200)
                    self.send_header("Content-Type", "text/html")
                    self.end_headers()
                    self.wfile.write(page.encode())

                def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
                    del format, args

            server = ends.enter_context(ThreadingHTTPServer(("127.0.0.1", 0), Handler))
            ends.callback(server.shutdown)
            threading.Thread(target=server.serve_forever).start()
            return f"http://127.0.0.1:{server.server_port}/"

        yield serve


@pytest.mark.parametrize(("server_class", "page"), [(TcpServer, post), (WebSocketServer, frame)])
def test_a_site_cannot_publish(
    chromium: Browser,
    ros: RosSystem,
    server_class: Any,
    page: Callable[[int], str],
    caplog: pytest.LogCaptureFixture,
    site_with: Callable[[str], str],
) -> None:
    ros.serve_master()
    environment = Environment(master_uri=ros.master_uri)
    with Node("bridge", environment=environment) as bridge, Node("robot", environment=environment) as robot:
        received = Inbox()
        robot.subscribe("/cmd_vel", STRING, received)
        server = server_class(bridge, ServerOptions(port=0))
        port = server.start()

        tab = chromium.new_page()
        try:
            tab.goto(site_with(page(port)))
            tab.wait_for_function("document.title === 'done'")
            wait_until(lambda: "refused" in caplog.text or "disconnected" in caplog.text, 30)
            assert received.messages == []
            publishers, _, _ = robot.master.get_system_state()
            assert "/cmd_vel" not in [topic for topic, _ in publishers]
        finally:
            tab.close()
            server.close()
