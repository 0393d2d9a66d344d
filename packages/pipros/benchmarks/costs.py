#!/usr/bin/env python3
"""Costs of simulated robots: the figures in docs/course.md and docs/simulation.md.

    script/bench costs [--only turtlesim,robots]

`turtlesim`: processor time of a node with two moving turtles and a subscriber for each of their topics.
`robots`: processor time of pipros_sim with ten robots and subscribers for their odometry, transforms and
scans (360 rays at 10 Hz). Only pipros is measured, because genuine ROS has no counterpart to pipros_sim.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import psutil
from programs import QUIET, Programs
from table import options_of

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node, Publisher


def steered(
    process: subprocess.Popen[str],
    publishers: Sequence[Publisher],
    command: Any,
    received: Sequence[object],
    seconds: float,
) -> tuple[float, float]:
    """Publish a command five times per second: for two seconds, then for `seconds`, which are measured.

    Return the share of a processor that the process uses, and the messages per second that are received.
    """
    measured = psutil.Process(process.pid)
    for duration in (2.0, seconds):
        before, count, start = measured.cpu_times(), len(received), time.monotonic()
        while time.monotonic() - start < duration:
            for publisher in publishers:
                publisher.publish(command)
            time.sleep(0.2)
        after, passed = measured.cpu_times(), time.monotonic() - start
    used = after.user + after.system - before.user - before.system
    return used / passed, (len(received) - count) / passed


@contextmanager
def simulated(last_service: str, *program: str) -> Iterator[tuple[subprocess.Popen[str], Node]]:
    """Run a simulator with its own master, and yield it with a node, once its last service is registered."""
    with Programs() as programs:
        process = programs.start("rosrun", *program, **QUIET)
        environment = Environment(master_uri=programs.environment["ROS_MASTER_URI"])
        with Node("benchmark", environment=environment) as node:
            while last_service not in dict(node.master.get_system_state()[2]):
                time.sleep(0.05)
            yield process, node


def measure_turtlesim(seconds: float = 5.0) -> None:
    twist = load_message_class("geometry_msgs/Twist")
    spawn = load_service_class("turtlesim/Spawn")
    got: list[object] = []
    with simulated("/kill", "turtlesim", "turtlesim_node") as (process, node):
        node.client("/spawn", spawn).call(spawn._request_class(x=2.0, y=2.0, name="turtle2"), 10)
        for turtle in ("turtle1", "turtle2"):
            for topic in ("Pose pose", "Color color_sensor"):
                kind, name = topic.split()
                node.subscribe(f"/{turtle}/{name}", load_message_class(f"turtlesim/{kind}"), got.append)
        publishers = [node.advertise(f"/{turtle}/cmd_vel", twist) for turtle in ("turtle1", "turtle2")]
        command = twist()
        command.linear.x = command.angular.z = 1.5
        used, rate = steered(process, publishers, command, got, seconds)
        print(f"turtlesim with two turtles                 {used * 100:6.1f} % of a processor")
        print(f"poses a turtle sent                        {rate / 4:6.1f} Hz")


def measure_robots(seconds: float = 10.0) -> None:
    twist = load_message_class("geometry_msgs/Twist")
    scans: list[object] = []
    program = ("pipros_sim", "sim", "_robots:=10", "_headless:=true")
    with simulated("/reset_positions", *program) as (process, node):
        node.subscribe("/tf", load_message_class("tf2_msgs/TFMessage"), lambda _: None)
        publishers = []
        for index in range(10):
            name = f"/robot_{index}"
            node.subscribe(f"{name}/scan", load_message_class("sensor_msgs/LaserScan"), scans.append)
            node.subscribe(f"{name}/odom", load_message_class("nav_msgs/Odometry"), lambda _: None)
            publishers.append(node.advertise(f"{name}/cmd_vel", twist))
        command = twist()
        command.linear.x, command.angular.z = 0.2, 0.5
        used, rate = steered(process, publishers, command, scans, seconds)
        print(f"pipros_sim with ten robots                 {used * 100:6.1f} % of a processor")
        print(f"scans a robot sent                         {rate / 10:6.1f} Hz")


def main() -> None:
    chosen = options_of(__doc__, only="turtlesim,robots").only.split(",")
    if "turtlesim" in chosen:
        measure_turtlesim()
    if "robots" in chosen:
        measure_robots()


if __name__ == "__main__":
    main()
