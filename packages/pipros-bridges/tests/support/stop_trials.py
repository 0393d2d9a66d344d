"""Trials of the guardian: how long a robot that holds its last command drives on after each accident.

`python -m tests.support.stop_trials [--trials 100] [--only client,server,…] [--without-guardian]` prints the
median, the 99th percentile and the maximum, and exits with 1 if a robot was not stopped. The times begin with
the accident; if a server hangs, a client is silent or a link is cut, they include the limit of 0.5 s. Without
a guardian (no time limit in the policy), robots drive on. `script/long stop` runs both.
`tests.graph.test_stop_guardian` has further accidents: closed pages, clocks that jump, assistants that end.
"""

import argparse
import contextlib
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
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.waiting import wait_until

LONGEST_S: Final = 10.0
PIPROS: Final = Path(sys.executable).with_name("pipros")
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
POLICY: Final = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-0.3, 0.3], unit: m/s}}
"""


class Robot:
    """A robot that holds its last command, and notes when it was stopped."""

    def __init__(self, master_uri: str) -> None:
        self.stopped = threading.Event()
        self.driven_s = self.stopped_s = 0.0
        self.node = Node("robot", environment=Environment(master_uri=master_uri), log=LOG)
        self.node.start()
        self.node.subscribe("/cmd_vel", load_message_class("geometry_msgs/Twist"), self._drive)

    def _drive(self, message: Any) -> None:
        if message.linear.x:
            self.stopped.clear()
            self.driven_s = time.monotonic()
        elif not self.stopped.is_set():
            self.stopped_s = time.monotonic()
            self.stopped.set()


class Link:
    """A relay to a server, which passes nothing on once it is cut, not even the end of a connection."""

    def __init__(self, port: int) -> None:
        self._port, self._cut = port, threading.Event()
        self._open = contextlib.ExitStack()
        self._listening = self._open.enter_context(socket.create_server(("127.0.0.1", 0)))
        self.url = f"ws://127.0.0.1:{self._listening.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        self._cut.set()

    def close(self) -> None:
        self._open.close()

    def _accept(self) -> None:
        near = self._open.enter_context(self._listening.accept()[0])
        far = self._open.enter_context(socket.create_connection(("localhost", self._port)))
        for pair in ((near, far), (far, near)):
            threading.Thread(target=self._relay, args=pair, daemon=True).start()

    def _relay(self, source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                if not self._cut.is_set():
                    target.sendall(data)
            if not self._cut.is_set():
                target.shutdown(socket.SHUT_RDWR)


Process = subprocess.Popen[bytes]
ACCIDENTS: Final[dict[str, Callable[[Process, Process, Link], object]]] = {
    "client": lambda server, client, link: client.kill(),
    "server": lambda server, client, link: server.kill(),
    "hung": lambda server, client, link: server.send_signal(signal.SIGSTOP),
    "silent": lambda server, client, link: client.send_signal(signal.SIGSTOP),
    "cut": lambda server, client, link: link.cut(),
}


@contextlib.contextmanager
def running(*command: str | Path, log: Path, master_uri: str) -> Iterator[Process]:
    environment = {**os.environ, "ROS_MASTER_URI": master_uri}
    with (
        log.open("w") as file,
        subprocess.Popen([sys.executable, *command], env=environment, stderr=file) as process,
    ):
        try:
            yield process
        finally:
            process.kill()


def trial(name: str, robot: Robot, policy: Path, longest_s: float) -> float | None:
    """Return the time (s) from an accident to the stop; None for a robot that drove on."""
    log, uri = policy.with_name("log"), robot.node.environment.master_uri
    serve = (PIPROS, "serve", "--port", "0", "--control", "--policy", policy)
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(running(*serve, log=log, master_uri=uri))
        found = wait_until(lambda: re.search(r"ws://[^:]+:(\d+)", log.read_text()))
        assert found is not None
        link = Link(int(found[1]))
        stack.callback(link.close)
        robot.driven_s = 0.0
        command = ("-c", CLIENT, link.url)
        client = stack.enter_context(running(*command, log=log.with_name("client"), master_uri=uri))
        wait_until(lambda: robot.driven_s)
        happened_s = time.monotonic()
        ACCIDENTS[name](server, client, link)
        has_stopped = robot.stopped.wait(longest_s)
        return robot.stopped_s - happened_s if has_stopped else None


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
        policy.write_text(POLICY + ("" if options.without_guardian else "    time_limit_s: 0.5\n"))
        robot = Robot(master.uri)
        longest_s = 3.0 if options.without_guardian else LONGEST_S
        for name in options.only.split(","):
            found = [trial(name, robot, policy, longest_s) for _ in range(options.trials)]
            times = sorted(each for each in found if each is not None)
            failed += len(found) - len(times)
            text = f"{name:10} {len(times)} of {len(found)} stopped"
            if times:
                p99 = times[-(-len(times) * 99 // 100) - 1]
                text += (
                    f", median {statistics.median(times):.3f} s, p99 {p99:.3f} s, longest {times[-1]:.3f} s"
                )
            print(text, flush=True)
        robot.node.shutdown()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
