"""Trials of the guardian: how long a robot that holds its last command drives on after each accident.

`python -m tests.support.stop_trials [--trials 100] [--only client,server,hung,silent] [--without-guardian]`
prints the median, the 99th percentile and the maximum, and exits with 1 if a robot was not stopped. The times
begin with the accident; for a server that hangs and a client that is silent, they include the limit of 0.5 s.
Without a guardian (no time limit in the policy), robots drive on. `script/long stop` runs it.
"""

from __future__ import annotations

import argparse
import logging
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.waiting import wait_until

LIMIT_S: Final = 0.5
LONGEST_S: Final = 10.0
POLICY: Final = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-0.3, 0.3], unit: m/s}}
"""
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


class Trial:
    """A server and a client that drives a robot. Each method is an accident, and returns when it happened."""

    def __init__(self, master_uri: str, policy: Path) -> None:
        environment = {**os.environ, "ROS_MASTER_URI": master_uri}
        script = Path(sys.executable).with_name("pipros")
        self.server = subprocess.Popen(
            [script, "serve", "--port", "0", "--control", "--policy", policy],
            env=environment,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.server.stderr is not None
        self.url = next(found[0] for line in self.server.stderr if (found := re.search(r"ws://\S+", line)))
        threading.Thread(target=self.server.stderr.read, daemon=True).start()
        self.client = subprocess.Popen(
            [sys.executable, "-c", CLIENT, self.url], env=environment, stderr=subprocess.DEVNULL
        )

    def kill_client(self) -> float:
        self.client.kill()
        return time.monotonic()

    def kill_server(self) -> float:
        self.server.kill()
        return time.monotonic()

    def hang_server(self) -> float:
        self.server.send_signal(signal.SIGSTOP)
        return time.monotonic()

    def silence_client(self) -> float:
        """Stop the client, whose connection stays open, as when a link is cut."""
        self.client.send_signal(signal.SIGSTOP)
        return time.monotonic()

    def close(self) -> None:
        for process in (self.client, self.server):
            process.kill()
            process.wait()


ACCIDENTS: Final[Mapping[str, Callable[[Trial], float]]] = {
    "client": Trial.kill_client,
    "server": Trial.kill_server,
    "hung": Trial.hang_server,
    "silent": Trial.silence_client,
}


def run_trial(
    robot: Robot, accident: Callable[[Trial], float], policy: Path, master_uri: str
) -> float | None:
    """Return the time (s) from an accident to the stop; None if the robot drove on."""
    robot.driven_s = 0.0
    trial = Trial(master_uri, policy)
    try:
        wait_until(lambda: robot.driven_s)
        happened_s = accident(trial)
        return robot.stopped_s - happened_s if robot.stopped.wait(LONGEST_S) else None
    finally:
        trial.close()


def main() -> int:
    """Run the trials, and return the exit code."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--only", default=",".join(ACCIDENTS))
    parser.add_argument("--without-guardian", action="store_true")
    options = parser.parse_args()
    failed = 0
    with Master(port=0) as master, tempfile.TemporaryDirectory() as folder:
        policy = Path(folder) / "policy.yaml"
        policy.write_text(POLICY + ("" if options.without_guardian else f"    time_limit_s: {LIMIT_S}\n"))
        robot = Robot(master.uri)
        for name in options.only.split(","):
            found = [run_trial(robot, ACCIDENTS[name], policy, master.uri) for _ in range(options.trials)]
            times = sorted(each for each in found if each is not None)
            failed += len(found) - len(times)
            text = f"{name:8} {len(times)} of {len(found)} stopped"
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
