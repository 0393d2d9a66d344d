#!/usr/bin/env python3
"""Time of a policy decision, and of calls to the tools of `pipros mcp`.

    benchmarks/assistants.py [--calls 200]

A decision is about one Twist on /cmd_vel, with bounds for two fields and a limit of messages per minute; only
processor time counts. Calls go to one server with 20 topics, over its standard input and output, and over
HTTP; the medians are printed, and the server's processor time per call. `list_tools` is answered by the
protocol's library alone.
"""

import argparse
import asyncio
import os
import secrets
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx2
import psutil
from geometry_msgs.msg import Twist
from mcp import Client, StdioServerParameters
from mcp.client.streamable_http import streamable_http_client
from std_msgs.msg import String
from table import Load, heed_interrupts, line

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from pipros.policy.decisions import Act, PolicyState, decide
from pipros.policy.model import ActKind
from pipros.policy.policy_file import parse_policy

POLICY = """
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields:
      linear.x: {range: [-0.3, 0.3], unit: m/s}
      angular.z: {range: [-1, 1], unit: rad/s}
    per_minute: 60000
    time_limit_s: 0.5
    stop: zero
"""
CALLS = {
    "list_tools": None,
    "list_topics": {},
    "read_topic": {"topic": "/chat"},
    "show_definition": {"type": "sensor_msgs/Imu"},
    "list_nodes": {},
}
TOPICS = 20
DECISIONS = 20_000


def decision_us():
    """Return the processor time of a decision."""
    policy, state, twist = parse_policy(POLICY, "bench.yaml"), PolicyState(), Twist()
    act = Act(ActKind.TOPIC, "/cmd_vel", twist, Twist._type, Twist._md5sum)
    begin = time.process_time()
    for number in range(DECISIONS):
        twist.linear.x = number % 3 / 10
        decide(policy, act, state, number * 0.01)
    return (time.process_time() - begin) / DECISIONS * 1e6


async def measure(client, server, calls):
    """Yield the name of each call, its median in ms, and the server's processor time per call in ms."""
    for name, arguments in CALLS.items():
        times, begin = [], sum(server.cpu_times()[:2])
        for _ in range(calls):
            start = time.perf_counter()
            if arguments is None:
                await client.list_tools(cache_mode="refresh")
            else:
                answer = await client.call_tool(name, arguments)
                if answer.is_error:
                    raise SystemExit(f"{name}: {answer.content[0].text}")
            times.append(time.perf_counter() - start)
        used_s = sum(server.cpu_times()[:2]) - begin
        yield name, statistics.median(times) * 1e3, used_s / calls * 1e3


async def over_stdio(environment, calls):
    command = ["-c", "from pipros.cli.pipros import main; main()", "mcp"]
    async with Client(StdioServerParameters(command=sys.executable, args=command, env=environment)) as client:
        (server,) = psutil.Process().children()
        return [row async for row in measure(client, server, calls)]


async def over_http(environment, calls):
    token = secrets.token_urlsafe(32)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "tokens")
        file.touch(0o600)
        file.write_text(token)
        command = [sys.executable, "-c", "from pipros.cli.pipros import main; main()", "mcp"]
        with subprocess.Popen(
            [*command, "--http", "0", "--token-file", str(file)],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as server:
            try:
                url = next(word for text in server.stdout for word in text.split() if word.endswith("/mcp"))
                async with (
                    httpx2.AsyncClient(
                        headers={"Authorization": f"Bearer {token}"}, timeout=60
                    ) as connection,
                    Client(streamable_http_client(url, http_client=connection)) as client,
                ):
                    return [row async for row in measure(client, psutil.Process(server.pid), calls)]
            finally:
                server.terminate()


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--calls", type=int, default=200)
    calls = parser.parse_args().calls
    heed_interrupts()
    load = Load()
    with Master(port=0) as master, Node("robot", environment=Environment(master_uri=master.uri)) as node:
        for number in range(TOPICS):
            node.advertise(f"/topic_{number}", String, latch=True).publish(String("hello"))
        node.advertise("/chat", String, latch=True).publish(String("hello"))
        environment = {**os.environ, "ROS_MASTER_URI": master.uri}
        rows = [asyncio.run(over(environment, calls)) for over in (over_stdio, over_http)]
    print(line(["call", "stdio", "stdio: server's processor time", "HTTP", "HTTP: server's processor time"]))
    print(line(["---", *["---:"] * 4]))
    for (name, *stdio), (_, *http) in zip(*rows, strict=True):
        print(line([name, *(f"{value:.1f} ms" for value in (*stdio, *http))]))
    print(f"\ntime of a policy decision: {decision_us():.1f} us; foreign load: {load.percent():.0f} %")


if __name__ == "__main__":
    main()
