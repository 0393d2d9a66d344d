"""A long run of a whole system, to measure the resources of each process.

Started by `script/bench soak --system`. The system consists of roscore, a page that is being viewed, a
recorder for all topics, frames and a listener, an action server and a client, parameter changes, service
calls, and a launch with two nodes that end repeatedly and are restarted. `--everything` adds the parts of
`soak_everything.py`. Every ten seconds, the memory, threads, descriptors and processor time of
each process are recorded. The verdict compares the last fifth of the time with the second fifth. In addition,
the work of each part must continue to the end without a failure, and all of them together must use at most
70 % of the processors.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Coroutine
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import urlopen

from soak_programs import ENDING, LAUNCH, NODES
from soak_resources import FIFTHS, Heap, Held, Process, Processors
from table import free_port, heed_interrupts
from websockets.asyncio.client import connect

BIN = Path(sys.executable).parent
SAMPLE_S = 10.0
START_LIMIT_S = 180.0
MAX_PROCESSOR_PERCENT = 70.0
FAILURES = "failures"


class System:
    """All processes, started in their own folder."""

    #: The programs that print their counts as JSON.
    counting: tuple[str, ...] = ("client",)
    #: The rate of the talker and of the transforms.
    rate_hz = 50
    #: The times in seconds after which the nodes of the launch end.
    lives_s = (3.0, 5.0)

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.port = free_port()
        self.environment = {
            **os.environ,
            "PATH": f"{BIN}:/usr/bin:/bin",
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_HOME": str(folder),
            "ROS_PACKAGE_PATH": str(folder),
            "PYTHONUNBUFFERED": "1",
            "RATE_HZ": str(self.rate_hz),
        }
        self.counts = Counter({FAILURES: 0})
        self.running: dict[str, subprocess.Popen[str]] = {}
        self.held: dict[str, Held] = {}

    def open(self) -> None:
        """Start all processes."""
        package = self.folder / "soak"
        package.mkdir()
        (package / "package.xml").write_text("<package><name>soak</name></package>")
        (package / "soak.launch").write_text(LAUNCH.format(*self.lives_s))
        (package / "ending.py").write_text(ENDING)
        (package / "ending.py").chmod(0o755)
        self.start("roscore", "roscore", "-p", str(self.port))
        self.wait_for("roscore", r"started core service")
        for name, script in NODES.items():
            self.start(name, sys.executable, "-c", script)
        self.start("roslaunch", "roslaunch", "soak", "soak.launch")
        folder = str(self.folder / "all")
        options = ("-a", "-x", "/camera/.*", "--split", "--size=4", "--max-splits=3", "-O", folder)
        self.start("rosbag record", "rosbag", "record", *options)
        self.start("rqt_graph", "rqt_graph", "--no-browser")
        self.url = self.wait_for("rqt_graph", r"http://\S+")

    def clients(self) -> list[Coroutine[Any, Any, None]]:
        """Return the coroutines that run in this process beside the system, until they are cancelled."""
        return [look(self.url, self.counts)]

    def start(self, name: str, *command: str, stdin: int = subprocess.DEVNULL, **environment: str) -> None:
        with self.output(name).open("w") as output:
            self.running[name] = subprocess.Popen(
                command,
                env={**self.environment, **environment},
                cwd=self.folder,
                stdin=stdin,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                text=True,
            )
        self.held[name] = Process(pid=self.running[name].pid)

    def output(self, name: str) -> Path:
        return self.folder / f"{name.replace(' ', '_')}.output"

    def wait_for(self, name: str, pattern: str, limit_s: float = 60.0) -> str:
        """Return the first text of the program's output that matches the pattern."""
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            if found := re.search(pattern, self.output(name).read_text()):
                return found[0]
            time.sleep(0.05)
        raise SystemExit(f"{name} has not printed /{pattern}/ after {limit_s} s")

    def done(self) -> Counter[str]:
        """Return the counts of the clients and of the counting programs so far."""
        done = Counter(self.counts)
        for name in self.counting:
            lines = [line for line in self.output(name).read_text().splitlines() if line.startswith("{")]
            done.update(json.loads(lines[-1]) if lines else {})
            done[f"reports of {name}"] = len(lines)
        if "roslaunch" in self.running:
            done["nodes started by roslaunch"] = self.output("roslaunch").read_text().count("with pid")
        return done

    def idle(self) -> list[str]:
        """Return the names of the counts, and of the heaps, that are still empty."""
        heaps = [name for name, held in self.held.items() if isinstance(held, Heap) and not held.megabytes]
        return heaps + [name for name, count in self.done().items() if not count and name != FAILURES]

    def ended(self, good: tuple[int, ...] = ()) -> list[str]:
        """Return the programs that have ended, with their exit codes, except for those with a good code.

        No program should end by itself.
        """
        codes = {name: process.poll() for name, process in self.running.items()}
        return [f"{name} (exit code {code})" for name, code in codes.items() if code not in (None, *good)]

    def tracebacks(self) -> list[str]:
        """Return the programs that printed a traceback."""
        return [name for name in self.running if "Traceback" in self.output(name).read_text()]

    def print_outputs(self) -> None:
        """Print the end of each program's output."""
        for name in self.running:
            print(f"== {name}\n{self.output(name).read_text()[-2000:]}", file=sys.stderr)

    def close(self) -> list[str]:
        """End all programs. Return those that SIGINT did not end, or that have an unusual exit code."""
        for process in reversed(self.running.values()):
            process.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                process.wait(20)
            with suppress(ProcessLookupError):  # nothing of it is left
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            if process.stdin:
                process.stdin.close()
        return self.ended(good=(0, -signal.SIGINT))


async def look(url: str, counts: Counter[str]) -> None:
    """Act as a browser that keeps some views open, sometimes loads the page's files, and reconnects each
    minute.
    """
    parts = urlsplit(url)
    token = parts.fragment.partition("/")[0].removeprefix("token=")
    views = (("graph", {}), ("topic", {"name": "/chat"}), ("plot", {"field": "/go/status/header/seq"}))
    counts.update({"updates": 0, "pages": 0})
    while True:
        async with connect(
            f"ws://{parts.netloc}/live",
            origin=f"http://{parts.netloc}",
            max_size=None,
            proxy=None,
        ) as live:
            await live.send(json.dumps({"token": token}))
            for number, (view, args) in enumerate(views):
                await live.send(json.dumps({"id": number, "view": view, "args": args}))
            end = time.monotonic() + 60
            while time.monotonic() < end:
                await asyncio.wait_for(live.recv(), 60)
                counts["updates"] += 1
                if counts["updates"] % 20 == 0:
                    address = f"http://{parts.netloc}/"
                    await asyncio.to_thread(lambda address=address: urlopen(address, timeout=30).read())  # noqa: S310
                    counts["pages"] += 1


@dataclass(frozen=True, slots=True)
class Run:
    """The counts at each sample, what ended early, the usage of all processors in percent, and tracebacks."""

    history: list[Counter[str]]
    ended: list[str]
    own: float
    foreign: float
    tracebacks: list[str]


async def watch(system: System, minutes: float) -> Run:
    """Sample the resources for the given time, or until a program or a client ends."""
    history: list[Counter[str]] = []
    tasks = [asyncio.create_task(client) for client in system.clients()]
    try:
        latest_begin = time.monotonic() + START_LIMIT_S
        while idle := system.idle():
            if ended := all_ended(system, tasks):
                raise SystemExit(f"ended: {', '.join(ended)}")
            if time.monotonic() > latest_begin:
                raise SystemExit(f"not working after {START_LIMIT_S:.0f} s: {', '.join(idle)}")
            await asyncio.sleep(1)
        begin, processors = time.monotonic(), Processors()
        for number in range(1, max(FIFTHS * 2, int(minutes * 60 / SAMPLE_S)) + 1):
            await asyncio.sleep(max(0.0, begin + number * SAMPLE_S - time.monotonic()))
            for each in system.held.values():
                each.sample()
            history.append(system.done())
            if ended := all_ended(system, tasks):
                break
            if number % 6 == 0:
                columns = zip(*all_resources(system), strict=True)
                sums = [sum(values[-1] for values in column) for column in columns]
                figures = "{:,.0f} MB, {:.0f} threads, {:.0f} descriptors".format(*sums)
                print(
                    f"{number * SAMPLE_S / 60:5.1f} min: {figures}, {history[-1][FAILURES]} failures",
                    flush=True,
                )
        own, foreign = processors.percent()  # before Chromium ends, because its time is then lost
        return Run(history, ended, own, foreign, system.tracebacks())
    finally:
        while running := [task for task in tasks if not task.done()]:
            for task in running:
                task.cancel()
            # Chromium takes seconds to end; but wait_for in Python 3.11 and older may swallow a cancellation.
            await asyncio.wait(running, timeout=10)


def all_ended(system: System, tasks: list[asyncio.Task[None]]) -> list[str]:
    """Return the programs and the clients that have ended. Print the errors of the clients."""
    failed = [task for task in tasks if task.done()]
    for task in failed:
        task.print_stack()
    return system.ended() + [f"a client ({task.exception()!r})" for task in failed]


def all_resources(system: System) -> list[tuple[list[float], ...]]:
    """Return the samples of each process. The heaps are left out, because Chromium contains them."""
    return [each.resources for each in system.held.values() if each.files]


def soak_system(minutes: float, kind: type[System]) -> int:
    """Run everything for the given time, and print a table. Return 1 if the verdict is bad."""
    heed_interrupts()
    signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    random.seed(1)
    with tempfile.TemporaryDirectory() as folder:
        system, run = kind(Path(folder)), None
        try:
            system.open()
            run = asyncio.run(watch(system, minutes))
            if run.ended:
                system.print_outputs()
        except KeyboardInterrupt:
            pass
        except BaseException:
            system.print_outputs()
            raise
        finally:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # another one would leave processes running
            unclean = system.close()
    status = report(system.held, run) if run else 130
    if unclean:
        print(f"not ended well by SIGINT: {', '.join(unclean)}")
    return status or int(bool(unclean))


def report(held: dict[str, Held], run: Run) -> int:
    """Print the table and the verdict. Return 1 if it is bad."""
    history = run.history
    seconds = SAMPLE_S * (len(history) - 1)
    print("\n| process | MB | grown by | threads | grown by | descriptors | grown by | % of a processor |")
    print("| --- |" + " ---: |" * 7)
    for name, one in held.items():
        print(f"| {name} | {' | '.join(one.cells(seconds))} |")
    done = history[-1]
    print("\n" + ", ".join(f"{name}: {count:,}" for name, count in done.items()))
    grown = [name for name, one in held.items() if not one.is_flat]
    before = history[-(len(history) // FIFTHS) - 1]
    idle = [name for name, count in done.items() if name != FAILURES and count <= before[name]]
    print(f"processors: {run.own:.1f} % used by all of this, {run.foreign:.1f} % by others")
    print(f"verdict: {'flat' if not grown else 'grown: ' + ', '.join(grown)}; {done[FAILURES]} failures")
    bad = {"ended early": run.ended, "tracebacks": run.tracebacks}
    bad["stopped before the end"] = [] if run.ended else idle
    for what, names in bad.items():
        if names:
            print(f"{what}: {', '.join(names)}")
    is_too_busy = run.own > MAX_PROCESSOR_PERCENT
    if is_too_busy:
        print(f"more than {MAX_PROCESSOR_PERCENT:.0f} % of the processors were used")
    return int(bool(grown or done[FAILURES] or any(bad.values()) or is_too_busy))
