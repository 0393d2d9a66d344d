"""A long run of a graph whose nodes start and end, to measure the resources in use and lost messages.

    script/bench soak --minutes 30 [--system | --everything]

This process contains the master, a talker at 50 Hz, a listener and a service. In addition, 20 nodes, each in
its own process, run for a while. They listen, reply, call the service, and end; every third node is ended
with SIGKILL. A line is printed every ten seconds; the exit status is 1 if this process uses clearly more
resources at the end than before, or if a message was lost between connected nodes. With --system, a whole
system runs instead; with --everything, all parts of pipros. See soak_system.py and
soak_everything.py.
"""

from __future__ import annotations

import argparse
import gc
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node

BEAT_S = 0.02
LIFE_S = 10.0, 30.0
LINE_EVERY_S = 10.0
KILL_EVERY = 3
MEMORY_SLACK_MB = 8.0
#: After this time, all nodes have started once, and this process has its permanent threads and buffers.
WARM_UP_S = 20.0

HEADINGS = " minutes     MB threads  files nodes so far killed  received  lost   calls failed"

String: Any = load_message_class("std_msgs/String")
Trigger: Any = load_service_class("std_srvs/Trigger")


@dataclass(slots=True)
class Sequence:
    """Counts the gaps in numbers that should follow each other."""

    last: int | None = None
    received: int = 0
    lost: int = 0

    def take(self, number: int) -> None:
        if self.last is not None and number > self.last + 1:
            self.lost += number - self.last - 1
        self.last = number
        self.received += 1


# -- visitors: nodes that start and end ----------------------------------------------------


def visit(name: str) -> None:
    """Listen, reply to each beat, and call the service until stopped."""
    beats, calls = Sequence(), Counter[str]()
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    with Node(name) as node:
        echo = node.advertise("/echo", String, queue_size=0)
        client = node.client("/count", Trigger)
        number = 0

        def answer(message: Any) -> None:
            nonlocal number
            beats.take(int(message.data))
            number += 1
            figures = number, beats.received, beats.lost, calls["good"], calls["bad"]
            echo.publish(String(" ".join(map(str, (name, *figures)))))

        node.subscribe("/beat", String, answer)
        while not stop.wait(1.0):
            try:
                calls["good" if client.call(Trigger._request_class(), 5.0).success else "bad"] += 1
            except Exception:
                calls["bad"] += 1


# -- the permanent process -----------------------------------------------------------------


@dataclass(slots=True)
class Tally:
    """The visitors' reports so far, by name."""

    echoes: dict[str, Sequence] = field(default_factory=dict)
    told: dict[str, tuple[int, int, int, int]] = field(default_factory=dict)

    def hear(self, message: Any) -> None:
        name, *numbers = message.data.split()
        number, *rest = map(int, numbers)
        self.echoes.setdefault(name, Sequence()).take(number)
        self.told[name] = tuple(rest)  # type: ignore[assignment]

    def sums(self) -> dict[str, int]:
        told = list(self.told.values())
        return {
            "received": sum(item[0] for item in told)
            + sum(echo.received for echo in list(self.echoes.values())),
            "lost": sum(item[1] for item in told) + sum(echo.lost for echo in list(self.echoes.values())),
            "calls": sum(item[2] for item in told),
            "failed calls": sum(item[3] for item in told),
        }


class Visitors:
    """Keeps a number of nodes running, each for a while."""

    def __init__(self, count: int, environment: dict[str, str]) -> None:
        self.started = self.killed = 0
        self._environment = environment
        self._running: list[tuple[subprocess.Popen[bytes], float]] = []
        self._count = count

    def look(self) -> None:
        """End visitors whose time is over, and start a new visitor if one is missing."""
        now = time.monotonic()
        for process, end in list(self._running):
            if process.poll() is not None or now > end:
                self._running.remove((process, end))
                self._end(process, is_polite=(self.started % KILL_EVERY) != 0)
        if len(self._running) < self._count:
            self.started += 1
            command = [sys.executable, __file__, "--visitor", f"visitor_{self.started}"]
            process = subprocess.Popen(command, env=self._environment)
            self._running.append((process, now + random.uniform(*LIFE_S)))  # noqa: S311

    def close(self) -> None:
        for process, _ in self._running:
            self._end(process, is_polite=True)
        self._running.clear()

    def _end(self, process: subprocess.Popen[bytes], *, is_polite: bool) -> None:
        process.terminate() if is_polite else process.kill()
        self.killed += not is_polite
        process.wait(10)


def held() -> tuple[float, int, int]:
    """Return this process's resident megabytes, threads and descriptors."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    megabytes = pages * os.sysconf("SC_PAGE_SIZE") / 1e6
    return megabytes, threading.active_count(), len(os.listdir("/proc/self/fd"))


def soak(minutes: float, count: int) -> int:
    tally, calls = Tally(), Counter[str]()

    def respond(_: Any) -> Any:
        calls["all"] += 1
        return Trigger._response_class(success=True)

    with Master(port=0) as master, Node("host", environment=Environment(master_uri=master.uri)) as node:
        publisher = node.advertise("/beat", String, queue_size=0)
        node.subscribe("/echo", String, tally.hear)
        node.serve("/count", Trigger, respond)
        alone = held()
        visitors = Visitors(count, {**os.environ, "ROS_MASTER_URI": master.uri})
        print(HEADINGS, flush=True)
        begin = time.monotonic()
        next_line, next_look, beat, warm = begin + LINE_EVERY_S, begin, 0, None
        while (now := time.monotonic()) < begin + minutes * 60:
            publisher.publish(String(str(beat)))
            beat += 1
            if now >= next_look:
                next_look = now + 0.2
                visitors.look()
            if warm is None and now > begin + WARM_UP_S:
                warm = held()
            if now >= next_line:
                next_line += LINE_EVERY_S
                megabytes, threads, files = held()
                sums = tally.sums()
                print(
                    f"{(now - begin) / 60:8.1f} {megabytes:6.1f} {threads:7} {files:6} {visitors.started:12} "
                    f"{visitors.killed:6} {sums['received']:9} {sums['lost']:5} {sums['calls']:7} "
                    f"{sums['failed calls']:6}",
                    flush=True,
                )
            time.sleep(max(0.0, begin + beat * BEAT_S - time.monotonic()))
        visitors.close()
        deadline = time.monotonic() + 10
        while publisher.connection_count and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(1)
        after = held()
        print(f"alone before: {alone[0]:.1f} MB, {alone[1]} threads, {alone[2]} files")
        print(f"alone after:  {after[0]:.1f} MB, {after[1]} threads, {after[2]} files")
        lost = tally.sums()["lost"]
        print(f"{visitors.started} nodes started, {visitors.killed} of them killed; {lost} messages lost")
        has_grown = warm is not None and after[0] > warm[0] + MEMORY_SLACK_MB
        return int(bool(lost) or has_grown or after[1] > alone[1] + 10 or after[2] > alone[2] + 8)


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--minutes", type=float, default=30.0)
    options.add_argument("--nodes", type=int, default=20)
    options.add_argument("--system", action="store_true", help="page, bags, transforms, actions, launch")
    options.add_argument("--everything", action="store_true", help="the same, and all other parts of pipros")
    options.add_argument("--visitor", metavar="NAME", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.visitor:
        visit(given.visitor)
        return 0
    if given.system:
        from soak_system import soak_system

        return soak_system(given.minutes)
    if given.everything:
        from soak_everything import Everything
        from soak_system import soak_system

        return soak_system(given.minutes, Everything)
    return soak(given.minutes, given.nodes)


if __name__ == "__main__":
    sys.exit(main())
