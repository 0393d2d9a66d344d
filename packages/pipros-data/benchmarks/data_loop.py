"""A policy that drives a robot at 30 Hz through `pipros.data`; part of `benchmarks/data.py`.

`rosbag record` in its own process records when each command arrives. Deviations are measured from the grid
of 30 Hz that fits these times best. They include delays in the policy's process, the connection and the
recorder. Steps that are late by a period or more skip times of the grid, which are counted.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
from nav_msgs.msg import Odometry
from soak_resources import Processors

import rosbag
from pipros import Core
from pipros.data import RobotEnvironment, open_bags
from pipros.msg.time import Time

RATE = 30
DESCRIPTION = f"""\
rate: {RATE}
time: receipt
tolerance: 2
watchdog: 1
observations:
  odom: {{topic: /odom, fields: [pose.pose.position.x, pose.pose.position.y, twist.twist.linear.x]}}
actions:
  base: {{topic: /cmd_vel, type: geometry_msgs/Twist, fields: [linear.x, angular.z], min: -1, max: 1}}
"""


@contextmanager
def program(environment: dict[str, str], *command: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program until the block ends."""
    started = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield started
    finally:
        started.terminate()
        started.wait(20)


def write_drive(path: Path, seconds: float) -> None:
    """Write a bag with odometry at 50 Hz."""
    with rosbag.Bag(str(path), "w") as bag:
        for n in range(int(seconds * 50)):
            message = Odometry()
            message.pose.pose.position.x = n / 100
            bag.write("/odom", message, Time(1000 + n // 50, n % 50 * 20_000_000))


def run(minutes: float, robot: str) -> None:
    """Drive for `minutes`, and print the deviations. `robot` is `pipros_sim` or `rosbag play`."""
    seconds = minutes * 60
    with tempfile.TemporaryDirectory() as name, Core(port=0) as core, ExitStack() as stack:
        folder = Path(name)
        (folder / "robot.yaml").write_text(DESCRIPTION)
        environment = {**os.environ, "ROS_MASTER_URI": core.uri}
        bin_folder = Path(sys.executable).parent
        if robot == "pipros_sim":
            command = [str(bin_folder / "rosrun"), "pipros_sim", "sim", "_headless:=true"]
        else:
            write_drive(folder / "drive.bag", seconds + 30)
            command = ["/usr/bin/python3", "/usr/bin/rosbag", "play", "--quiet", str(folder / "drive.bag")]
            for variable in ("PYTHONPATH", "VIRTUAL_ENV"):
                environment.pop(variable, None)
        stack.enter_context(program(environment, *command))
        bag = folder / "commands.bag"
        record = [str(bin_folder / "rosbag"), "record", "-O", str(bag), "/cmd_vel"]
        recorder = stack.enter_context(program({**environment, "ROS_MASTER_URI": core.uri}, *record))
        loop = RobotEnvironment(folder / "robot.yaml", master_uri=core.uri, timeout_s=30)
        processors = Processors()
        late_ms = drive(loop, seconds)
        loop.close()
        own, foreign = processors.percent()
        recorder.terminate()
        recorder.wait(20)
        with open_bags(bag) as bags:
            table = bags.table("/cmd_vel")
        moving = table["linear.x"] != 0
        times = table.times()[moving]
    count = int(seconds * RATE)
    turns = (times - times[0]) * (RATE / 1e9)
    phase = np.angle(np.exp(2j * np.pi * turns).mean()) / (2 * np.pi)
    apart = np.abs((turns - phase + 0.5) % 1 - 0.5) * 1000 / RATE
    p50, p99 = np.percentile(apart, [50, 99])
    skipped = round(turns[-1]) + 1 - len(times)
    print(
        f"closed loop with {robot}: {len(times)} of {count} commands at {RATE} Hz in {minutes:g} min; "
        f"deviation from the next time of the grid p50 {p50:.2f} ms, p99 {p99:.2f} ms (goal: 3), maximum "
        f"{apart.max():.2f} ms; "
        f"{skipped} times of the grid without a command, {int((late_ms > 0).sum())} late steps; "
        f"processors: {own:.0f} % used by this run, {foreign:.0f} % by others",
        flush=True,
    )


def drive(loop: RobotEnvironment, seconds: float) -> np.ndarray:
    """Drive in circles, using the last observation. Return how late each step was (ms)."""
    observation, _ = loop.reset()
    late = []
    for _ in range(int(seconds * RATE)):
        speed = 0.2 + 0.01 * np.tanh(observation["state"][2])
        observation, _, _, _, info = loop.step([speed, 0.5])
        late.append(1000 * info["late_s"])
    return np.array(late)


def main(minutes: float) -> None:
    """Drive the simulated robot, and then a recording that genuine rosbag plays, if it is installed."""
    run(minutes, "pipros_sim")
    if Path("/usr/bin/rosbag").exists():
        run(minutes, "rosbag play")
