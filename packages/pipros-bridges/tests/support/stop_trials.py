"""Trials of the guardian: how long a robot that holds its last command drives on after each accident.

`python -m tests.support.stop_trials [--trials 100] [--only client,server,…] [--without-guardian]` prints the
median, the 99th percentile and the maximum, and exits with 1 if a robot was not stopped. The times begin with
the accident; if a server hangs, a client is silent, a link is cut or the clock jumps, they include the limit
of 0.5 s. Without a guardian (no time limit in the policy), robots drive on. `script/long stop` runs both.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import os
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import psutil  # type: ignore[import-untyped]
from websockets.sync.client import connect
from websockets.typing import Origin

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_server.approvals import answer_act, waiting_acts
from tests.support.rosbridge import RosbridgeClient
from tests.support.waiting import wait_until

LONGEST_S: Final = 10.0
LOG: Final = logging.Logger("robot", logging.CRITICAL)
CLIENT: Final = """
import sys, time
from tests.support.rosbridge import RosbridgeClient
with RosbridgeClient(sys.argv[1]) as client:
    client.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist")
    while True:
        client.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.2}})
        time.sleep(0.05)
"""
ASSISTANT: Final = """
import asyncio, os, sys
from mcp import Client, StdioServerParameters
arguments = {"topic": "/cmd_vel", "message": {"linear": {"x": 0.2}}, "seconds": 10, "rate_hz": 20}
async def main():
    command = {"command": sys.argv[1], "args": ["mcp", "--policy", sys.argv[2]], "env": dict(os.environ)}
    async with Client(StdioServerParameters(**command)) as client:
        while True:
            await client.call_tool("publish", arguments)
asyncio.run(main())
"""
JUMP: Final = """
import signal, sys, time
now, now_ns, hours = time.time, time.time_ns, 0
def jump(*_):
    global hours
    hours += 1
signal.signal(signal.SIGUSR1, jump)
time.time = lambda: now() + 3600 * hours
time.time_ns = lambda: now_ns() + hours * 3600 * 10**9
from pipros_tools.cli.pipros import main
sys.exit(main(sys.argv[1:]))
"""


class Robot:
    """A robot that holds its last command, and notes when it was stopped."""

    def __init__(self, master_uri: str) -> None:
        self.stopped = threading.Event()
        self.driven_s = 0.0
        self.stopped_s = 0.0
        self._node = Node("robot", environment=Environment(master_uri=master_uri), log=LOG)
        self._node.start()
        self._node.subscribe("/cmd_vel", load_message_class("geometry_msgs/Twist"), self._drive)

    def _drive(self, message: Any) -> None:
        if message.linear.x:
            self.stopped.clear()
            self.driven_s = time.monotonic()
        elif not self.stopped.is_set():
            self.stopped_s = time.monotonic()
            self.stopped.set()

    def close(self) -> None:
        self._node.shutdown()


class Serving:
    """A server with the policy, for one accident or for all trials of those that it survives.

    Attributes:
        url: for clients of rosbridge.
        page: URL of the page, with its token.
    """

    def __init__(self, master_uri: str, policy: Path) -> None:
        self.environment = {**os.environ, "ROS_MASTER_URI": master_uri}
        self.policy = policy
        self.server = subprocess.Popen(
            [sys.executable, "-c", JUMP, "serve", "--port", "0", "--control", "--policy", policy],
            env=self.environment,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.server.stderr is not None
        text = ""
        while not ("ws://" in text and "#token=" in text):
            text += self.server.stderr.readline()
        self.url = re.findall(r"ws://[^\s,]+", text)[0]
        self.page = re.findall(r"http://\S+#token=[^\s/]+", text)[0]
        threading.Thread(target=self.server.stderr.read, daemon=True).start()

    def close(self) -> None:
        self.server.kill()
        self.server.wait()


@contextlib.contextmanager
def driving_client(serving: Serving) -> Iterator[subprocess.Popen[bytes]]:
    """Run a client that drives the robot."""
    client = subprocess.Popen(
        [sys.executable, "-c", CLIENT, serving.url], env=serving.environment, stderr=subprocess.DEVNULL
    )
    try:
        yield client
    finally:
        client.kill()
        client.wait()


@contextlib.contextmanager
def driving_thread(url: str) -> Iterator[threading.Event]:
    """Drive the robot from this process, until the event is set. The connection stays open."""
    silent = threading.Event()

    def drive() -> None:
        with contextlib.suppress(Exception), RosbridgeClient(url) as client:
            client.send("advertise", topic="/cmd_vel", type="geometry_msgs/Twist")
            while not silent.wait(0.05):
                client.send("publish", topic="/cmd_vel", msg={"linear": {"x": 0.2}})
            over.wait()

    over = threading.Event()
    thread = threading.Thread(target=drive, daemon=True)
    thread.start()
    try:
        yield silent
    finally:
        silent.set()
        over.set()
        thread.join(LONGEST_S)


Accident = Callable[[Serving, "Robot"], "contextlib.AbstractContextManager[float]"]
"""Lets a robot drive. The value of the context manager is the time of the accident; its exit cleans up."""


@contextlib.contextmanager
def client_killed(serving: Serving, robot: Robot) -> Iterator[float]:
    with driving_client(serving) as client:
        wait_until(lambda: robot.driven_s)
        client.kill()
        yield time.monotonic()


@contextlib.contextmanager
def client_silent(serving: Serving, robot: Robot) -> Iterator[float]:
    with driving_client(serving) as client:
        wait_until(lambda: robot.driven_s)
        client.send_signal(signal.SIGSTOP)
        yield time.monotonic()


@contextlib.contextmanager
def server_killed(serving: Serving, robot: Robot) -> Iterator[float]:
    with driving_client(serving):
        wait_until(lambda: robot.driven_s)
        serving.server.kill()
        yield time.monotonic()


@contextlib.contextmanager
def server_hung(serving: Serving, robot: Robot) -> Iterator[float]:
    with driving_client(serving):
        wait_until(lambda: robot.driven_s)
        serving.server.send_signal(signal.SIGSTOP)
        yield time.monotonic()
        serving.server.send_signal(signal.SIGCONT)


@contextlib.contextmanager
def link_cut(serving: Serving, robot: Robot) -> Iterator[float]:
    """Drive through a relay, which then passes nothing on, without closing a connection."""
    host, port = serving.url.removeprefix("ws://").rstrip("/").split(":")
    cut = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening, contextlib.ExitStack() as stack:

        def relay(source: socket.socket, target: socket.socket) -> None:
            with contextlib.suppress(OSError):
                while data := source.recv(65536):
                    if not cut.is_set():
                        target.sendall(data)

        def accept() -> None:
            near = stack.enter_context(listening.accept()[0])
            far = stack.enter_context(socket.create_connection((host, int(port))))
            for pair in ((near, far), (far, near)):
                threading.Thread(target=relay, args=pair, daemon=True).start()

        threading.Thread(target=accept, daemon=True).start()
        with driving_thread(f"ws://127.0.0.1:{listening.getsockname()[1]}"):
            wait_until(lambda: robot.driven_s)
            cut.set()
            yield time.monotonic()


@contextlib.contextmanager
def clock_jumped(serving: Serving, robot: Robot) -> Iterator[float]:
    """Let the server's clock jump by an hour while the robot drives, and then be silent."""
    with driving_thread(serving.url) as silent:
        wait_until(lambda: robot.driven_s)
        serving.server.send_signal(signal.SIGUSR1)
        silent.set()
        yield time.monotonic()


@contextlib.contextmanager
def page_closed(serving: Serving, robot: Robot) -> Iterator[float]:
    host, _, token = serving.page.removeprefix("http://").partition("/#token=")
    with connect(f"ws://{host}/live", origin=Origin(f"http://{host}"), proxy=None) as page:
        page.send(json.dumps({"token": token}))
        drive = {"name": "/cmd_vel", "type": "geometry_msgs/Twist", "message": "linear: {x: 0.2}", "rate": 20}
        page.send(json.dumps({"id": 1, "view": "publishing", "args": drive}))
        wait_until(lambda: robot.driven_s)
        page.socket.shutdown(socket.SHUT_RDWR)
        yield time.monotonic()


@contextlib.contextmanager
def assistant(serving: Serving) -> Iterator[tuple[psutil.Process, psutil.Process]]:
    """Run a client of `pipros mcp` that drives with approval. Yield its process and that of its server."""
    over = threading.Event()

    def approve() -> None:
        while not over.wait(0.02):
            for program in waiting_acts():
                for act in program["waiting"]:
                    with contextlib.suppress(PiprosError):
                        answer_act(program["process"], act["id"], "minute")

    thread = threading.Thread(target=approve, daemon=True)
    thread.start()
    pipros = str(Path(sys.executable).with_name("pipros"))
    client: Any = psutil.Popen(
        [sys.executable, "-c", ASSISTANT, pipros, str(serving.policy)],
        env=serving.environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    server: list[psutil.Process] = []

    def has_server() -> bool:
        server[:] = [each for each in client.children() if "mcp" in each.cmdline()]
        return bool(server)

    try:
        wait_until(has_server)
        yield client, server[0]
    finally:
        over.set()
        client.kill()
        client.wait()
        with contextlib.suppress(psutil.NoSuchProcess):
            server[0].wait(LONGEST_S)
        thread.join()


@contextlib.contextmanager
def assistant_killed(serving: Serving, robot: Robot) -> Iterator[float]:
    with assistant(serving) as (client, _):
        wait_until(lambda: robot.driven_s)
        client.kill()
        yield time.monotonic()


@contextlib.contextmanager
def assistants_server_killed(serving: Serving, robot: Robot) -> Iterator[float]:
    with assistant(serving) as (_, server):
        wait_until(lambda: robot.driven_s)
        server.kill()
        yield time.monotonic()


ACCIDENTS: Final[Mapping[str, Accident]] = {
    "client": client_killed,
    "server": server_killed,
    "hung": server_hung,
    "silent": client_silent,
    "cut": link_cut,
    "clock": clock_jumped,
    "page": page_closed,
    "assistant": assistant_killed,
    "its-server": assistants_server_killed,
}
ENDING: Final = ("server",)
"""Accidents that a server does not survive."""


LIMIT_S: Final = 0.5
POLICY: Final = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-0.3, 0.3], unit: m/s}}
"""


class Trials:
    """The trials with one policy."""

    def __init__(self, robot: Robot, policy: Path, master_uri: str) -> None:
        self._robot = robot
        self._policy = policy
        self._master_uri = master_uri

    def run(self, name: str, count: int, longest_s: float) -> list[float | None]:
        """Return the times (s) from an accident to the stop; None for a robot that drove on."""
        serving: Serving | None = None
        found: list[float | None] = []
        try:
            for _ in range(count):
                serving = serving or Serving(self._master_uri, self._policy)
                self._robot.driven_s = 0.0
                with ACCIDENTS[name](serving, self._robot) as happened_s:
                    has_stopped = self._robot.stopped.wait(longest_s)
                    found.append(self._robot.stopped_s - happened_s if has_stopped else None)
                if name in ENDING:
                    serving.close()
                    serving = None
        finally:
            if serving is not None:
                serving.close()
        return found


def main() -> int:
    """Run the trials, and return the exit code."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--only", default=",".join(ACCIDENTS))
    parser.add_argument("--without-guardian", action="store_true")
    options = parser.parse_args()
    failed = 0
    with Master(port=0) as master, tempfile.TemporaryDirectory() as folder:
        os.environ["ROS_HOME"] = folder
        policy = Path(folder) / "policy.yaml"
        policy.write_text(POLICY + ("" if options.without_guardian else f"    time_limit_s: {LIMIT_S}\n"))
        robot = Robot(master.uri)
        trials = Trials(robot, policy, master.uri)
        for name in options.only.split(","):
            found = trials.run(name, options.trials, 3.0 if options.without_guardian else LONGEST_S)
            times = sorted(each for each in found if each is not None)
            failed += len(found) - len(times)
            text = f"{name:10} {len(times)} of {len(found)} stopped"
            if times:
                p99 = times[max(0, -(-len(times) * 99 // 100) - 1)]
                text += (
                    f", median {statistics.median(times):.3f} s, p99 {p99:.3f} s, longest {times[-1]:.3f} s"
                )
            print(text, flush=True)
        robot.close()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
