"""A long run of a graph whose nodes start and end, to measure the resources in use and lost messages.

    script/bench soak --minutes 30 [--system | --everything]

One process contains the master, a talker at 50 Hz, a listener and a service. In addition, 20 nodes, each in
its own process, run for a while. They listen, reply, call the service, and end; every third node is ended
with SIGKILL. The exit status is 1 if the process has grown, or if a message between connected nodes was lost
or a call failed; see soak_system.py. With --system, a whole system runs instead; with --everything, all parts
of pipros: see soak_everything.py.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Coroutine
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from soak_system import FAILURES, System, soak_system

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node

BEAT_S = 0.02
LIFE_S = 10.0, 30.0
VISITORS = 20
KILL_EVERY = 3

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


def visit(name: str) -> None:
    """Listen, reply to each beat, and call the service until stopped."""
    beats, calls = Sequence(), Counter[str]()
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    with Node(name) as node:
        echo = node.advertise("/echo", String, queue_size=0)
        client = node.client("/count", Trigger)

        def answer(message: Any) -> None:
            beats.take(int(message.data))
            figures = beats.received, beats.received, beats.lost, calls["good"], calls["bad"]
            echo.publish(String(" ".join(map(str, (name, *figures)))))

        node.subscribe("/beat", String, answer)
        while not stop.wait(1.0):
            try:
                calls["good" if client.call(Trigger._request_class(), 5.0).success else "bad"] += 1
            except Exception:
                calls["bad"] += 1


def host(port: int) -> None:
    """Run the master, the talker, the listener and the service. Print the counts as JSON each second."""
    echoes: dict[str, Sequence] = {}
    reports: dict[str, list[int]] = {}

    def hear(message: Any) -> None:
        name, number, *reports[name] = (
            int(each) if each.isdecimal() else each for each in message.data.split()
        )
        echoes.setdefault(name, Sequence()).take(number)

    with Master(port=port) as master, Node("host", environment=Environment(master_uri=master.uri)) as node:
        publisher = node.advertise("/beat", String, queue_size=0)
        node.subscribe("/echo", String, hear)
        node.serve("/count", Trigger, lambda _: Trigger._response_class(success=True))
        begin, beat = time.monotonic(), 0
        with suppress(KeyboardInterrupt):
            while True:
                publisher.publish(String(str(beat)))
                beat += 1
                if beat % 50 == 0:
                    heard, lost, calls, failed = map(
                        sum, zip(*([0] * 4, *list(reports.values())), strict=True)
                    )
                    own = list(echoes.values())
                    done = {"beats": heard, "echoes": sum(each.received for each in own), "calls": calls}
                    done[FAILURES] = lost + failed + sum(each.lost for each in own)
                    print(json.dumps(done), flush=True)
                time.sleep(max(0.0, begin + beat * BEAT_S - time.monotonic()))


class Visits(System):
    """The host, and visitors that start and end."""

    counting = ("host",)

    def open(self) -> None:
        self.start("host", sys.executable, __file__, "--host", str(self.port))
        self.wait_for("host", "{")

    def clients(self) -> list[Coroutine[Any, Any, None]]:
        return [self.keep_visitors()]

    async def keep_visitors(self) -> None:
        """Keep `VISITORS` nodes running, each for a while."""
        started = 0
        running: list[tuple[subprocess.Popen[bytes], float]] = []
        try:
            while True:
                for process, end in list(running):
                    if process.poll() is not None or time.monotonic() > end:
                        running.remove((process, end))
                        is_killed = started % KILL_EVERY == 0
                        process.kill() if is_killed else process.terminate()
                        self.counts["killed" if is_killed else "ended"] += 1
                        await asyncio.to_thread(process.wait, 10)
                if len(running) < VISITORS:
                    started += 1
                    argv = (sys.executable, __file__, "--visitor", f"visitor_{started}")
                    end = time.monotonic() + random.uniform(*LIFE_S)  # noqa: S311
                    running.append((subprocess.Popen(argv, env=self.environment), end))
                await asyncio.sleep(0.2)
        finally:
            for process, _ in running:
                process.terminate()
                process.wait(10)


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--minutes", type=float, default=30.0)
    options.add_argument("--system", action="store_true", help="page, bags, transforms, actions, launch")
    options.add_argument("--everything", action="store_true", help="the same, and all other parts of pipros")
    options.add_argument("--visitor", metavar="NAME", help=argparse.SUPPRESS)
    options.add_argument("--host", type=int, metavar="PORT", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.visitor:
        visit(given.visitor)
    elif given.host:
        host(given.host)
    elif given.everything:
        from soak_everything import Everything

        return soak_system(given.minutes, Everything)
    else:
        return soak_system(given.minutes, System if given.system else Visits)
    return 0


if __name__ == "__main__":
    sys.exit(main())
