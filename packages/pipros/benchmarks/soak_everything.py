"""All parts of pipros in one system, for a long run.

Started by `script/bench soak --everything`. In addition to `soak_system.py`, it has the Scene tab and four
panels in Chromium, a rosbridge and a Foxglove client that reconnect every 20 s, a fleet of two masters, the
ROS 2 gateway with two peers, the simulations of a robot and of turtlesim, another simulated robot that amcl
and move_base drive to goals, a chain of nodelets, and assistants that use `pipros mcp`.
"""

from __future__ import annotations

import functools
import os
import re
import secrets
import subprocess
import sys
from collections import Counter
from collections.abc import Coroutine
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from soak_clients import FOXGLOVE, PANELS, assist, reconnect, use_foxglove, use_rosbridge, view_pages
from soak_programs import FLEET_FILE, MORE_NODES, NAVIGATION, NAVIGATOR, NODELETS, OPERATOR, SCENE
from soak_resources import Browser, Heap, Process
from soak_system import FAILURES, System, free_port

from tests.support.ros2_domains import free_domain

ROOT = Path(__file__).resolve().parents[3]

PEER = ROOT / "plugins" / "pipros-ros2" / "tests" / "support" / "dds" / "rtps_peer.py"
BLOB, TYPE = "uint32 number\nuint8[] data\n", "example_interfaces::msg::dds_::Blob_"
CLIENTS_SLACK_MB = 30.0
CURVE_MB = 1.4
"""A curve keeps up to 60,000 samples of 16 bytes (`plot/curve.js`); arrays reserve half as much again."""


class Everything(System):
    """The system of `soak_system.py`, and everything else."""

    counting = (*System.counting, "driver", "operator", "navigator")
    # Lower rates, because all parts together should use 70 % of two processors at most.
    rate_hz = 20
    lives_s = (6.0, 10.0)

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._domain = ExitStack()
        self._token = secrets.token_urlsafe(32)
        self.heaps = Heap(), Heap(history_mb=CURVE_MB)
        package = folder / "example_interfaces"
        (package / "msg").mkdir(parents=True)
        (package / "package.xml").write_text("<package><name>example_interfaces</name></package>")
        (package / "msg" / "Blob.msg").write_text(BLOB)

    def open(self) -> None:
        super().open()
        self.start("pipros_sim", "rosrun", "pipros_sim", "sim", "_headless:=true")
        self.start("turtlesim", "rosrun", "turtlesim", "turtlesim_node", "_headless:=true")
        self._open_bridges()
        self._open_fleet()
        self._open_ros2()
        self._open_navigation()
        self._open_assistants()
        for name, script in MORE_NODES.items():
            self.start(name, sys.executable, "-c", script)
        self._open_launch("nodelets", NODELETS, self.port, "camera/camera_manager")
        (self.folder / "scene.rviz").write_text(SCENE)
        options = ("--no-browser", "--disable-anti-aliasing", "-d", str(self.folder / "scene.rviz"))
        self.start("rviz", "rviz", *options)
        self.scene_url = self.wait_for("rviz", r"http://\S+")
        self.held["Chromium"] = Browser()
        self.held["heap of the scene"], self.held["heap of the panels"] = self.heaps
        # This process, which also keeps the samples; Playwright is not measured here.
        self.held["the clients"] = Process(pid=os.getpid(), slack_mb=CLIENTS_SLACK_MB)

    def _open_bridges(self) -> None:
        ports = [str(free_port()) for _ in range(2)]
        self.bridges = [f"ws://127.0.0.1:{port}" for port in ports]
        self.start("rosbridge", "rosrun", "rosbridge_server", "rosbridge_websocket", f"_port:={ports[0]}")
        self.start("foxglove", "pipros", "foxglove", "--port", ports[1])
        self.wait_for("rosbridge", "started on port")
        self.wait_for("foxglove", "ws://")

    def _open_fleet(self) -> None:
        port, router = str(free_port()), f"tcp/127.0.0.1:{free_port()}"
        (self.folder / "fleet.yaml").write_text(FLEET_FILE)
        self.start("second master", "rosmaster", "--core", "-p", port)
        self.start("fleet router", "pipros", "fleet", "router", router)
        file = ("--file", str(self.folder / "fleet.yaml"))
        second = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
        self.start("fleet robot", "pipros", "fleet", "join", "robot", "--router", router, *file)
        self.start("fleet operator", "pipros", "fleet", "join", "operator", "--router", router, **second)
        self.start("operator", sys.executable, "-c", OPERATOR, **second)

    def _open_ros2(self) -> None:
        domain = str(self._domain.enter_context(free_domain()))
        options = ("--domain", domain, "--distro", "humble", "--msgs", str(self.folder))
        self.start("ros2 gateway", "pipros", "ros2", *options)
        for name, mode, topic, *rest in (
            ("ros2 listener", "sub", "rt/blob", "reliable"),
            ("ros2 talker", "pub", "rt/back", str(10**9), "100", "100000", "reliable"),
        ):
            command = [sys.executable, str(PEER), domain, "LOCALHOST", mode, topic, TYPE, *rest]
            self.start(name, *command, stdin=subprocess.PIPE)

    def _open_navigation(self) -> None:
        """Start a separate robot, because navigation needs simulated time."""
        port = free_port()
        uri = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
        packages = f"{self.folder}:{ROOT / 'examples' / 'turtlebot3'}"
        parts = ("sim", "robot_state_publisher", "map_server", "amcl", "move_base")
        self._open_launch("navigation", NAVIGATION, port, *parts, ROS_PACKAGE_PATH=packages)
        self.start("navigator", sys.executable, "-c", NAVIGATOR, **uri)

    def _open_launch(self, name: str, text: str, port: int, *nodes: str, **environment: str) -> None:
        """Start a launch file, and measure the nodes named `nodes`."""
        file = self.folder / f"{name}.launch"
        file.write_text(text)
        self.start(name, "roslaunch", "-p", str(port), str(file), **environment)
        for node in nodes:
            started = self.wait_for(name, rf"process\[{node}-\d+\]: started with pid \[\d+")
            self.held[node] = Process(pid=int(re.split(r"\[", started)[-1]))

    def _open_assistants(self) -> None:
        token = self.folder / "tokens"
        token.touch(0o600)
        token.write_text(self._token)
        self.start("mcp", "pipros", "mcp", "--http", "0", "--token-file", str(token))
        self.mcp_url = self.wait_for("mcp", r"http://\S+/mcp")

    def clients(self) -> list[Coroutine[Any, Any, None]]:
        rosbridge, foxglove = (
            functools.partial(use, counts=self.counts) for use in (use_rosbridge, use_foxglove)
        )
        panels_url = f"{self.url.rpartition('/')[0]}/{PANELS}"
        return [
            *super().clients(),
            reconnect("rosbridge", self.counts, self.bridges[0], rosbridge),
            reconnect("foxglove", self.counts, self.bridges[1], foxglove, subprotocols=[FOXGLOVE]),
            assist(self.mcp_url, self._token, self.counts),
            view_pages(self.scene_url, panels_url, self.counts, self.heaps),
        ]

    def done(self) -> Counter[str]:
        done = super().done()
        lines = self.output("ros2 listener").read_text()
        done["heard in ROS 2"] = lines.count("got ")
        done[FAILURES] += lines.count("wrong ")
        return done

    def close(self) -> list[str]:
        unclean = super().close()
        self._domain.close()
        return unclean
