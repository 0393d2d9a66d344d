#!/usr/bin/env python3
"""Costs of single operations: the figures in docs/SECURITY.md and docs/architecture.md.

    script/bench costs [--only hook,owner,numpy,turtlesim,robots] [--connections 3000]

`hook`: processor time of an interpreter start, with and without the import hook. `owner`: finding the user of
a connection in /proc/net/tcp. `numpy`: the import time and size that it would add to the default
installation. `turtlesim`: processor time of a node with two moving turtles and a subscriber for each of their
topics. `robots`: processor time of pipros_sim with ten robots and subscribers for their odometry, transforms
and scans (360 rays at 10 Hz). Only pipros is measured, because genuine ROS has no counterpart to most of
these.
"""

from __future__ import annotations

import os
import resource
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy
import psutil
from programs import QUIET, Programs
from table import options_of

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.net.this_machine import ThisMachineCaller
from pipros.node import Node, Publisher


def processor_s(command: list[str], **variables: str) -> float:
    """Return the processor time that a command uses."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env={**os.environ, **variables}, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure_hook() -> None:
    command = [sys.executable, "-c", "pass"]
    variables = ({}, {"PIPROS_NO_IMPORT_HOOK": "1"})
    with_hook, without = [], []
    for _ in range(40):
        with_hook.append(processor_s(command, **variables[0]))
        without.append(processor_s(command, **variables[1]))
    print(f"interpreter start with the import hook     {statistics.median(with_hook) * 1000:6.1f} ms")
    print(f"interpreter start, PIPROS_NO_IMPORT_HOOK=1 {statistics.median(without) * 1000:6.1f} ms")


def measure_owner(connections: int) -> None:
    with ExitStack() as stack:
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=1024))
        for count in (1, connections):
            pairs = 0
            while pairs < count:
                client = stack.enter_context(socket.create_connection(server.getsockname()))
                accepted = stack.enter_context(server.accept()[0])
                pairs += 1
            caller = ThisMachineCaller.from_names(client.getsockname(), accepted.getsockname())
            times = []
            for _ in range(5):
                start = time.perf_counter()
                assert caller.user_id() == os.getuid()
                times.append(time.perf_counter() - start)
            print(
                f"user of one of {count:5} connections            {statistics.median(times) * 1000:6.1f} ms"
            )


def measure_numpy() -> None:
    code = "import time; start = time.process_time(); import numpy; print(time.process_time() - start)"
    took = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5)]
    folder = Path(numpy.__file__).parent
    folders = [folder, folder.with_name("numpy.libs")]
    size = sum(file.stat().st_size for place in folders for file in place.rglob("*") if file.is_file())
    print(f"import numpy                               {statistics.median(took) * 1000:6.1f} ms")
    print(f"size of numpy                              {size / 1e6:6.1f} MB")


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
    options = options_of(__doc__, only="hook,owner,numpy,turtlesim,robots", connections=3000)
    chosen = options.only.split(",")
    if "hook" in chosen:
        measure_hook()
    if "owner" in chosen:
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = 2 * options.connections + 100
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(wanted, hard)), hard))
        measure_owner(options.connections)
    if "numpy" in chosen:
        measure_numpy()
    if "turtlesim" in chosen:
        measure_turtlesim()
    if "robots" in chosen:
        measure_robots()


if __name__ == "__main__":
    main()
