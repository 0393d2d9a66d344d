#!/usr/bin/env python3
"""The costs of a fleet: agents, many members, and a slow operator.

    script/bench fleet [--only cost,robots,slow] [--seconds 2] [--robots 100] [--quick]

cost: memory and processor time of an agent, idle and at 1,000 messages/s. robots: members with 20 topics
each in two processes, without masters: the time until an operator knows all directories; until an agent
shows all topics on its master, if they are at most 5,000; until all members are back after a restart of the
router; and until half of them, whose process is stopped, count as gone, and are back. slow: two operators
receive 10 messages/s of 10 kB from each of up to 100 robots; one of them handles only 100/s.
"""

import contextlib
import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from xmlrpc.client import ServerProxy

import psutil
from programs import SCRIPTS, cpu_s, end
from table import free_port, options_of

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_fleet import keys
from pipros_fleet.agent import new_instance
from pipros_fleet.directory import Directory, DirectoryEntry, to_json
from pipros_fleet.status import directory_of, present
from pipros_fleet.zenoh_connecting import connect
from pipros_fleet.zenoh_session import LinkFailed

MAX_TOPICS = 5000  # FLEET_TOPICS
DEADLINE_S = 60.0
TOPICS = 20


# ---- workers: in their own processes


def many(router, first, number):
    """Run `number` members with 20 topics each."""
    held, indices = [], iter(range(first, first + number))
    md5sum = load_message_class("std_msgs/String")._md5sum
    entries = tuple(DirectoryEntry(f"/topic{each}", "std_msgs/String", md5sum) for each in range(TOPICS))

    def connected():
        while True:
            with contextlib.suppress(LinkFailed):  # timeouts on a busy machine
                return connect(router)

    def join():
        for index in indices:
            link, name, instance = connected(), f"robot{index}", new_instance()
            document = to_json(Directory(name, instance, 1, entries))

            def answer(question, document=document):
                question.answer(document)
                question.close()

            held.append((link, link.serve(keys.directory(name), answer)))
            held.append(link.declare_token(keys.live(name, 1, instance)))

    threads = [threading.Thread(target=join) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print("ready", flush=True)
    sys.stdin.read()


def senders(router, number, rate, size):
    """Send `rate` messages per second, of `size` bytes, from each of `number` members.

    Each message begins with the time at which it was sent.
    """
    links = [(connect(router), keys.topic(f"robot{each}", "/data")) for each in range(number)]
    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
    print("ready", flush=True)
    begin = time.monotonic()
    for sent, (link, key) in enumerate(itertools.cycle(links), 1):
        link.put(key, time.monotonic_ns().to_bytes(8, "little").ljust(size))
        time.sleep(max(0.0, begin + sent / rate / number - time.monotonic()))


def watch(router, pause_ms):
    """Receive all messages, with a pause after each.

    For each line of input, print the number of messages since the previous line, and the 95th percentile of
    their delays in us.
    """
    delays = []

    def take(_key, payload, _attachment):
        delays.append((time.monotonic_ns() - int.from_bytes(payload[:8], "little")) // 1000)
        time.sleep(pause_ms / 1000)

    link = connect(router)
    held = link.subscribe(keys.topic("*", keys.EVERY), take)  # noqa: F841 # which keeps it
    print("ready", flush=True)
    for _ in sys.stdin:
        found = sorted(delays)
        delays.clear()
        print(len(found), found[len(found) * 95 // 100] if found else 0, flush=True)


WORKERS = {each.__name__: each for each in (many, senders, watch)}


# ---- the benchmark


class Program:
    """A process that ends with the benchmark."""

    def __init__(self, stack, *argv, wait="ready", **environment):
        pipe = subprocess.PIPE
        environment = {**os.environ, **environment}
        self.process = subprocess.Popen(argv, stdin=pipe, stdout=pipe, text=True, env=environment)
        stack.callback(end, self.process)
        while wait and wait not in self.line():
            pass

    def line(self):
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.process.args} ended")
        return line

    def ask(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return [int(each) for each in self.line().split()]

    def megabytes(self):
        return psutil.Process(self.process.pid).memory_info().rss / (1 << 20)


def worker(stack, name, *arguments, **more):
    return Program(stack, sys.executable, __file__, "--worker", name, *map(str, arguments), **more)


def fleet(stack, *arguments, wait, **environment):
    program = os.path.join(SCRIPTS, "pipros")
    return Program(stack, program, "fleet", *arguments, wait=wait, PYTHONUNBUFFERED="1", **environment)


def start_router(stack, router):
    return fleet(stack, "router", router, wait="router at")


def join(stack, router, name):
    """Start a master and an agent. Return the agent and the master's address."""
    uri = stack.enter_context(Master(port=0)).uri
    return fleet(stack, "join", name, "--router", router, wait="joined", ROS_MASTER_URI=uri), uri


def cost(stack, router, options):
    start_router(stack, router)
    (agent, here), (_, there) = (join(stack, router, name) for name in "ab")
    kind, seen = load_message_class("std_msgs/UInt8MultiArray"), []
    sender, receiver = (
        stack.enter_context(Node("bench", environment=Environment(master_uri=uri))) for uri in (here, there)
    )
    publisher = sender.advertise("/to_b", kind, queue_size=None)

    def send_for(seconds, rate):
        begin = time.monotonic()
        while time.monotonic() < begin + seconds:
            if rate:
                publisher.publish(kind(data=bytes(100)))
            time.sleep(1 / (rate or 10))

    for what, rate in (("idle", 0), ("1000/s", 1000)):
        if rate:
            receiver.subscribe("/a/to_b", kind, seen.append)
            while len(seen) < 100:
                send_for(0.1, rate)
        begin, before = time.monotonic(), cpu_s(agent.process.pid)
        send_for(5 * options.seconds, rate)
        share = 100 * (cpu_s(agent.process.pid) - before) / (time.monotonic() - begin)
        print(f"agent, {what}: {share:.1f} % of a core, {agent.megabytes():.0f} MB")


def robots(stack, router, options):
    number, half = options.robots, options.robots // 2

    def until_present(expected):
        """Return the time in seconds until the operator sees exactly `expected` members."""
        begin, number = time.monotonic(), 0
        while time.monotonic() < begin + DEADLINE_S:
            number = len({each.member for each in present(link)}) if link.is_connected else 0
            if number == expected:
                return time.monotonic() - begin
            time.sleep(0.2)
        raise SystemExit(f"{number} of {expected} members are present after {DEADLINE_S} s")

    first = stack.enter_context(contextlib.ExitStack())
    program = start_router(first, router)
    begin = time.monotonic()
    parts = [
        worker(stack, "many", router, *part, wait="") for part in ((0, number - half), (number - half, half))
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
    print(f"router: {program.megabytes():.0f} MB", flush=True)
    if number * TOPICS <= MAX_TOPICS:
        show(router, number)
    first.close()
    begin = time.monotonic()
    start_router(stack, router)
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
    with contextlib.ExitStack() as stack:
        begin = time.monotonic()
        agent, uri = join(stack, router, "operator")
        proxy = ServerProxy(uri)
        while time.monotonic() < begin + DEADLINE_S:
            published = proxy.getSystemState("/bench")[2][0]
            if sum(topic.startswith("/robot") for topic, _ in published) == TOPICS * number:
                break
            time.sleep(0.1)
        print(
            f"an agent shows {TOPICS * number} topics after {time.monotonic() - begin:.1f} s "
            f"({cpu_s(agent.process.pid):.1f} s of processor time): {agent.megabytes():.0f} MB",
            flush=True,
        )


def slow(stack, router, options):
    seconds, program = 5 * options.seconds, start_router(stack, router)
    operator = worker(stack, "watch", router, 0)
    worker(stack, "senders", router, min(options.robots, 100), 10, 10_000)
    for what in ("alone", "beside a slow operator"):
        if what != "alone":
            other = worker(stack, "watch", router, 10)
            time.sleep(seconds)  # until its buffers are full
            other.ask()
        operator.ask()
        begin = time.monotonic()
        time.sleep(seconds)
        received, delay = operator.ask()
        rate = received / (time.monotonic() - begin)
        print(f"operator, {what}: {rate:.0f} messages/s, 95th percentile of delays {delay / 1000:.1f} ms")
    received, delay = other.ask()
    print(f"the slow operator: {received / seconds:.0f} messages/s, delay {delay / 1000:.0f} ms")
    print(f"router: {program.megabytes():.0f} MB")


def main():
    options = options_of(__doc__, only="cost,robots,slow", seconds=2, robots=100, quick=False)
    if options.quick:
        options.seconds, options.robots = 1, 20
    print(f"load before the run: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors", flush=True)
    for name in options.only.split(","):
        with contextlib.ExitStack() as stack:
            globals()[name](stack, f"tcp/127.0.0.1:{free_port()}", options)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        WORKERS[sys.argv[2]](*(int(each) if each.isdecimal() else each for each in sys.argv[3:]))
        os._exit(0)
    main()
