#!/usr/bin/env python3
"""The costs of a fleet: agents, many members, and a slow operator.

    script/bench fleet [--only cost,robots,slow] [--seconds 2] [--robots 100] [--quick]

cost: memory and processor time of an agent, idle and at 1,000 messages/s. robots: members with 20 topics
each in two processes, without masters: the time until an operator knows all directories; until an agent
shows all topics on its master, if they are at most 5,000; until all members are back after a restart of the
router; and until half of them, whose process is stopped, count as gone, and are back. slow: two operators
receive 10 messages/s of 10 kB from each of up to 100 robots; one of them handles only 100/s.
Nothing else should be running.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time

import psutil
from fleet_workers import DEADLINE_S, TOPICS
from table import free_port, options_of

WORKERS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "fleet_workers.py")
MAX_TOPICS = 5000  # the limit fleet_topics


class Program:
    """A process that ends with the benchmark."""

    def __init__(self, stack, *argv, wait="ready", **environment):
        self.process = subprocess.Popen(
            [sys.executable, *argv],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **environment},
        )
        stack.callback(self.end)
        self.first_line = ""
        while wait and wait not in self.first_line:
            self.first_line = self.line()

    def line(self):
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.process.args} ended")
        return line

    def ask_all(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return [int(each) for each in self.line().split()]

    def ask(self):
        return self.ask_all()[0]

    def end(self):
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        self.process.terminate()
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def usage(self):
        """Return the processor time in seconds and the resident size in MB."""
        process = psutil.Process(self.process.pid)
        return sum(process.cpu_times()[:2]), process.memory_info().rss / (1 << 20)


def worker(stack, name, *arguments, **more):
    return Program(stack, WORKERS, name, *map(str, arguments), **more)


def pipros(stack, *arguments, wait, **environment):
    code = "import sys; from pipros.cli.pipros import main; sys.exit(main())"
    return Program(stack, "-c", code, *arguments, wait=wait, **environment)


class System:
    """Two masters, a router and two agents."""

    def __init__(self, stack):
        from pipros.master.master import Master

        self.router = f"tcp/127.0.0.1:{free_port()}"
        pipros(stack, "fleet", "router", self.router, wait="router at")
        self.masters = [stack.enter_context(Master(port=0)).uri for _ in "ab"]
        self.agents = [
            pipros(
                stack, "fleet", "join", name, "--router", self.router, wait="joined", ROS_MASTER_URI=master
            )
            for name, master in zip("ab", self.masters, strict=True)
        ]


def cost(system, seconds):
    agent = system.agents[0]
    with contextlib.ExitStack() as stack:
        for what in ("idle", "1000/s"):
            if what != "idle":
                counter = worker(stack, "count", system.masters[1], "/to_a", "/a/to_b")
                worker(stack, "flood", system.masters[0], "/to_b", "/b/to_a", 100, 1000)
                while counter.ask() < 100:
                    time.sleep(0.1)
            begin, before = time.monotonic(), agent.usage()
            time.sleep(seconds)
            after = agent.usage()
            share = 100 * (after[0] - before[0]) / (time.monotonic() - begin)
            print(f"agent, {what}: {share:.1f} % of a core, {after[1]:.0f} MB")


def robots(number):
    from pipros.fleet.status import directory_of, present
    from pipros.fleet.zenoh_connecting import connect

    router, half = f"tcp/127.0.0.1:{free_port()}", number // 2

    def until_present(expected):
        """Return the time in seconds until the operator sees exactly `expected` members."""
        begin, number = time.monotonic(), 0
        while time.monotonic() < begin + DEADLINE_S:
            number = len({each.member for each in present(link)}) if link.is_connected else 0
            if number == expected:
                return time.monotonic() - begin
            time.sleep(0.2)
        raise SystemExit(f"{number} of {expected} members are present after {DEADLINE_S} s")

    with contextlib.ExitStack() as stack:
        first = stack.enter_context(contextlib.ExitStack())
        program = pipros(first, "fleet", "router", router, wait="router at")
        begin = time.monotonic()
        parts = [
            worker(stack, "many", router, 0, number - half, wait=""),
            worker(stack, "many", router, number - half, half, wait=""),
        ]
        for part in parts:
            part.line()
        print(f"{number} members joined in {time.monotonic() - begin:.1f} s")
        begin, link = time.monotonic(), connect(router)
        stack.callback(link.close)
        members = {each.member for each in present(link)}
        known = time.monotonic() - begin
        found = [directory_of(link, member) for member in members]
        passed = time.monotonic() - begin
        print(
            f"an operator knows {len(members)} members after {1000 * known:.0f} ms, and "
            f"{sum(each is not None for each in found)} directories, one by one, after {passed:.2f} s"
        )
        print(f"router: {program.usage()[1]:.0f} MB", flush=True)
        if number * TOPICS <= MAX_TOPICS:
            show(router, number)
        first.close()
        begin = time.monotonic()
        pipros(stack, "fleet", "router", router, wait="router at")
        started = time.monotonic() - begin
        passed = started + until_present(number)
        print(f"a new router was started in {started:.1f} s; all were back after {passed:.1f} s", flush=True)
        parts[1].process.send_signal(signal.SIGSTOP)
        gone = until_present(number - half)
        parts[1].process.send_signal(signal.SIGCONT)
        back = until_present(number)
        print(f"{half} stopped members were gone after {gone:.1f} s, and back after {back:.1f} s")


def show(router, number):
    """Measure how long an agent takes to show all topics of the members."""
    from pipros.master.master import Master

    with contextlib.ExitStack() as stack:
        running = stack.enter_context(Master(port=0))
        begin = time.monotonic()
        agent = pipros(
            stack, "fleet", "join", "operator", "--router", router, wait="joined", ROS_MASTER_URI=running.uri
        )
        from xmlrpc.client import ServerProxy

        proxy = ServerProxy(running.uri)
        while time.monotonic() < begin + DEADLINE_S:
            published = proxy.getSystemState("/bench")[2][0]
            if sum(topic.startswith("/robot") for topic, _ in published) == TOPICS * number:
                break
            time.sleep(0.1)
        seconds, megabytes = agent.usage()
        print(
            f"an agent shows {TOPICS * number} topics after {time.monotonic() - begin:.1f} s "
            f"({seconds:.1f} s of processor time): {megabytes:.0f} MB",
            flush=True,
        )


def slow(number, seconds):
    router = f"tcp/127.0.0.1:{free_port()}"
    with contextlib.ExitStack() as stack:
        program = pipros(stack, "fleet", "router", router, wait="router at")
        operator = worker(stack, "watch", router, 0)
        worker(stack, "senders", router, number, 10, 10_000)
        for what in ("alone", "beside a slow operator"):
            if what != "alone":
                other = worker(stack, "watch", router, 10)
                time.sleep(seconds)  # until its buffers are full
                other.ask()
            operator.ask()
            begin = time.monotonic()
            time.sleep(seconds)
            received, delay = operator.ask_all()
            rate = received / (time.monotonic() - begin)
            print(
                f"operator, {what}: {rate:.0f} messages/s, 95th percentile of delays {delay / 1000:.1f} ms",
                flush=True,
            )
        received, delay = other.ask_all()
        print(f"the slow operator: {received / seconds:.0f} messages/s, delay {delay / 1000:.0f} ms")
        print(f"router: {program.usage()[1]:.0f} MB")


def main():
    options = options_of(__doc__, only="cost,robots,slow", seconds=2, robots=100, quick=False)
    if options.quick:
        options.seconds, options.robots = 1, 20
    wanted = options.only.split(",")
    print(f"load before the run: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    if "cost" in wanted:
        with contextlib.ExitStack() as stack:
            cost(System(stack), 5 * options.seconds)
    if "robots" in wanted:
        robots(options.robots)
    if "slow" in wanted:
        slow(min(options.robots, 100), 5 * options.seconds)


if __name__ == "__main__":
    main()
