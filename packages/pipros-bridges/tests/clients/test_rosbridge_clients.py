"""Real clients of rosbridge, with robots on pipros and genuine rospy: roslib 2, roslibpy 2 and 1.8."""

import functools
import http.server
import json
import shutil
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import sync_playwright

from tests.support.bridge_clients import ROSLIBPY, roslib, roslibpy_python
from tests.support.browser import find_chromium
from tests.support.network import steady_interfaces
from tests.support.ros import RosSystem

PROGRAMS = Path(__file__).parent / "programs"
NODE = shutil.which("node") or "node"

FROM_JAVASCRIPT = {
    "none": "kept", "png": "kept", "cbor": "kept", "cbor-raw": [4, 0, 0, 0, *b"kept"], "echo": "echo from js",
    "robot's": {"success": True, "message": "from robot"}, "own": {"success": True, "message": "from js"},
    "parameter": [1, {"a": 2.5}], "details": ["position", "orientation"], "definition": True,
    "actions": ["/count", "/tf2_web_republisher"],
}  # fmt: skip
FROM_PYTHON = {
    "none": "kept", "echo": "echo from py", "robot's": {"success": True, "message": "from robot"},
    "own": {"success": True, "message": "from py"}, "parameter": [1, {"a": 2.5}], "type": "std_msgs/String",
    "robot": ["/count/feedback", "/count/result"], "result": 42, "feedback": 1,
    "arm": {"x": 1.0, "y": 2.0, "z": 3.0},
}  # fmt: skip


@pytest.fixture(params=["pipros", "genuine"])
def port(request: pytest.FixtureRequest, ros: RosSystem) -> int:
    """The port of a bridge, with a robot of one implementation."""
    ros.serve_master()
    side = getattr(ros, request.param)
    python = "/usr/bin/python3" if side.is_genuine else sys.executable
    side.start(python, PROGRAMS / "robot.py")
    launched = ros.pipros.start("roslaunch", "rosbridge_server", "rosbridge_websocket.launch", "port:=0")
    found = int(launched.wait_for(r"Rosbridge WebSocket server started on port (\d+)", 60)[1])
    ros.pipros.start("rosrun", "tf2_web_republisher", "tf2_web_republisher")
    for topic in ("/latched", "/count/status", "/tf_static", "/tf2_web_republisher/status"):
        ros.wait_for_publisher(topic, 60)
    return found


@pytest.mark.parametrize("version", ROSLIBPY)
def test_roslibpy_has_topics_services_parameters_and_actions(version: str, ros: RosSystem, port: int) -> None:
    python = roslibpy_python(version)
    ended = ros.pipros.run(python, PROGRAMS / "client.py", str(port), timeout_s=120)
    assert ended.returncode == 0, ended.output
    assert json.loads(ended.stdout[-1]) == FROM_PYTHON


def test_roslib_in_node_has_every_encoding_services_and_parameters(ros: RosSystem, port: int) -> None:
    address = f"ws://127.0.0.1:{port}"
    ended = ros.pipros.run(NODE, PROGRAMS / "client_in_node.mjs", roslib(), address, timeout_s=120)
    assert ended.returncode == 0, ended.output
    assert json.loads(ended.stdout[-1]) == FROM_JAVASCRIPT


class Pages(http.server.SimpleHTTPRequestHandler):
    """Serves the packages of npm and the client's module."""

    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".mjs": "text/javascript"}  # noqa: RUF012

    def log_message(self, *_: Any) -> None:
        pass

    def translate_path(self, path: str) -> str:
        if path == "/client.mjs":
            return str(PROGRAMS / "client.mjs")
        return super().translate_path(path)

    def do_GET(self) -> None:
        if self.path != "/":
            super().do_GET()
            return
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(PAGE.encode())


IMPORTS = {
    "@cto.af/wtf8": "/@cto.af/wtf8/lib/index.js", "bson": "/bson/lib/bson.mjs",
    "cbor2": "/cbor2/lib/index.js", "eventemitter3": "/eventemitter3/dist/eventemitter3.esm.js",
    "fast-png": "/fast-png/lib/index.js", "fflate": "/fflate/esm/browser.js",
    "iobuffer": "/iobuffer/lib/iobuffer.js", "roslib": "/roslib/dist/RosLib.js",
    "uuid": "/uuid/dist/index.js",
}  # fmt: skip
PAGE = f"""<!doctype html>
<script type="importmap">{json.dumps({"imports": IMPORTS})}</script>
<script type="module">
import * as roslib from "roslib";
import {{ ask }} from "/client.mjs";
window.ask = (url) => ask(roslib, url);
</script>"""


@pytest.fixture
def page_url() -> Iterator[str]:
    handler = functools.partial(Pages, directory=str(roslib().parents[2]))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def test_roslib_in_chromium_has_every_encoding_services_and_parameters(page_url: str, port: int) -> None:
    with steady_interfaces(), sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=find_chromium(), args=["--no-sandbox"], timeout=90_000
        )
        tab = browser.new_page()
        tab.goto(page_url, timeout=90_000)
        tab.wait_for_function("window.ask !== undefined", timeout=90_000)
        found = tab.evaluate("url => window.ask(url)", f"ws://127.0.0.1:{port}")
        browser.close()
    assert found == FROM_JAVASCRIPT
