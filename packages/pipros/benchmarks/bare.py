#!/usr/bin/env python3
"""The least time that Python alone needs for two rows of `docs/performance.md`, beside pipros, in one run.

    benchmarks/bare.py [--rounds 9]

- Nested parameters: the numbers of 1,000 members written as XML with an f-string each, the same bytes sent
  through a TCP connection and answered, and each member found with one match of a regular expression and
  entered into a dictionary. No other parsing, no master, no checks.
- The first message after `roslaunch`: Python started with the modules of the standard library that every
  node imports, and after its end, two more at once. No pipros, no master, no connection.

Medians of the rounds.
"""

from __future__ import annotations

import argparse
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

from master import MasterProcess, measure
from startup import World, launch
from table import heed_interrupts

MODULES = "asyncio, dataclasses, inspect, logging, pathlib, subprocess, urllib.parse, xml.parsers.expat"
SET, HEARD = "setParam of 1,000 nested keys, ms", "roslaunch, first message received, 100 Hz"
MEMBER = re.compile(
    "<member><name>([^<]*)</name><value><(?:int>([0-9]+)</int|double>([0-9.]+)</double)></value></member>"
).match


def answer(listener: socket.socket) -> None:
    """Receive messages, each preceded by its length, and answer each with one byte."""
    connection, _ = listener.accept()
    with connection:
        while head := connection.recv(4, socket.MSG_WAITALL):
            connection.recv(int.from_bytes(head, "big"), socket.MSG_WAITALL)
            connection.sendall(b"!")


def bare_set(connection: socket.socket) -> None:
    values = {f"group_{i}/key_{j}": j * 1.5 if j % 2 else j for i in range(100) for j in range(10)}
    parts = [
        f"<member><name>{name}</name><value><int>{value}</int></value></member>"
        if type(value) is int
        else f"<member><name>{name}</name><value><double>{value!r}</double></value></member>"
        for name, value in values.items()
    ]
    text = "".join(parts)
    sent = text.encode()
    connection.sendall(len(sent).to_bytes(4, "big") + sent)
    connection.recv(1)
    found: dict[str, float] = {}
    at = 0
    while at < len(text):
        match = MEMBER(text, at)
        assert match
        name, whole, real = match.groups()
        found[name] = int(whole) if whole else float(real)
        at = match.end()
    assert found == values


def bare_set_ms() -> float:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=answer, args=(listener,), daemon=True).start()
        with socket.create_connection(listener.getsockname()) as connection:
            return 1e3 * statistics.median(timed(lambda: bare_set(connection)) for _ in range(50))


def timed(function: Callable[[], object]) -> float:
    began = time.perf_counter()
    function()
    return time.perf_counter() - began


def bare_launch() -> None:
    argv = [sys.executable, "-c", f"import {MODULES}"]
    subprocess.run(argv, check=True)
    for process in [subprocess.Popen(argv), subprocess.Popen(argv)]:
        process.wait()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=9, help="rounds, of which the median counts (9)")
    rounds = parser.parse_args().rounds
    heed_interrupts()
    measured: dict[str, list[float]] = {}
    master = MasterProcess("pipros", ["rosmaster", "--core"])
    try:
        with tempfile.TemporaryDirectory() as folder:
            world = World("pipros", f"{Path(sys.executable).parent}:/usr/bin:/bin", Path(folder, "home"))
            for _ in range(rounds):
                for name, value in (
                    ("setParam of 1,000 nested keys, ms", measure("pipros", "dictionary", master.uri)[SET]),
                    ("  bare", bare_set_ms()),
                    ("roslaunch, first message received, 100 Hz: s", launch(world)[HEARD]),
                    ("  bare ", timed(bare_launch)),
                ):
                    measured.setdefault(name, []).append(value)
    finally:
        master.stop()
    for name, values in measured.items():
        print(f"{name:45}{statistics.median(values):8.3f}")


if __name__ == "__main__":
    main()
